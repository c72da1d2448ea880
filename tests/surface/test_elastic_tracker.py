"""The elastic tracker: contact, support, points, its weight; and its hyperelastic energy."""

import json
from dataclasses import replace

import numpy as np
import pytest
from floor import floor
from palpate.solid.mesh import solid_mesh
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.surface.alignment import Alignment
from palpate.surface.elastic import ElasticTracker, Sphere, Table
from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.neo_hookean import LogNeoHookean
from palpate.surface.options import ElasticTracking
from palpate.surface.pose import to_camera
from palpate.surface.template import Template
from palpate.surface.tracked import Recorded
from scipy.spatial.transform import Rotation
from skfem import MeshTet

RADIUS_M = 0.006
TOP_M = np.array([0.0, 0.0, 0.04])
# Nothing is refined: what made the frames tracks them.
COARSE = {"refine_edge_m": 0.1, "solid_edge_m": 0.1, "solid_growth": 0.8}
OPTIONS = ElasticTracking(refine_radius_m=0.012, misfit_reach_m=0.06, **COARSE)
NO_POINTS = (np.zeros((0, 3)), np.zeros((0, 3)))
TABLE = Table(np.zeros(3), np.array([0.0, 0.0, 1.0]))


@pytest.fixture(scope="module")
def solid():
    """Cuboid 80 x 80 x 40 mm on z = 0."""
    mesh = MeshTet().refined(3)
    return solid_mesh((mesh.p.T - [0.5, 0.5, 0.0]) * [0.08, 0.08, 0.04], mesh.t.T)


@pytest.fixture(scope="module")
def template(solid):
    nodes = solid.surface_nodes()
    return Template(solid.nodes_m[nodes], np.searchsorted(nodes, solid.surface_triangles()))


@pytest.fixture(scope="module")
def tracker(solid, template):
    return new_tracker(solid, template)


def new_tracker(solid, template):
    held = np.flatnonzero(solid.nodes_m[:, 2] < 1e-9)
    return ElasticTracker(template, solid, held, TABLE, ElasticTracking())


def points_of(vertices, faces, count, seed, noise_m=0.0):
    """Points spread over all triangles but the bottom's, with their normals."""
    rng, corners = np.random.default_rng(seed), vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    normals /= areas[:, None]
    seen = np.flatnonzero(normals[:, 2] > -0.5)
    chosen = rng.choice(seen, count, p=areas[seen] / areas[seen].sum())
    weights = rng.dirichlet([1, 1, 1], count)
    points = np.einsum("kc,kcd->kd", weights, corners[chosen])
    return points + noise_m * rng.normal(size=(count, 1)) * normals[chosen], normals[chosen]


def sphere_at(depth_m, aside_m=0.0):
    return Sphere(TOP_M + [aside_m, 0, RADIUS_M - depth_m], RADIUS_M)


def test_sphere_presses_and_support_holds(tracker, solid):
    fit = tracker.at_rest()
    for depth in (0.001, 0.002, 0.003):
        fit = tracker.fit(fit, NO_POINTS, sphere_at(depth), np.inf)
        assert fit.converged
    surface = solid.surface_nodes()
    depths, _ = sphere_at(0.003).depths(fit.nodes_m[surface])
    assert 0 < depths.max() < 2e-5
    below = np.argmin(np.linalg.norm(solid.nodes_m - TOP_M, axis=1))
    assert fit.nodes_m[below, 2] == pytest.approx(TOP_M[2] - 0.003, abs=3e-5)
    held = solid.nodes_m[:, 2] < 1e-9
    assert np.abs(fit.nodes_m - solid.nodes_m)[held].max() < 1e-6
    forces, _ = tracker.elastic.forces_and_blocks(fit.nodes_m)
    touching = surface[depths > -1e-5]
    free = np.setdiff1d(np.flatnonzero(~held), touching)
    assert np.abs(forces[free]).max() < 1e-3 * np.abs(forces[touching]).max()


def test_a_sphere_that_draws_back_lets_go_step_by_step(tracker):
    fit = tracker.fit(tracker.at_rest(), NO_POINTS, sphere_at(0.0015), np.inf)
    pressed = tracker.fit(fit, NO_POINTS, sphere_at(0.003), np.inf)
    back = tracker.fit(pressed, NO_POINTS, sphere_at(0.0015), np.inf)
    assert back.converged
    assert np.abs(back.nodes_m - fit.nodes_m).max() < 5e-5
    gone = tracker.fit(back, NO_POINTS, sphere_at(-0.001), np.inf)
    assert np.abs(gone.nodes_m - tracker.rest).max() < 5e-5
    assert not gone.touched[0].any()


def test_nothing_goes_below_the_table(solid, template):
    held = np.flatnonzero(np.linalg.norm(solid.nodes_m * [1, 1, 1e3], axis=1) < 0.025)
    lowest = []
    for table in (TABLE, replace(TABLE, point_m=np.array([0, 0, -1.0]))):
        tracker = ElasticTracker(template, solid, held, table, ElasticTracking())
        fit = tracker.fit(tracker.at_rest(), NO_POINTS, sphere_at(0.002, aside_m=0.03), np.inf)
        lowest.append(fit.nodes_m[:, 2].min())
    assert lowest[0] > -2e-5 and lowest[1] < -1e-4


def test_offset_at_rest_is_taken_off(solid, template):
    tracker = new_tracker(solid, template)
    points, normals = points_of(template.vertices_m, template.faces, 8000, 3, 1e-4)
    points = points + [0, 0, 0.0008] * (points[:, :1] > 0)
    tracker.learn_rest([(points, normals)])
    inner = np.abs(template.vertices_m[:, :2]).max(axis=1) < 0.031
    right = inner & (template.vertices_m[:, 0] > 0.015)
    top = template.vertices_m[:, 2] > 0.0399
    assert tracker.offset[right & top].mean() == pytest.approx(0.0008, abs=5e-5)
    left = inner & (template.vertices_m[:, 0] < -0.015)
    assert np.abs(tracker.offset[left & top]).mean() < 5e-5
    assert tracker.sigma < 1.5e-4


@pytest.fixture(scope="module")
def capture(solid, template):
    return recorded(solid, template)


def recorded(solid, template, swell=0.0):
    """Five frames of a press, with a pose turned at random."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.3, 2.0, -0.8]).as_matrix()
    pose[:3, 3] = 0.1, -0.2, 0.6
    tracker, frames = new_tracker(solid, template), []
    fit, depths = tracker.at_rest(), (-0.002, -0.001, 0.001, 0.002, 0.003)
    for k, depth in enumerate(depths):
        fit = tracker.fit(fit, NO_POINTS, sphere_at(depth), np.inf)
        moved = tracker.vertices(fit.nodes_m)
        moved = moved + template.vertices_m * [1, 1, 0] * swell * max(depth, 0) / 0.003
        points, normals = points_of(moved, template.faces, 5000, [9, k], 1e-4)
        frames.append((to_camera(pose, points), normals @ pose[:3, :3].T))
    tips = to_camera(pose, np.array([sphere_at(depth).centre_m for depth in depths]))
    alignment = Alignment(pose, TOP_M, 2, 0.0)
    zeros = np.zeros((len(depths), 3))
    return Recorded(template, solid, floor(1e-6), frames, tips, zeros, RADIUS_M, alignment)


def test_a_press_is_followed(capture):
    tracked = track_by_elasticity(capture, OPTIONS)
    prior = json.loads(tracked.prior)
    assert prior["noise_reached"] and prior["poisson_ratio"] == 0.3
    assert prior["frames_not_converged"] == []
    assert prior["noise_m"] == pytest.approx(1e-4, rel=0.1)
    moved = np.linalg.norm(tracked.vertices_m - tracked.rest_m, axis=2)
    assert moved[:2].max() < 1e-4
    assert moved[4].max() == pytest.approx(0.003, abs=1e-4)
    from_tip = np.linalg.norm(tracked.vertices_m[4] - capture.tips_m[4], axis=1)
    assert from_tip.min() > RADIUS_M - 5e-5
    assert tracked.observed[:, : len(capture.template.vertices_m)].mean() > 0.7
    assert np.array_equal(tracked.vertices_m, track_by_elasticity(capture, OPTIONS).vertices_m)


@pytest.mark.parametrize(
    ("frames", "contact", "at_rest"), [([0, 1, 3, 3, 3, 4], 5, 2), ([0, 1, 4], 2, 1)]
)
def test_a_slow_press_and_one_in_a_jump_are_followed(capture, frames, contact, at_rest):
    """A soft object is pressed by millimetres before the force is above its threshold."""
    clouds, tips = [capture.clouds[k] for k in frames], capture.tips_m[frames]
    alignment = replace(capture.alignment, contact_frame=contact)
    other = replace(capture, clouds=clouds, tips_m=tips, alignment=alignment)
    tracked = track_by_elasticity(other, OPTIONS)
    prior = json.loads(tracked.prior)
    assert (prior["frames_at_rest"], prior["frames_sphere_inside"]) == (at_rest, [])
    assert prior["noise_m"] == pytest.approx(1e-4, rel=0.1)
    moved = np.linalg.norm(tracked.vertices_m[-1] - tracked.rest_m, axis=1)
    assert moved.max() == pytest.approx(0.003, abs=1e-4)


def test_points_that_contradict_the_prior_lower_its_weight(capture, solid, template):
    swollen = recorded(solid, template, swell=0.03)
    both = [track_by_elasticity(one, OPTIONS) for one in (capture, swollen)]
    weights = [json.loads(tracked.prior)["weight_per_j"] for tracked in both]
    assert weights[1] < 0.2 * weights[0]
    alone = track_by_elasticity(swollen, OPTIONS.changed(points=False))
    side, moved = alone.template_m[:, 0] > 0.0399, []
    for one in (alone, both[1]):
        outward = one.camera_from_object[:3, 0]
        moved.append((one.vertices_m[4] - one.rest_m)[side].mean(axis=0) @ outward)
    assert moved[0] < 0.2 * 0.03 * 0.04 < 0.5 * 0.03 * 0.04 < moved[1]


def test_bad_captures(capture):
    far = replace(capture, tips_m=capture.tips_m + 1.0)
    with pytest.raises(ValueError, match="tips: expected the sphere to press the object, found it"):
        track_by_elasticity(far, OPTIONS)
    empty = replace(capture, clouds=[NO_POINTS] * 5)
    with pytest.raises(ValueError, match="cloud: expected points near the template at rest"):
        track_by_elasticity(empty, OPTIONS)


LAM, MU = 900.0, 400.0


@pytest.fixture(scope="module")
def cube():
    mesh = MeshTet().refined(2)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


@pytest.fixture(scope="module")
def elastic(cube):
    return LogNeoHookean(cube, LAM, MU)


@pytest.fixture(scope="module")
def bent(cube):
    """Node positions far from rest."""
    x = cube.nodes_m / 0.1
    bend = [0.2 * x[:, 2] ** 2, 0.1 * np.sin(2 * x[:, 0]), -0.15 * x[:, 2] * x[:, 1]]
    return cube.nodes_m + 0.1 * np.column_stack(bend)


def test_turning_changes_nothing(elastic, bent):
    turn = Rotation.from_rotvec([0.4, -1.9, 1.1]).as_matrix()
    assert elastic.energy(bent @ turn.T) == pytest.approx(elastic.energy(bent), rel=1e-12)
    forces, _ = elastic.forces_and_blocks(bent)
    turned, _ = elastic.forces_and_blocks(bent @ turn.T)
    assert np.allclose(turned, forces @ turn.T, atol=1e-12 * np.abs(forces).max())
    assert elastic.energy(elastic.mesh.nodes_m @ turn.T) == pytest.approx(0, abs=1e-15)


def test_at_rest_it_is_the_linear_solid_and_a_stretch_has_its_energy(elastic, cube):
    forces, blocks = elastic.forces_and_blocks(cube.nodes_m)
    linear = combined(*elastic_stiffness(cube), LAM, MU)
    assert abs(elastic.pattern.matrix(blocks) - linear).max() < 1e-12 * abs(linear).max()
    assert np.abs(forces).max() < 1e-12 * abs(linear).max()
    stretch = np.diag([1.3, 0.9, 1.1])
    J, first = np.linalg.det(stretch), (np.diag(stretch) ** 2).sum()
    density = MU / 2 * (first - 3 - 2 * np.log(J)) + LAM / 2 * np.log(J) ** 2
    found = elastic.energy(cube.nodes_m @ stretch)
    assert found == pytest.approx(density * cube.volume_m3, rel=1e-12)
