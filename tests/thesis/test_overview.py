"""The picture of the tool: intervals of each sensor beside the truth."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from palpate.report.surface_figures import TrackedView
from thesis.accuracy.overview import overview

TRUTH = {"youngs_modulus_pa": 25e3, "poisson_ratio": 0.3}


@pytest.fixture
def view():
    ball = trimesh.creation.icosphere(3, 0.03)
    rest = np.asarray(ball.vertices)
    cloud = rest[rest[:, 2] > 0]
    photo = np.zeros((24, 32, 3), np.uint8)
    return TrackedView(rest, rest * 0.9, np.asarray(ball.faces), cloud, rest[0], photo)


def joint(E, nu):
    wide = {"verdict": "identified"}
    return {
        "youngs_modulus_pa": wide | {"value": E, "low": 0.9 * E, "high": 1.1 * E},
        "poisson_ratio": wide | {"value": nu, "low": nu - 0.1, "high": nu + 0.1},
    }


def test_intervals_stand_beside_the_truth(view):
    groups = [{"object": "ball", "sensor": name} for name in ("bumblebee", "kinect")]
    capture = {"object": "ball", "sensor": "kinect", "point": "01", "provenance": "simulated"}
    figure = overview(capture, view, groups, [joint(26e3, 0.2), joint(24e3, 0.4)], TRUTH)
    modulus, ratio = figure.axes[2:]
    drawn = [line.get_xdata() for line in modulus.lines]
    assert any(np.allclose(x, [23.4, 28.6]) for x in drawn)
    assert any(np.allclose(x, [25.0, 25.0]) for x in drawn)
    assert any(np.allclose(line.get_xdata(), [0.3, 0.5]) for line in ratio.lines)
    assert [label.get_text() for label in modulus.get_yticklabels()] == ["Bumblebee2", "Kinect"]
    assert "simulated captures" in [text.get_text() for text in figure.texts]
    plt.close(figure)
