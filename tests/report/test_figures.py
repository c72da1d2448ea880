"""Figures of an object: residuals on their noise, regions, moduli by line, sections, pictures."""

from types import SimpleNamespace

import cv2
import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.result import CaptureFit
from palpate.report.fitted_figures import fits, known
from palpate.report.moduli_figure import HIGHEST_IN, moduli_figure
from palpate.report.press_pictures import FOUND, MEASURED, OUTLINE, WIDTH_PX, Frames, glimpses
from palpate.report.style import journal
from palpate.report.surface_figures import TrackedView, tracked_surface
from palpate.vision.camera import PinholeCamera

FOUND_JOINT = {
    "youngs_modulus_pa": {"value": 40e3, "low": 36e3, "high": 45e3},
    "youngs_modulus_1s_pa": {"value": 36e3, "low": 33e3, "high": 40e3},
    "poisson_ratio": {"value": 0.3},
    "law": {"force": {"value": 0.2, "std": 0.25}},
    "relaxation": {"times_s": [1.0], "fractions": [0.2]},
    "regions": {
        "force": [[100.0, 0.0], [0.0, 0.0]],
        "surface": [[0.0, 0.0], [0.0, 2500.0]],
        "both": [[100.0, 0.0], [0.0, 2500.0]],
    },
}


def capture_fit(away=(0.02, 0.04, 0.06), wild=0.0):
    depth, away = np.array([0.001, 0.003, 0.002]), np.array(away)
    moved = -0.01 * np.outer(depth, np.ones(len(away)))
    seen = moved.copy()
    seen[:, -1] += wild
    return CaptureFit(
        time_s=np.arange(3.0),
        tip_depth_m=depth,
        frames=np.arange(3),
        force_n=np.array([0.1, 0.5, 0.3]),
        depth_m=depth,
        fitted_depth_m=depth + 1e-4,
        depth_expected_std_m=np.full(3, 5e-5),
        moved_m=seen,
        fitted_moved_m=moved - 2e-5,
        moved_expected_std_m=np.full(moved.shape, 1e-5),
        cell_m=np.zeros((len(away), 3)),
        contact_m=np.zeros(3),
        distance_m=away,
    )


def test_residuals_lie_on_the_band_of_their_noise():
    """Twice 1.96 deviations wide: of depths by frame, of displacements by distance."""
    with journal():
        force, motion, *left = fits(["kinect"], [{"1": capture_fit(), "2": capture_fit()}]).axes
    np.testing.assert_allclose(force.lines[1].get_xdata(), [1.1, 2.1, 3.1])
    np.testing.assert_allclose(motion.lines[0].get_xdata(), [20, 40, 60])
    for axes, residual_mm, std_mm, ends in zip(
        left, (-0.1, 0.02), (0.05, 0.01), ([1, 3], [20, 60]), strict=True
    ):
        np.testing.assert_allclose(axes.lines[0].get_ydata(), residual_mm)
        corners = axes.collections[0].get_paths()[0].vertices
        assert np.abs(corners[:, 1]).max() == pytest.approx(1.96 * std_mm, rel=1e-3)
        assert [corners[:, 0].min(), corners[:, 0].max()] == pytest.approx(ends)


def test_values_far_from_all_others_are_left_outside_and_counted():
    one = capture_fit(np.linspace(0.02, 0.06, 401), wild=0.05)
    with journal():
        _, motion, _, left = fits(["kinect"], [{"1": one}]).axes
    for panel in (motion, left):
        assert panel.get_ylim()[1] < 50 and [text.get_text() for text in panel.texts] == [
            "1 outside"
        ]


def test_regions_law_and_relaxation():
    """Of 2.45 deviations: 10 % of E are determined by the depth, 0.02 of nu by the surface."""
    with journal():
        plane, law, over_time = known(["kinect"], [FOUND_JOINT], [3.0]).axes
    depth, surface, _ = (c.get_paths()[0].vertices for c in plane.collections[1::2])
    reach = np.sqrt(5.991)
    assert np.ptp(np.log(depth[:, 1])) == pytest.approx(0.2 * reach, rel=0.02)
    assert np.ptp(surface[:, 0]) == pytest.approx(0.04 * reach, rel=0.02)
    peak = law.lines[0].get_xdata()[np.argmax(law.lines[0].get_ydata())]
    assert peak == pytest.approx(0.2, abs=0.02)
    for line in over_time.lines[:2]:
        time, E = line.get_data()
        np.testing.assert_allclose(E, 40 * (1 - 0.2 * (1 - np.exp(-time))))


def found(star_pa, verdict="identified"):
    names = {"effective_reduced_modulus_pa": star_pa, "youngs_modulus_pa": 0.9 * star_pa}
    return {
        name: {"value": value, "low": 0.9 * value, "high": 1.2 * value, "verdict": verdict}
        for name, value in (names | {"poisson_ratio": 0.3}).items()
    }


@pytest.mark.parametrize("counts", [{"kinect": 1}, {"kinect": 2, "my_cam": 1}, {"kinect": 60}])
def test_captures_stand_above_what_they_say_together(counts):
    """Of each object and sensor with several; no figure is higher than a page."""
    groups = [
        {"object": name, "sensor": sensor, "provenance": "own"}
        for name in ("ear", "ball")
        for sensor in counts
    ]
    captures = [
        group | {"capture": f"{k + 1:02d}"}
        for group in groups
        for k in range(counts[group["sensor"]])
    ]
    singles = [found(1e3 * (10 + k), "bounded") for k in range(len(captures))]
    truths = {"ball": dict.fromkeys(found(1), 1)}
    with journal():
        figure = moduli_figure(captures, singles, groups, [found(9e3)] * len(groups), truths)
    assert figure.get_figheight() <= HIGHEST_IN
    place, dots = 0, []
    for count in counts.values():
        dots += [(10.0 + place + k, True) for k in range(count)] if count > 1 else []
        dots, place = [*dots, (9.0, False)], place + count
    ear, ball = figure.axes[0].lines, figure.axes[3].lines
    seen = [(line.get_xdata()[0], line.get_markerfacecolor() == "white") for line in ear[1::2]]
    assert seen == [(pytest.approx(value), hollow) for value, hollow in dots]
    assert ear[0].get_xdata() == pytest.approx(np.multiply(dots[0][0], [0.9, 1.2]))
    assert len(ball) == len(ear) + 1 and ball[-1].get_xdata() == pytest.approx([1e-3, 1e-3])


def test_the_section_of_a_ball_is_a_circle():
    radius_m, centre = 0.02, np.array([0.0, 0.001, -0.004])
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius_m)
    photo = np.arange(80, dtype=np.uint8).reshape(8, 10)
    shape = {"cloud_m": ball.vertices[:50], "photo": photo, "near": (slice(2, 6), slice(3, 9))}
    view = TrackedView(ball.vertices, ball.vertices * 0.9, ball.faces, centre, **shape)
    capture = {"object": "ball", "sensor": "my_cam", "point": "1", "provenance": "recorded"}
    figure = tracked_surface([capture], [view])
    lines = {line.get_label(): line for axes in figure.axes for line in axes.get_lines()}
    for label, part in (("undeformed", 1), ("tracked", 0.9)):
        place = np.array(lines[label].get_data()).T / 1e3 + centre[[0, 2]]
        expected = np.sqrt((part * radius_m) ** 2 - centre[1] ** 2)
        assert np.abs(np.hypot(*place.T) - expected).max() < 0.02 * radius_m
        # From neighbour to neighbour, and once around.
        around = np.linalg.norm(np.diff(place, axis=0), axis=1).sum()
        assert around == pytest.approx(2 * np.pi * expected, rel=0.02)
    plt.close(figure)


def frames(photo_shape=(60, 80, 3), tip=(0.0, 0.0, 1.0)):
    """A disc in the middle of grey pictures, and a square patch of a cloud on it."""
    rows, columns = np.mgrid[:60, :80]
    disc, side = (rows - 30) ** 2 + (columns - 40) ** 2 < 12**2, np.linspace(-0.1, 0.1, 9)
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    return Frames(
        photos=[np.full(photo_shape, 128, np.uint8)] * 5,
        masks=[disc] * 5,
        tips_m=np.tile(tip, (5, 1)),
        axes=np.tile([0.0, 1.0, 0.0], (5, 1)),
        clouds=[SimpleNamespace(points_m=np.column_stack([x, y, 1 + 0.1 * x]))] * 5,
        camera=PinholeCamera(80, 60, 100.0, 100.0, 40.0, 30.0),
        force_n=np.array([0.0, 0.4, 1.1, 2.0, 1.9]),
    )


@pytest.mark.parametrize("shape", [(60, 80, 3), (60, 80)])
def test_pictures_of_three_frames_with_outline_and_cloud(shape):
    """The deepest first, then about half the force, and the first; a missing tip is no matter."""
    pictures = list(glimpses(frames(shape), 3, "cam 1"))
    for one, said in zip(pictures, ["4 of 5", "3 of 5", "1 of 5"] * 2, strict=True):
        assert said in one.caption
    assert [one.shows for one in pictures] == [FOUND] * 3 + [MEASURED] * 3
    assert len(list(glimpses(frames(tip=(np.nan,) * 3), 3, "cam 1"))) == 6
    outlined, cloud = (
        cv2.imdecode(np.frombuffer(pictures[k].jpeg, np.uint8), cv2.IMREAD_COLOR).astype(float)
        for k in (0, 3)
    )
    # The window is the 20 px of the cloud and, on each side, a part of the 25 px to the target.
    near = np.linalg.norm(outlined - OUTLINE[::-1], axis=2) < 120
    across = np.flatnonzero(near[outlined.shape[0] // 2])
    assert np.ptp(across) / WIDTH_PX == pytest.approx(22 / 36, rel=0.1)
    left, right = np.split(cloud[cloud.shape[0] // 2].mean(axis=1), 2)
    assert right.max() > left.max() + 40
