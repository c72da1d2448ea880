"""Figures of an object: regions, law and relaxation of an estimate; sections of a surface."""

from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.result import CaptureFit
from palpate.report.fitted_figures import known
from palpate.report.press_pictures import Frames
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


def capture_fit():
    depth, away = np.array([0.001, 0.003, 0.002]), np.array([0.02, 0.04, 0.06])
    moved = -0.01 * np.outer(depth, np.ones(3))
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
