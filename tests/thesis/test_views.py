"""Views of a surface and pictures of it."""

import numpy as np
import pytest
import trimesh
from palpate.report.panels import Surface
from thesis.views import View, render_surface, view_from


def test_a_parallel_view_stands_where_the_camera_stood():
    view = View(-72, 33)
    assert np.allclose(view.axes @ view.axes.T, np.eye(3))
    assert view.project(np.array([[0, 0, 0.001]]))[0, 1] == pytest.approx(np.cos(np.deg2rad(33)))
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1, -1, -1])
    pose[2, 3] = 0.5
    assert view_from(pose).elevation_deg == pytest.approx(90)
    assert view_from(pose, elevation_deg=10).elevation_deg == 10


def test_picture_of_a_ball_covers_its_disc():
    frame = np.array([-80.0, 80, -80, 80])
    fine = trimesh.creation.icosphere(4, 0.06)
    picture = render_surface(fine.vertices, fine.faces, View(20, 30), frame, width_px=320)
    area = picture[..., 3].mean() * 160**2
    assert area == pytest.approx(np.pi * 60**2, rel=0.01)
    assert picture[160, 160, 3] == 1


def test_volume_and_displacement_of_a_squeezed_ball():
    mesh = trimesh.creation.icosphere(2, 0.06)
    moved = mesh.vertices * [1, 1, 0.9]
    ball = Surface(mesh.vertices, moved, mesh.faces, np.array([0, 0, 0.06]))
    assert ball.volume_change() == pytest.approx(-0.1)
    assert ball.displacement_mm().max() == pytest.approx(6)
