"""The section through a tracked surface, of a form that is above and below itself."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.report.surface_figures import TrackedView, tracked_surface

RADIUS_M = 0.02
CENTRE = np.array([0.0, 0.001, -0.2 * RADIUS_M])


@pytest.fixture
def figure():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS_M)
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
    for label, radius_m in (("undeformed", RADIUS_M), ("tracked", 0.9 * RADIUS_M)):
        place = np.array(lines[label].get_data()).T / 1e3 + CENTRE[[0, 2]]
        expected = np.sqrt(radius_m**2 - CENTRE[1] ** 2)
        assert np.abs(np.hypot(*place.T) - expected).max() < 0.02 * radius_m
        # From neighbour to neighbour, and once around.
        steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
        assert steps.max() < 0.3 * radius_m
        assert abs(steps.sum() / (2 * np.pi * expected) - 1) < 0.02
