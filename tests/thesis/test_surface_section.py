"""The section through a tracked surface, of a form that is above and below itself."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.report.surface_figures import TrackedView, _near, tracked_surface

RADIUS_M = 0.02


CENTRE = np.array([0.0, 0.001, -0.2 * RADIUS_M])


@pytest.fixture
def figure():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS_M)
    view = TrackedView(
        ball.vertices,
        ball.vertices * 0.9,
        ball.faces,
        ball.vertices[:50],
        CENTRE,
        np.arange(80, dtype=np.uint8).reshape(8, 10),
        (slice(2, 6), slice(3, 9)),
    )
    capture = {"object": "ball", "sensor": "my_cam", "capture": "1", "point": "1"}
    drawn = tracked_surface([capture | {"provenance": "recorded"}], [view])
    yield drawn
    plt.close(drawn)


def test_the_photograph_is_shown_around_the_contact(figure):
    (image,) = figure.axes[0].get_images()
    assert image.get_array().shape == (4, 6) and image.get_array()[0, 0] == 23
    color = {"fx_px": 500, "fy_px": 500, "cx_px": 320, "cy_px": 240}
    color |= {"width_px": 640, "height_px": 480}
    pose = np.eye(4)
    pose[:3, 3] = 0.25, 0.0, 0.5
    rows, columns = _near(color, pose, np.zeros(3))
    assert (rows, columns) == (slice(150, 331), slice(480, 640))


def test_the_legend_does_not_lie_over_the_section(figure):
    figure.canvas.draw()
    section = figure.axes[2]
    box = section.get_legend().get_window_extent()
    assert not box.overlaps(section.get_window_extent())
    assert figure.bbox.contains(*box.min) and figure.bbox.contains(*box.max)


def test_the_section_of_a_ball_is_a_circle(figure):
    centre = CENTRE
    lines = {line.get_label(): line for axes in figure.axes for line in axes.get_lines()}
    for label, radius_m in (("undeformed", RADIUS_M), ("tracked", 0.9 * RADIUS_M)):
        place = np.array(lines[label].get_data()).T / 1e3 + centre[[0, 2]]
        expected = np.sqrt(radius_m**2 - centre[1] ** 2)
        assert np.abs(np.hypot(*place.T) - expected).max() < 0.02 * radius_m
        # From neighbour to neighbour, and once around.
        steps = np.linalg.norm(np.diff(place, axis=0), axis=1)
        assert steps.max() < 0.3 * radius_m
        assert abs(steps.sum() / (2 * np.pi * expected) - 1) < 0.02


def test_the_section_is_as_high_as_what_was_captured(figure):
    """Points of the ball's cloud lie up to 24 mm above this contact; so high is no panel."""
    assert figure.axes[2].get_ylim() == (-14, 16)
