"""The study's tracker: meshes, numbers, invariance, completion, added points, its options."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.solid.mesh import solid_mesh
from palpate.solid.quality import cutting_triangles
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.surface.alignment import Alignment
from palpate.surface.options import ElasticTracking
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.tracked import Recorded
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation
from skfem import MeshTet
from thesis.minimise.problem import to_solid
from thesis.tracker.completion import Completion, Known, complete
from thesis.tracker.data_points import Frame
from thesis.tracker.hierarchy import collapse_edges, hierarchy
from thesis.tracker.options import Registration, StudyTracking, options_of, tracker_problems
from thesis.tracker.track import track_frames

OPTIONS = Registration(
    w_sm=2, w_sm_stop=0.5, data_term="point", data_points="nearest", coarsest_vertices=1000
)


def ball(subdivisions, radius_m=0.05):
    mesh = trimesh.creation.icosphere(subdivisions, radius_m)
    return Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def sampled(template, move=lambda points: points, *, count=4000):
    """A frame of points spread over the moved template."""
    mesh = trimesh.Trimesh(template.vertices_m, template.faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=5)
    return Frame(move(points), mesh.face_normals[faces], count)


def dent(points):
    """6 mm deep on top of the ball of 50 mm."""
    distance = np.linalg.norm(points[:, :2], axis=1)
    depth = 0.006 / (1 + (distance / 0.008) ** 2) ** 1.5 * (points[:, 2] > 0)
    return np.column_stack([0 * depth, 0 * depth, -depth])


@pytest.mark.parametrize(("data_term", "part_left"), [("point", 1.0), ("plane", 0.5)])
def test_a_dent_is_tracked(data_term, part_left):
    """Against no tracking at all, under noise; distances to points drag vertices sideways."""
    rng = np.random.default_rng(1)
    fine = refine_template(ball(3), np.array([0, 0, 0.05]), radius_m=0.02, edge_m=0.0025)
    frames = []
    for part in np.linspace(0, 1, 7):
        frame = sampled(fine, lambda p, part=part: p + part * dent(p), count=20000)
        noise = rng.normal(0, 0.0005, (20000, 1)) * frame.normals
        frames.append(replace(frame, points_m=frame.points_m + noise))
    options = OPTIONS.changed(data_term=data_term, w_sm=0.5, w_sm_stop=0.1, s_sm=2)
    vertices, observed, _ = track_frames(fine, fine.vertices_m, frames, options)
    true = fine.vertices_m + dent(fine.vertices_m)
    near = np.linalg.norm(fine.vertices_m - [0, 0, 0.05], axis=1) < 0.010
    tracked = np.linalg.norm(vertices[-1] - true, axis=1)[near].mean()
    assert tracked < part_left * np.linalg.norm(fine.vertices_m - true, axis=1)[near].mean()
    assert observed[-1].mean() > 0.9


def test_hierarchy():
    template = ball(4)
    levels = hierarchy(template, coarsest_vertices=300)
    assert [len(level.template.vertices_m) for level in levels] == [320, 640, 1281, 2562]
    for coarse, fine in pairwise(levels):
        assert (fine.template.vertices_m[coarse.kept] == coarse.template.vertices_m).all()
    for level in levels:
        mesh = trimesh.Trimesh(level.template.vertices_m, level.template.faces, process=False)
        assert mesh.is_volume and mesh.euler_number == 2
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.05)
        assert not len(cutting_triangles(mesh.vertices, mesh.faces))


def test_collapsed_walls_do_not_cut_each_other():
    """Of a thin bowl, whose two sides' coarse triangles would."""
    angles = np.linspace(0, np.pi / 2, 17)
    side = np.column_stack([np.sin(angles), -np.cos(angles)])
    bowl = trimesh.creation.revolve(
        np.concatenate([0.0500 * side, 0.0496 * side[::-1]]), sections=32
    )
    vertices, faces = np.asarray(bowl.vertices), np.asarray(bowl.faces)
    assert not len(cutting_triangles(vertices, collapse_edges(vertices, faces, vertices=250)))


def test_a_translation_is_followed_exactly():
    """Also over a hierarchy, whose coarse vertices are vertices of the fine mesh."""
    template, move = ball(3), np.array([0.0006, -0.0004, 0.0008])
    normals = vertex_normals(template.vertices_m, template.faces)
    frames = [Frame(template.vertices_m + k * move, normals, len(normals)) for k in (0, 1, 2, 3)]
    options = OPTIONS.changed(coarsest_vertices=150, s_sm=2)
    vertices, observed, residual = track_frames(template, template.vertices_m, frames, options)
    for k in range(4):
        assert np.allclose(vertices[k], template.vertices_m + k * move, atol=1e-8)
    assert observed.all() and residual.max() < 1e-8
    far = replace(frames[1], points_m=frames[1].points_m + 1.0)
    with pytest.raises(ValueError, match="frame 1: expected captured points near the template"):
        track_frames(template, template.vertices_m, [frames[0], far], options)


def test_a_rigid_motion_of_everything_changes_nothing():
    template = ball(2)
    options = OPTIONS.changed(data_term="plane", data_points="mean")
    frames = [sampled(template, lambda p: p * [1, 1, 1 - 0.3 * np.abs(p[0, 2])])]
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 0.7]), np.array([0.1, -0.2, 0.6])
    turned = [replace(f, points_m=turn.apply(f.points_m) + shift) for f in frames]
    turned = [replace(f, normals=turn.apply(f.normals)) for f in turned]
    first, *_ = track_frames(template, template.vertices_m, frames, options)
    rest = turn.apply(template.vertices_m) + shift
    second, *_ = track_frames(template, rest, turned, options)
    assert np.allclose(turn.apply(first[0]) + shift, second[0], atol=1e-7)


def pressed_box():
    """Exact displacements of a box on a support, pressed on top."""
    raw = MeshTet().refined(2)
    mesh = solid_mesh(0.1 * raw.p.T, raw.t.T)
    K1, K2 = elastic_stiffness(mesh)
    nodes = mesh.nodes_m
    support = np.flatnonzero(nodes[:, 2] < 1e-9)
    force = np.zeros_like(nodes)
    force[np.argmin(np.linalg.norm(nodes - [0.05, 0.05, 0.1], axis=1))] = [0.2, 0.0, -1.0]
    free = np.ones(nodes.size, dtype=bool)
    free.reshape(-1, 3)[support] = False
    u = np.zeros(nodes.size)
    K = combined(K1, K2, 2e4, 1e4)[free][:, free].tocsc()
    u[free] = spsolve(K, force.ravel()[free])
    return mesh, K1, K2, support, force, u.reshape(-1, 3)


def test_completion_recovers_a_linear_elastic_field():
    mesh, K1, K2, support, force, u = pressed_box()
    interior = np.ones(len(u), dtype=bool)
    interior[mesh.surface_nodes()] = False
    observed = ~interior & (mesh.nodes_m[:, 1] < 0.06)
    observed[support] = True
    found, *moduli = complete(K1, K2, Known(u, observed, force, support, interior))
    assert moduli == pytest.approx([2e4, 1e4], rel=1e-6)
    assert np.allclose(found, u, atol=1e-9)
    hidden = ~observed & ~interior
    poor = u.copy()
    poor[hidden] *= 0.8
    better, *_ = complete(K1, K2, Known(poor, observed, force, support, interior))
    assert np.linalg.norm((better - u)[hidden]) < 0.6 * np.linalg.norm((poor - u)[hidden])


def test_completion_of_frames_in_turn():
    """A stretched box seen on one side only: places of the hidden side come out stretched too."""
    mesh, *_ = pressed_box()
    surface = mesh.surface_nodes()
    faces = np.searchsorted(surface, mesh.surface_triangles())
    rest = mesh.nodes_m[surface]
    alignment = Alignment(np.eye(4), np.array([0.05, 0.05, 0.1]), 0, 0.0)
    known = floor(1e-6), [], np.zeros((2, 3)), np.zeros((2, 3)), 0.006, alignment
    completion = Completion(Recorded(Template(rest, faces), mesh, *known), rest, faces)
    lift = np.column_stack([0 * rest[:, :2], 0.02 * rest[:, 2]])
    held = rest[:, 1] < 0.08
    tracked = rest + np.where(held[:, None], lift, 0.0)
    places = completion(rest, tracked, held)
    error = np.linalg.norm(places - rest - lift, axis=1)[~held]
    assert error.mean() < 0.3 * np.linalg.norm(lift[~held], axis=1).mean()
    assert np.abs(completion(places, places, held) - places).max() < 2e-3


def test_transfer_reproduces_linear_fields():
    mesh = MeshTet().refined(2)
    solid = solid_mesh(mesh.p.T, mesh.t.T)
    box = trimesh.creation.box((1, 1, 1)).subdivide()
    vertices = box.vertices + 0.5
    gradient = np.random.default_rng(2).normal(size=(3, 3))
    found = to_solid(vertices, box.faces, vertices @ gradient, solid)
    surface = solid.surface_nodes()
    assert np.allclose(found[surface], solid.nodes_m[surface] @ gradient, atol=1e-6)
    assert np.isnan(np.delete(found, surface, axis=0)).all()


def test_options_of_named_trackers():
    base = {"kind": "elastic", "refine_edge_m": 0.002}
    tracking = {"trackers": {"a": base, "b": {"like": "a", "refine_edge_m": 0.003}}}
    tracking["objects"] = {"ear": {"a": {"refine_radius_m": 0.01}, "b": {"refine_edge_m": 0.004}}}
    known = ElasticTracking().written()
    assert options_of(tracking, "b", "block") == known | {"refine_edge_m": 0.003}
    ear = options_of(tracking, "b", "ear")
    assert ear == known | {"refine_edge_m": 0.004, "refine_radius_m": 0.01}


STUDY, ELASTIC = StudyTracking(w_sm=1).written(), {"kind": "elastic"}
LIKE_A, LIKE_B, LOW = {"like": "a"}, {"like": "b"}, {"ear": {"b": {"w_sm": 0.5}}}


def test_trackers_that_cannot_be():
    tracking = {"estimate_from": "a", "compared": ["a", "b"], "objects": {}}
    tracking |= {"trackers": {"a": ELASTIC, "b": LIKE_A}}
    assert tracker_problems(tracking) == []
    for spoil, line in (
        ({"compared": ["a", "c"]}, r"compared: expected one of .*\(a, b\), found c"),
        ({"objects": {"ear": {"c": {}}}}, "objects.ear: expected one of .*, found c"),
        ({"objects": {"ear": {"a": ELASTIC}}}, "objects.ear.a.kind: expected an option of"),
        ({"trackers": {"a": LIKE_B, "b": LIKE_A}}, "a.like: expected a chain that ends"),
        ({"trackers": {"a": {}, "b": {}}}, "trackers.a.kind: expected one of study"),
        ({"trackers": {"a": ELASTIC | {"w_sm": 1}, "b": LIKE_A}}, "a.w_sm: .* of kind elastic"),
        ({"trackers": {"a": LIKE_B, "b": STUDY}, "objects": LOW},
         "trackers.a.w_sm for ear: expected at least w_sm_stop, 1, found 0.5"),
    ):  # fmt: skip
        assert re.search(line, tracker_problems(tracking | spoil)[0])
