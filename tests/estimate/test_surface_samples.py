"""Normals of points at rest, how heights scatter, and what the probe hides."""

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.deviations import correlation_length
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import (
    ProbeInView,
    RestSurface,
)
from palpate.surface.template import Template
from scipy.spatial import cKDTree

UP = np.array([0.0, 0, 1])


def at_rest(mesh, points, normals):
    surface = RestSurface(Template(np.array(mesh.vertices), np.array(mesh.faces)))
    return surface.at_rest(points, normals, Observation(largest_distance_m=0.01))


def test_points_have_the_normals_of_balls_and_of_a_boxs_sides():
    """A ball's facets are turned by up to four degrees."""
    out = np.random.default_rng(2).normal(size=(500, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    found = at_rest(trimesh.creation.icosphere(3, radius=0.06), 0.061 * out, out)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(np.ones(500))
    angle = np.degrees(np.arccos(np.clip((found.normal * out).sum(axis=1), -1, 1)))
    assert angle.max() < 0.5
    box = trimesh.creation.box((0.1, 0.1, 0.04)).subdivide()
    above = np.column_stack([np.linspace(-0.049, 0.049, 30), np.full(30, 0.02), np.full(30, 0.022)])
    up = np.tile(UP, (30, 1))
    found = at_rest(box, above, up)
    assert found.normal == pytest.approx(up)
    assert found.distance_m == pytest.approx(np.full(30, 0.002), abs=1e-6)


@pytest.mark.parametrize("length_m", [0.005, 0.010])
def test_length_of_the_noises_correlation(length_m):
    x, y = (one.ravel() for one in np.mgrid[-0.04:0.04:0.0035, -0.04:0.04:0.0035])
    places = np.column_stack([x, y, 0 * x])
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    values, vectors = np.linalg.eigh(np.exp(-((apart / length_m) ** 2)))
    root = vectors * np.sqrt(np.maximum(values, 0))
    noise = (root @ np.random.default_rng(2).standard_normal((len(places), 60))).T
    noise[3, :40] = np.nan
    assert correlation_length(places, noise) == pytest.approx(length_m, rel=0.06)
    assert correlation_length(places[:1], noise[:, :1]) == 0


@pytest.mark.parametrize("along_m", [(0.0, 0.05), (0.1, 0.2)])
def test_clearance_is_that_of_the_worst_view_and_of_a_part_of_the_probe(along_m):
    """Against brute force: lines of sight that pass it, end before it, or begin beyond it."""
    rng = np.random.default_rng(1)
    views, places = 0.5 * rng.standard_normal((2, 3)), 0.1 * rng.standard_normal((40, 3))
    axis = np.array([0.0, 0.6, -0.8])
    seen = ProbeInView(views, np.zeros((2, 3)) + [0, 0, 0.01], np.tile(axis, (2, 1)))
    part = np.linspace(0, 1, 801)[:, None]
    shaft = seen.tip_m[1] - (along_m[0] + part * np.ptp(along_m)) * axis
    for place, found in zip(places, seen.clearance(places, 1, along_m=along_m), strict=True):
        lines = np.concatenate([place + part * (view - place) for view in views])
        assert found == pytest.approx(cKDTree(shaft).query(lines)[0].min(), abs=1.5e-3)
