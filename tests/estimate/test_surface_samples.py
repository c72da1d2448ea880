"""Samples of a surface: where they lie, what belongs to them, and how far heights scatter."""

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.deviations import correlation_length
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import ClosestAtRest, RestSurface, Samples, samples_of
from palpate.surface.template import Template

UP = np.array([0.0, 0, 1])


def at_rest(mesh, points, normals):
    surface = RestSurface(Template(np.array(mesh.vertices), np.array(mesh.faces)))
    return surface.at_rest(points, normals, Observation(largest_distance_m=0.01))


def test_points_on_a_ball_have_its_normals_and_not_those_of_facets():
    """Facets are turned by up to four degrees."""
    out = np.random.default_rng(2).normal(size=(500, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    found = at_rest(trimesh.creation.icosphere(3, radius=0.06), 0.061 * out, out)
    assert np.linalg.norm(found.normal, axis=1) == pytest.approx(np.ones(500))
    angle = np.degrees(np.arccos(np.clip((found.normal * out).sum(axis=1), -1, 1)))
    assert angle.max() < 0.5


def test_points_on_a_box_have_the_normals_of_its_sides():
    box = trimesh.creation.box((0.1, 0.1, 0.04)).subdivide()
    above = np.column_stack([np.linspace(-0.049, 0.049, 30), np.full(30, 0.02), np.full(30, 0.022)])
    up = np.tile(UP, (30, 1))
    found = at_rest(box, above, up)
    assert found.normal == pytest.approx(up)
    assert found.distance_m == pytest.approx(np.full(30, 0.002), abs=1e-6)


def closest(places, normals=UP):
    places = np.array(places, dtype=float)
    normal = np.array(np.broadcast_to(normals, places.shape))
    return ClosestAtRest(places, normal, np.zeros(len(places)))


def test_samples_begin_at_the_centre_and_keep_their_distance():
    """Points at every millimetre along x, a centre at 10.2 mm, seeds three millimetres apart."""
    line = [[k * 1e-3, 0, 0] for k in range(21)]
    found = samples_of([closest(line)], np.array([0.0102, 0, 0]), spacing_m=0.003)
    # Seeds at 10, then 14 and 6, then 18 and 2: each point is of the nearest, 4 mm between.
    expected = [0.0015, 0.0055, 0.0095, 0.0135, 0.0185]
    assert np.sort(found.cell_m[:, 0]) == pytest.approx(expected, abs=1.1e-3)
    assert found.cell_m[0, 0] == pytest.approx(0.01, abs=1.1e-3)
    assert found.normal == pytest.approx(np.tile(UP, (5, 1)))


def test_samples_lie_at_the_means_of_all_frames_points():
    first = closest([[0, 0, 0], [0.01, 0, 0]])
    side = np.array([0.5, 0, np.sqrt(0.75)])
    later = closest([[0.001, 0.002, 0], [0.009, 0, 0.001], [0.5, 0, 0]], normals=[UP, side, UP])
    other = closest([[0.0005, 0, 0]], normals=-UP)
    found = samples_of([first, later, other], np.zeros(3), spacing_m=0.004)
    assert found.cell_m == pytest.approx(np.array([[0.0005, 0.001, 0], [0.0095, 0, 0.0005]]))
    # A normal turned by half a radian is still alike; one turned round belongs to another side.
    mean = (UP + side) / np.linalg.norm(UP + side)
    assert found.normal == pytest.approx(np.stack([UP, mean]))


@pytest.mark.parametrize(
    ("x_m", "tilt", "number"),
    [(0.004, 0, 0), (0.006, 0, 1), (0.014, 0, 1), (0.0161, 0, -1), (0, 0.5, 0), (0, 0.62, -1)],
)
def test_points_belong_to_the_nearest_sample_that_faces_alike(x_m, tilt, number):
    samples = Samples(np.array([[0.0, 0, 0], [0.01, 0, 0]]), np.stack([UP, UP]))
    point = closest([[x_m, 0, 0]], normals=np.array([tilt, 0, np.sqrt(1 - tilt**2)]))
    assert samples.numbers(point, reach_m=0.006).tolist() == [number]


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
