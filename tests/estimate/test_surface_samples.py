"""Samples of a surface: where they lie, what belongs to them, how heights scatter, what is seen."""

import numpy as np
import pytest
import trimesh
from palpate.estimate.direct.deviations import correlation_length
from palpate.estimate.direct.motion import CLEAR_WINDOWS, tip_clearance, views_of
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import (
    ClosestAtRest,
    ProbeInView,
    RestSurface,
    Samples,
    facing_samples,
    samples_of,
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


def closest(places, normals=UP):
    places = np.array(places, dtype=float)
    normal = np.array(np.broadcast_to(normals, places.shape))
    return ClosestAtRest(places, normal, np.zeros(len(places)))


def test_samples_keep_their_distance_and_lie_at_the_means_of_all_frames_points():
    """Points at every millimetre along x, a centre at 10.2 mm, seeds three millimetres apart."""
    line = [[k * 1e-3, 0, 0] for k in range(21)]
    found = samples_of([closest(line)], np.array([0.0102, 0, 0]), spacing_m=0.003)
    # Seeds at 10, then 14 and 6, then 18 and 2: each point is of the nearest, 4 mm between.
    expected = [0.0015, 0.0055, 0.0095, 0.0135, 0.0185]
    assert np.sort(found.cell_m[:, 0]) == pytest.approx(expected, abs=1.1e-3)
    assert found.cell_m[0, 0] == pytest.approx(0.01, abs=1.1e-3)
    assert found.normal == pytest.approx(np.tile(UP, (5, 1)))
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


def test_where_sensors_see_from_and_how_far_from_the_tip_a_line_must_pass():
    turned = np.array([[0.0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    depth = {"baseline_m": 0.075, "color_from_depth": turned.tolist()}
    light = views_of({"kind": "structured_light", "depth": depth})
    assert light == pytest.approx(np.array([[0.1, 0.2, 0.3], [0.1, 0.275, 0.3]]))
    assert views_of({"kind": "depth", "depth": depth}) == pytest.approx(light[:1])
    stereo = views_of({"kind": "stereo", "stereo": {"baseline_m": 0.12}})
    assert stereo == pytest.approx(np.array([[0, 0, 0], [0.12, 0, 0]]))
    with pytest.raises(ValueError, match="kind: expected stereo, structured_light, depth or cloud"):
        views_of({"kind": "laser"})
    stereo = {"kind": "stereo", "stereo": {"window_px": 11}, "color": {"fx_px": 800.0}}
    options = Observation(clear_m=0.02)
    # Windows of 11 pixels of 0.6 m / 800.
    beside_m = CLEAR_WINDOWS * 11 * 0.6 / 800
    assert tip_clearance(stereo, 0.6, options, radius_m=0.006) == pytest.approx(0.006 + beside_m)
    assert tip_clearance({"kind": "depth"}, 0.6, options, radius_m=0.006) == 0.02


def probe(frames):
    """Above the origin, its shaft straight up; in the last frame it was not found."""
    tip = np.tile([0.0, 0, 0.01], (frames, 1))
    tip[-1] = np.nan
    views = np.array([[0.0, 0, 0.5], [0.3, 0, 0.5]])
    return ProbeInView(views, tip, np.tile([0.0, 0, -1], (frames, 1)))


@pytest.mark.parametrize(("largest_view_deg", "kept"), [(45, [0]), (65, [0, 1, 2])])
def test_samples_that_are_seen_from_the_side(largest_view_deg, kept):
    """The second is 59 degrees from both views, the third 50 degrees from the second view."""
    samples = Samples(
        np.array([[0.0, 0, 0], [0.0, 0.2, 0], [-0.3, 0, 0]]), np.array([UP, [0, 0.6, 0.8], UP])
    )
    found = facing_samples(samples, probe(2), Observation(largest_view_deg=largest_view_deg))
    assert np.array_equal(found.cell_m, samples.cell_m[kept])


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
