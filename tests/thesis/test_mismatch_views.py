"""Views of the mismatch on an object, and the first iterations of a minimisation."""

import numpy as np
import pytest
import trimesh
from palpate.report import style
from palpate.report.views import View
from thesis.chapter5 import minimisation_figures as figures
from thesis.chapter5 import mismatch_views

CAPTURE = {"object": "foam_ball", "sensor": "kinect", "point": "01", "provenance": "simulated"}


@pytest.fixture
def ball():
    """A ball whose mismatch is 2 mm on its far half, with a node inside that counts nowhere."""
    sphere = trimesh.creation.icosphere(2, 0.06)
    nodes = np.vstack([sphere.vertices, [[0, 0, 0]]])
    mismatch = np.where(nodes[:, 1] > 0, 2e-3, 5e-4)
    mismatch[-1] = 0
    return mismatch_views.Mismatch(nodes, sphere.faces, mismatch, np.array([0, 0, 0.06]))


@pytest.mark.long
def test_both_sides_are_shown_in_one_size(ball):
    with style.journal():
        figure = mismatch_views.mismatch_views([CAPTURE], [ball], [View(-90.0, 0.0)])
        panels = figure.axes[:2]
        near, far = (panel.get_images()[0].get_array() for panel in panels)
    assert near.shape == far.shape
    middle = tuple(size // 2 for size in near.shape[:2])
    # The map runs from grey to orange: the far side is redder than blue.
    assert far[middle][0] / far[middle][2] > 2 * near[middle][0] / near[middle][2]
    words = [text.get_text() for text in figure.texts + panels[1].texts]
    assert "median 0.50 mm, largest 2.0 mm" in words
    assert "simulated captures" in words


def test_first_iterations_alone():
    trace = [
        {"iteration": k, "lame_lambda_pa": 1e4, "lame_mu_pa": 9e3, "error_m": 1e-3 / k}
        for k in range(1, 60)
    ]
    minimum = {"trace": trace}
    with style.journal():
        for wanted, shown in ((None, 59), (40, 40)):
            options = {"error": "displacement", "iterations": wanted}
            figure = figures.figure_5_8([CAPTURE], [minimum], **options)
            lines = [panel.get_lines()[0].get_xdata() for panel in figure.axes]
            assert [len(line) for line in lines] == [shown] * 3
