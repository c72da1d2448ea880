"""Distance from sharp edges."""

import numpy as np
import pytest
import trimesh
from palpate.surface.sharp_edges import sharp_edge_distance


def test_distance_from_the_edges_of_a_box():
    box = trimesh.creation.box((0.1, 0.1, 0.04))
    points = np.array([[0, 0, 0.02], [0.04, 0.03, 0.02], [0.05, 0, 0.015]])
    found = sharp_edge_distance(box.vertices, box.faces, points)
    assert found == pytest.approx([0.05, 0.01, 0.005], abs=1e-5)


def test_a_ball_has_none():
    ball = trimesh.creation.icosphere(3, radius=0.06)
    assert np.isinf(sharp_edge_distance(ball.vertices, ball.faces, ball.vertices[:2])).all()
