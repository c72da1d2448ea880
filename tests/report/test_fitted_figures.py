"""Figures of an object: what was seen, computed and known, its moduli, its tracked surface."""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.result import CaptureFit
from palpate.report.fitted_figures import fits, known
from palpate.report.moduli_figure import HIGHEST_IN, moduli_figure
from palpate.report.style import journal
from palpate.report.surface_figures import TrackedView, tracked_surface

FOUND = {
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


def capture_fit():
    depth, away = np.array([0.001, 0.003, 0.002]), np.array([0.02, 0.04, 0.06])
    moved = -0.01 * np.outer(depth, [3.0, 2.0, 1.0])
    return CaptureFit(
        time_s=np.arange(3.0),
        tip_depth_m=depth,
        frames=np.arange(3),
        force_n=np.array([0.1, 0.5, 0.3]),
        depth_m=depth,
        fitted_depth_m=depth + 1e-4,
        depth_expected_std_m=np.full(3, 5e-5),
        moved_m=moved,
        fitted_moved_m=moved - 2e-5,
        moved_expected_std_m=np.full((3, 3), 1e-5),
        cell_m=np.zeros((3, 3)),
        contact_m=np.zeros(3),
        distance_m=away,
    )


@pytest.fixture
def panels():
    with journal():
        yield fits(["kinect"], [{"1": capture_fit(), "2": capture_fit()}]).axes


def test_residuals_lie_on_the_band_of_their_noise(panels):
    """Twice 1.96 deviations wide: of depths by frame, of motions by distance."""
    _, _, *left = panels
    for axes, std_mm, ends in zip(left, (0.05, 0.01), ([1, 3], [20, 60]), strict=True):
        for band in axes.collections:
            corners = band.get_paths()[0].vertices
            assert np.abs(corners[:, 1]).max() == pytest.approx(1.96 * std_mm, rel=1e-3)
            assert [corners[:, 0].min(), corners[:, 0].max()] == pytest.approx(ends)
        assert len(axes.collections) == 2


def test_force_and_what_is_left_of_the_depth(panels):
    force, _, left, _ = panels
    seen, computed = force.lines[:2]
    np.testing.assert_allclose(seen.get_xdata(), [1, 3, 2])
    np.testing.assert_allclose(computed.get_xdata(), [1.1, 2.1, 3.1])
    np.testing.assert_allclose(left.lines[0].get_ydata(), -0.1)
    assert len(force.lines) == 4 and len(force.get_legend().get_texts()) == 2


def test_motion_of_the_deepest_frame_along_the_normals(panels):
    _, motion, _, left = panels
    np.testing.assert_allclose(motion.lines[0].get_xdata(), [20, 40, 60])
    np.testing.assert_allclose(motion.lines[0].get_ydata(), [-0.09, -0.06, -0.03])
    np.testing.assert_allclose(left.lines[0].get_ydata(), 0.02)


def test_values_far_from_all_others_are_left_outside_and_counted():
    one = capture_fit()
    many = np.linspace(-2e-5, 2e-5, 400)
    wild = np.concatenate([many, [0.05]])
    one = replace(
        one,
        moved_m=np.tile(wild, (3, 1)),
        fitted_moved_m=np.zeros((3, 401)),
        moved_expected_std_m=np.full((3, 401), 1e-5),
        distance_m=np.linspace(0.02, 0.06, 401),
    )
    with journal():
        _, motion, _, left = fits(["kinect"], [{"1": one}]).axes
    for panel in (motion, left):
        assert panel.get_ylim()[1] < 0.05
        assert [text.get_text() for text in panel.texts] == ["1 outside"]


def test_regions_law_and_relaxation():
    """Of 2.45 deviations: 10 % of E are told by the tip, 0.02 of nu by the surface."""
    with journal():
        plane, law, over_time = known(["kinect"], [FOUND], [3.0]).axes
    tip, surface, both = (c.get_paths()[0].vertices for c in plane.collections[1::2])
    reach = np.sqrt(5.991)
    assert np.ptp(np.log(tip[:, 1])) == pytest.approx(0.2 * reach, rel=0.02)
    assert np.ptp(tip[:, 0]) == pytest.approx(0.5)
    assert np.ptp(surface[:, 0]) == pytest.approx(0.04 * reach, rel=0.02)
    assert np.ptp(both[:, 0]) == pytest.approx(0.04 * reach, rel=0.02)
    peak = law.lines[0].get_xdata()[np.argmax(law.lines[0].get_ydata())]
    assert peak == pytest.approx(0.2, abs=0.02)
    for line in over_time.lines[:2]:
        time, E = line.get_data()
        np.testing.assert_allclose(E, 40 * (1 - 0.2 * (1 - np.exp(-time))))


def found(star_pa, verdict="identified"):
    values = {
        "effective_reduced_modulus_pa": star_pa,
        "youngs_modulus_pa": 0.9 * star_pa,
        "poisson_ratio": 0.3,
    }
    return {
        name: {"value": value, "low": 0.9 * value, "high": 1.2 * value, "verdict": verdict}
        for name, value in values.items()
    }


@pytest.mark.parametrize("counts", [{"kinect": 1}, {"kinect": 2, "my_cam": 1}, {"kinect": 60}])
def test_captures_stand_above_what_they_say_together(counts):
    """Of each sensor with several; the figure is no higher than a page, truth is beside."""
    known = {"object": "ball", "provenance": "simulated"}
    captures = [
        known | {"sensor": sensor, "capture": f"{k + 1:02d}"}
        for sensor, count in counts.items()
        for k in range(count)
    ]
    singles = [found(1e3 * (10 + k), "bounded") for k in range(len(captures))]
    groups, joints = [known | {"sensor": sensor} for sensor in counts], [found(9e3)] * len(counts)
    with journal():
        figure = moduli_figure(
            captures, singles, groups, joints, {"ball": dict.fromkeys(found(1), 1)}
        )
    star, _, nu = figure.axes
    expected, number = [], 0
    for count in counts.values():
        expected += [(10.0 + k, True) for k in range(number, number + count)] if count > 1 else []
        expected, number = [*expected, (9.0, False)], number + count
    *lines, truth = star.lines
    dots = [(line.get_xdata()[0], line.get_markerfacecolor() == "white") for line in lines[1::2]]
    assert dots == [(pytest.approx(value), hollow) for value, hollow in expected]
    ends = np.array([line.get_xdata() for line in lines[::2]])
    assert ends == pytest.approx(np.outer([value for value, _ in expected], [0.9, 1.2]))
    assert truth.get_xdata() == pytest.approx([1e-3, 1e-3])
    assert nu.get_xlim() == (0, 0.5) and figure.get_figheight() <= HIGHEST_IN


def test_each_object_has_a_row_of_panels():
    groups = [{"object": name, "sensor": "kinect", "provenance": "own"} for name in ("ear", "ball")]
    captures = [group | {"capture": "01"} for group in groups]
    with journal():
        figure = moduli_figure(captures, [found(1e3)] * 2, groups, [found(1e3), found(9e3)], {})
    assert [axes.lines[1].get_xdata()[0] for axes in figure.axes[::3]] == pytest.approx([1.0, 9.0])


BALL_M = 0.02
CENTRE = np.array([0.0, 0.001, -0.2 * BALL_M])


@pytest.fixture
def figure():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=BALL_M)
    view = TrackedView(
        ball.vertices,
        ball.vertices * 0.9,
        ball.faces,
        CENTRE,
        cloud_m=ball.vertices[:50],
        photo=np.arange(80, dtype=np.uint8).reshape(8, 10),
        near=(slice(2, 6), slice(3, 9)),
    )
    capture = {"object": "ball", "sensor": "my_cam", "capture": "1", "point": "1"}
    drawn = tracked_surface([capture | {"provenance": "recorded"}], [view])
    yield drawn
    plt.close(drawn)


def test_the_section_of_a_ball_is_a_circle(figure):
    lines = {line.get_label(): line for axes in figure.axes for line in axes.get_lines()}
    for label, radius_m in (("undeformed", BALL_M), ("tracked", 0.9 * BALL_M)):
        place = np.array(lines[label].get_data()).T / 1e3 + CENTRE[[0, 2]]
        expected = np.sqrt(radius_m**2 - CENTRE[1] ** 2)
        assert np.abs(np.hypot(*place.T) - expected).max() < 0.02 * radius_m
        # From neighbour to neighbour, and once around.
        steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
        assert steps.max() < 0.3 * radius_m
        assert abs(steps.sum() / (2 * np.pi * expected) - 1) < 0.02
