"""Feet of points on an undeformed surface."""

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.samples import RestSurface
from palpate.surface.template import Template

RADIUS_M = 0.06


def feet(mesh, points, normals):
    surface = RestSurface(Template(np.array(mesh.vertices), np.array(mesh.faces)))
    return surface.at_rest(points, normals, largest_distance_m=0.01, largest_normal_deg=60)


def test_feet_on_a_ball_have_the_balls_normals_not_the_facets():
    ball = trimesh.creation.icosphere(3, radius=RADIUS_M)
    out = np.random.default_rng(2).normal(size=(500, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    found = feet(ball, (RADIUS_M + 0.001) * out, out)
    assert len(found.normal) == 500
    angle = np.degrees(np.arccos(np.clip((found.normal * out).sum(axis=1), -1, 1)))
    # Facets are turned by up to four degrees.
    assert angle.max() < 0.5
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(np.ones(500))


def test_feet_on_a_box_keep_its_sides():
    box = trimesh.creation.box((0.1, 0.1, 0.04)).subdivide()
    above = np.column_stack([np.linspace(-0.049, 0.049, 30), np.full(30, 0.02), np.full(30, 0.022)])
    up = np.tile([0.0, 0, 1], (30, 1))
    found = feet(box, above, up)
    assert found.normal == pytest.approx(up)
    assert found.distance_m == pytest.approx(np.full(30, 0.002), abs=1e-6)
