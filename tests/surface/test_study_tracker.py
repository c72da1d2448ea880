"""The study's tracker: transforms, hierarchy, completion and added points."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import palpate.surface.hierarchy as hierarchy_module
import pytest
import trimesh
from floor import floor
from palpate.solid.mesh import solid_mesh
from palpate.solid.quality import cutting_triangles
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.surface.augment import indenter_points, pressed_places, turned_copies
from palpate.surface.completion import Completion, Known, complete
from palpate.surface.data_points import Frame
from palpate.surface.energy import Data, descend, energy, move, turn
from palpate.surface.hierarchy import collapse_edges, hierarchy
from palpate.surface.options import ElasticTracking, Registration, StudyTracking
from palpate.surface.smoothness import Smoothness
from palpate.surface.template import Template, unique_edges, vertex_normals
from palpate.surface.track import track_frames
from palpate.surface.trackers import options_of, tracker_problems
from palpate.surface.transforms import Transforms
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation
from skfem import MeshTet

OPTIONS = Registration(
    w_sm=2,
    w_sm_stop=0.5,
    data_term="point",
    largest_distance_m=0.012,
    largest_normal_deg=60,
    data_points="nearest",
    coarsest_vertices=1000,
)
SUPPORT = floor(1e-6)


def ball(subdivisions, radius_m=0.05):
    mesh = trimesh.creation.icosphere(subdivisions, radius_m)
    return Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def identity(template):
    normals = vertex_normals(template.vertices_m, template.faces)
    return Transforms(np.zeros_like(normals), normals, np.zeros(len(normals)))


def surface_frame(template, move, *, count=4000, owners=()):
    """Points spread over the moved template."""
    mesh = trimesh.Trimesh(template.vertices_m, template.faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, count, seed=5)
    return Frame(move(points), mesh.face_normals[faces], count, np.array(owners, dtype=int))


@pytest.mark.parametrize("along", [False, True])
def test_energy_never_rises(along):
    """For given nearest neighbours, over translations, angles and axes."""
    rng, template = np.random.default_rng(3), ball(2)
    size = len(template.vertices_m)
    target = template.vertices_m + rng.normal(0, 0.003, (size, 3)) + 0.004
    normals = vertex_normals(template.vertices_m, template.faces)
    weights = (rng.random(size) < 0.5).astype(float)
    data = Data(template.vertices_m, target, normals, weights, np.full(size, along))
    smoothness = Smoothness(template, reach=1, measure="rings")
    start = identity(template)
    transforms = replace(start, angle=rng.normal(0, 0.5, size))
    energies = [energy(transforms, data, smoothness, 0.5)]
    for _ in range(12):
        transforms, after = descend(transforms, data, smoothness, 0.5, rotations=True)
        energies.append(after)
    assert (np.diff(energies) <= 1e-12 * energies[0]).all()
    assert energies[-1] < 0.5 * energies[1]


def test_rotations_recover_a_twist():
    """One translation, turned alike about every normal: smooth in E_sm, but not as a shift."""
    template = ball(2)
    truth = replace(identity(template), angle=np.full(len(template.vertices_m), 0.8))
    truth = replace(truth, shift_m=np.tile([0.004, 0.0, 0.0], (len(truth.angle), 1)))
    seen = np.arange(len(truth.angle)) % 4 > 0
    target = template.vertices_m + truth.displacement_m
    nowhere = np.zeros(len(seen), dtype=bool)
    data = Data(template.vertices_m, target, truth.axes, seen.astype(float), nowhere)
    smoothness = Smoothness(template, reach=1, measure="rings")
    found = replace(truth, angle=np.zeros(len(seen)))
    for _ in range(10):
        found = turn(found, data, smoothness, 0.01)
    assert np.allclose(found.angle, 0.8, atol=1e-3)
    assert np.allclose(found.displacement_m, truth.displacement_m, atol=1e-5)
    moved = move(found, data, smoothness, 0.01)
    assert np.allclose(moved.shift_m, truth.shift_m, atol=1e-5)


def test_smoothest_values_of_the_others():
    template = ball(2)
    smoothness, size = Smoothness(template, reach=1, measure="rings"), len(template.vertices_m)
    known = np.arange(size) % 3 == 0
    some = replace(identity(template), shift_m=np.where(known, 0.002, 5.0)[:, None] * np.ones(3))
    some = replace(some, angle=np.where(known, 0.3, -2.0))
    filled = smoothness.fill(some, known)
    assert np.allclose(filled.shift_m, 0.002, atol=1e-7)
    assert np.allclose(filled.angle, 0.3, atol=1e-6)


def test_hierarchy():
    template = ball(4)
    levels = hierarchy(template, coarsest_vertices=300)
    counts = [len(level.template.vertices_m) for level in levels]
    assert counts == [320, 640, 1281, 2562]
    for coarse, fine in pairwise(levels):
        assert (fine.template.vertices_m[coarse.kept] == coarse.template.vertices_m).all()
    for level in levels:
        mesh = trimesh.Trimesh(level.template.vertices_m, level.template.faces, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.euler_number == 2
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.05)
        assert not len(cutting_triangles(mesh.vertices, mesh.faces))


def test_collapses_that_cut_are_taken_back(monkeypatch):
    """The wall of a thin bowl: coarse triangles of its two sides would cut each other."""
    angles = np.linspace(0, np.pi / 2, 17)
    outer = 0.0500 * np.column_stack([np.sin(angles), -np.cos(angles)])
    inner = 0.0496 * np.column_stack([np.sin(angles), -np.cos(angles)])
    profile = np.concatenate([outer, inner[::-1]])
    bowl = trimesh.creation.revolve(profile, sections=32)
    vertices, faces = np.asarray(bowl.vertices), np.asarray(bowl.faces)
    assert not len(cutting_triangles(vertices, faces))
    assert not len(cutting_triangles(vertices, collapse_edges(vertices, faces, vertices=250)))
    monkeypatch.setattr(
        hierarchy_module, "_cutting", lambda v, f, gone, onto: np.zeros(len(gone), bool)
    )
    assert len(cutting_triangles(vertices, collapse_edges(vertices, faces, vertices=250)))


def test_a_translation_is_followed_exactly():
    """Also over a hierarchy, whose coarse vertices are vertices of the fine mesh."""
    template, move = ball(3), np.array([0.0006, -0.0004, 0.0008])
    normals = vertex_normals(template.vertices_m, template.faces)
    frames = [Frame(template.vertices_m + k * move, normals, len(normals)) for k in (0, 1, 2, 3)]
    options = OPTIONS.changed(coarsest_vertices=150, s_sm=2, neighbourhood="geodesic")
    vertices, observed, residual = track_frames(template, template.vertices_m, frames, options)
    for k in range(4):
        assert np.allclose(vertices[k], template.vertices_m + k * move, atol=1e-8)
    assert observed.all()
    assert residual.max() < 1e-8


@pytest.mark.parametrize("rotations", [False, True])
def test_a_rigid_motion_of_everything_changes_nothing(rotations):
    template = ball(2)
    options = OPTIONS.changed(data_term="plane", data_points="mean", rotations=rotations)
    frames = [surface_frame(template, lambda p: p * [1, 1, 1 - 0.3 * np.abs(p[0, 2])])]
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 0.7]), np.array([0.1, -0.2, 0.6])
    turned = [replace(f, points_m=turn.apply(f.points_m) + shift) for f in frames]
    turned = [replace(f, normals=turn.apply(f.normals)) for f in turned]
    first, *_ = track_frames(template, template.vertices_m, frames, options)
    rest = turn.apply(template.vertices_m) + shift
    second, *_ = track_frames(template, rest, turned, options)
    assert np.allclose(turn.apply(first[0]) + shift, second[0], atol=1e-7)


def test_means_take_out_noise():
    """Of points denser than the mesh: nearly half of the error goes."""
    template, rng = ball(2), np.random.default_rng(1)
    frame = surface_frame(template, lambda p: p, count=8000)
    frame = replace(frame, points_m=frame.points_m + rng.normal(0, 0.001, (8000, 3)))
    errors = {}
    for points in ("nearest", "mean"):
        options = OPTIONS.changed(data_term="plane", data_points=points)
        options = options.changed(w_sm=0.02, w_sm_stop=0.02)
        vertices, *_ = track_frames(template, template.vertices_m, [frame], options)
        errors[points] = np.linalg.norm(vertices[0] - template.vertices_m, axis=1).mean()
    assert errors["mean"] < 0.6 * errors["nearest"]


def test_places_hold_their_own_vertices_alone():
    template, owner = ball(2), 17
    frame = surface_frame(template, lambda p: p, owners=[owner])
    place = template.vertices_m[owner] * 0.93
    normal = place / np.linalg.norm(place)
    frame = replace(
        frame,
        points_m=np.concatenate([frame.points_m, [place]]),
        normals=np.concatenate([frame.normals, [normal]]),
    )
    options = OPTIONS.changed(data_term="plane", w_sm=0.02, w_sm_stop=0.02)
    vertices, observed, _ = track_frames(template, template.vertices_m, [frame], options)
    gap = np.linalg.norm(vertices[0] - template.vertices_m, axis=1)
    assert np.linalg.norm(vertices[0, owner] - place) < 0.0005
    assert np.delete(gap, owner).max() < 0.001
    assert not observed[0, owner]
    assert observed[0].sum() > 100


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
    found = complete(K1, K2, Known(u, observed, force, support, interior))
    assert found.lam_pa == pytest.approx(2e4, rel=1e-6)
    assert found.mu_pa == pytest.approx(1e4, rel=1e-6)
    assert np.allclose(found.displacement_m, u, atol=1e-9)
    hidden = ~observed & ~interior
    poor = u.copy()
    poor[hidden] *= 0.8
    better = complete(K1, K2, Known(poor, observed, force, support, interior)).displacement_m
    assert np.linalg.norm((better - u)[hidden]) < 0.6 * np.linalg.norm((poor - u)[hidden])


def test_completion_of_frames_in_turn():
    """A stretched box seen on one side only: places of the hidden side come out stretched too."""
    mesh, *_ = pressed_box()
    surface = mesh.surface_nodes()
    faces = np.searchsorted(surface, mesh.surface_triangles())
    rest = mesh.nodes_m[surface]
    completion = Completion(
        mesh,
        SUPPORT,
        np.eye(4),
        rest,
        faces,
        contact_m=np.array([0.05, 0.05, 0.1]),
        forces_n=np.zeros((2, 3)),
        indenter_radius_m=0.006,
    )
    lift = np.column_stack([0 * rest[:, :2], 0.02 * rest[:, 2]])
    held = rest[:, 1] < 0.08
    tracked = rest + np.where(held[:, None], lift, 0.0)
    places = completion(rest, tracked, held)
    error = np.linalg.norm(places - rest - lift, axis=1)[~held]
    assert error.mean() < 0.3 * np.linalg.norm(lift[~held], axis=1).mean()
    still = completion(places, places, held)
    assert np.abs(still - places).max() < 2e-3


def test_turned_copies():
    centre, axis = np.array([0.1, 0.0, 0.5]), np.array([0.0, 0.0, 2.0])
    points, normals = turned_copies(
        centre + [[0.02, 0, 0.01]], np.array([[1.0, 0, 0]]), centre_m=centre, axis=axis, copies=6
    )
    angles = np.deg2rad([60, 120, 180, 240, 300])
    ring = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    assert np.allclose(points, centre + 0.02 * ring + [0, 0, 0.01])
    assert np.allclose(normals, ring)
    none, _ = turned_copies(points, normals, centre_m=centre, axis=axis, copies=1)
    assert none.shape == (0, 3)
    with pytest.raises(ValueError, match="copies: expected at least 1, found 0"):
        turned_copies(points, normals, centre_m=centre, axis=axis, copies=0)


def test_points_of_the_indenter():
    up, tip, radius = np.array([0.0, 0.0, 1.0]), np.array([0, 0, 0.0022]), 0.0062
    sphere = {"radius_m": radius, "depth_m": 0.004}
    half, normals = indenter_points(tip, up, part="hemisphere", **sphere)
    assert half[:, 2].max() <= tip[2]
    assert np.allclose(np.linalg.norm(half - tip, axis=1), radius)
    assert len(half) > len(indenter_points(tip, up, part="cap", **sphere)[0]) > 0
    assert (normals @ up >= 0).all()
    grid = 0.001 * np.stack(np.meshgrid(range(-9, 10), range(-9, 10)), axis=-1).reshape(-1, 2)
    flat = np.column_stack([grid, 0 * grid[:, 0]])
    vertices, points, _ = pressed_places(flat, tip, up, **sphere)
    assert np.allclose(points[:, :2], flat[vertices, :2])
    assert np.allclose(np.linalg.norm(points - tip, axis=1), radius)
    touched = np.linalg.norm(flat[vertices], axis=1).max()
    assert 0.0039 < touched < np.sqrt(radius * 0.004)
    assert not len(pressed_places(flat, tip + [0, 0, 0.01], up, radius_m=radius, depth_m=-0.006)[0])
    with pytest.raises(ValueError, match="indenter_points: expected one of none, places, cap"):
        indenter_points(tip, up, part="cone", **sphere)


def test_bad_options():
    with pytest.raises(ValueError, match="data_points: expected one of mean, nearest, found"):
        OPTIONS.changed(data_points="median")
    with pytest.raises(ValueError, match="w_data: expected a number > 0, found 0"):
        OPTIONS.changed(w_data=0)


def test_options_of_named_trackers():
    base = {"kind": "elastic", "refine_edge_m": 0.002}
    tracking = {"trackers": {"a": base, "b": {"like": "a", "refine_edge_m": 0.003}}}
    tracking["objects"] = {"ear": {"a": {"refine_radius_m": 0.01}, "b": {"refine_edge_m": 0.004}}}
    known = ElasticTracking().written()
    assert options_of(tracking, "b", "block") == known | {"refine_edge_m": 0.003}
    ear = options_of(tracking, "b", "ear")
    assert ear == known | {"refine_edge_m": 0.004, "refine_radius_m": 0.01}


STUDY = StudyTracking(w_sm=1).written()


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        ({"compared": ["a", "c"]}, r"compared: expected one of .*\(a, b\), found c"),
        ({"estimate_from": "c"}, "estimate_from: expected one of .*, found c"),
        ({"objects": {"ear": {"c": {}}}}, "objects.ear: expected one of .*, found c"),
        ({"trackers": {"a": {"like": "b"}, "b": {"like": "a"}}}, "a.like: expected a chain"),
        (
            {"trackers": {"a": {}, "b": {}}},
            "trackers.a.kind: expected one of study",
        ),
        (
            {"trackers": {"a": {"kind": "elastic", "w_sm": 1}, "b": {"like": "a"}}},
            "a.w_sm: expected an option of kind elastic, found another kind's",
        ),
        (
            {"objects": {"ear": {"a": {"kind": "study"}}}},
            "objects.ear.a.kind: expected an option of",
        ),
        (
            {
                "trackers": {"a": {"like": "b"}, "b": STUDY},
                "objects": {"ear": {"b": {"w_sm": 0.5}}},
            },
            "trackers.a.w_sm for ear: expected at least w_sm_stop, 1, found 0.5",
        ),
    ],
)
def test_trackers_that_cannot_be(spoil, line):
    whole = {"kind": "elastic"}
    tracking = {"estimate_from": "a", "compared": ["a", "b"], "objects": {}}
    tracking |= {"trackers": {"a": whole, "b": {"like": "a"}}}
    assert tracker_problems(tracking) == []
    assert re.search(line, tracker_problems(tracking | spoil)[0])


def test_hierarchy_stops_where_no_edge_can_go():
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    template = Template(np.asarray(box.vertices), np.asarray(box.faces))
    levels = hierarchy(template, coarsest_vertices=2)
    coarse = levels[0].template
    mesh = trimesh.Trimesh(coarse.vertices_m, coarse.faces, process=False)
    assert mesh.is_watertight
    assert len(unique_edges(coarse.faces)) == 3 * (len(coarse.vertices_m) - 2)
