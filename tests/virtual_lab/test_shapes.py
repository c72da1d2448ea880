"""Forms and meshes of the lab's objects, also of their own meshes; the ear phantom's size."""

import numpy as np
import pytest
import trimesh
from virtual_lab.level_set import boundary_surface, level_set_mesh
from virtual_lab.shapes import Ball, shape_of
from virtual_lab.signed_distance import ClosedMesh
from virtual_lab.tetrahedra import interpolation, tetrahedral_solid

RADIUS = 0.05


def sphere(points):
    return np.linalg.norm(points, axis=-1) - RADIUS


def test_a_level_set_is_filled_with_good_tetrahedra():
    """An eighth of a ball: its cuts are exactly flat, and its curve is met."""
    nodes, tets = level_set_mesh(sphere, np.zeros(3), np.full(3, 0.055), 0.008)
    corners = nodes[tets]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(np.pi / 6 * RADIUS**3, rel=0.03)
    surface = trimesh.Trimesh(*boundary_surface(nodes, tets), process=False)
    assert surface.is_watertight
    assert surface.volume == pytest.approx(volumes.sum())
    assert nodes.min() == 0
    assert sphere(nodes).max() < 1e-4
    cut = nodes[nodes[:, 2] == 0]
    assert np.linalg.norm(cut, axis=1).max() == pytest.approx(RADIUS, abs=1e-4)


def test_curved_quadratic_elements_have_the_balls_volume_and_carry_fields():
    solid, mesh = tetrahedral_solid(
        sphere,
        (np.zeros(3), np.full(3, 0.055)),
        [(axis, 0.0) for axis in range(3)],
        [(np.array([0, 0, RADIUS]), 0.004)],
        spacing_m=0.012,
        reaches={"top": (np.array([0, 0, RADIUS]), 0.02)},
    )
    assert solid.weights_m3.sum() == pytest.approx(np.pi / 6 * RADIUS**3, rel=2e-3)
    # The patch holds the curved side alone, a cap of chord 20 mm or so.
    area = solid.patches["top"].weights_m2.sum()
    assert area == pytest.approx(np.pi * 0.02**2 / 4, rel=0.15)
    points = np.random.default_rng(0).uniform(0.005, 0.02, (200, 3))
    matrix = interpolation(mesh, solid, points)

    def field(x):
        return x[:, 0] ** 2 + 3 * x[:, 1] * x[:, 2] - x[:, 2]

    assert matrix @ field(solid.nodes_m) == pytest.approx(field(points), abs=2e-6)


def test_the_balls_surface_for_pictures():
    vertices, faces = Ball(0.0614).surface()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.0614**3, rel=1e-3)
    assert mesh.bounds[:, 2] == pytest.approx([0, 0.1228], abs=1e-6)


@pytest.mark.long
def test_the_ear_has_its_size_and_about_twenty_thousand_vertices():
    vertices, faces = shape_of({"shape": {"kind": "ear"}}).surface()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert mesh.extents * 1e3 == pytest.approx([94, 62, 38], abs=1.0)
    assert 18_000 < len(vertices) < 22_000
    assert mesh.bounds[0, 2] == 0


ROUND, SUNK = 0.04, 0.015


@pytest.fixture(scope="module")
def dome(tmp_path_factory):
    """A ball that the table cuts 15 mm above its lowest point."""
    path = tmp_path_factory.mktemp("dome") / "dome.ply"
    ball = trimesh.creation.icosphere(subdivisions=4, radius=ROUND)
    ball.apply_translation([0.01, 0, ROUND - SUNK]).export(path)
    return {"kind": "mesh", "file": str(path)}


def test_the_signed_distance_of_a_mesh(dome):
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.05, 0.05, (200, 3)) + [0.01, 0, ROUND - SUNK]
    exact = np.linalg.norm(points - [0.01, 0, ROUND - SUNK], axis=1) - ROUND
    assert ClosedMesh(dome["file"])(points) == pytest.approx(exact, abs=1e-4)


def test_the_table_cuts_a_mesh(dome):
    shape = shape_of({"shape": dome | {"surface_m": 0.003}})
    surface = trimesh.Trimesh(*shape.surface(), process=False)
    assert surface.is_watertight
    assert surface.bounds[:, 2] == pytest.approx([0, 2 * ROUND - SUNK], abs=2e-4)
    cap = np.pi * SUNK**2 * (3 * ROUND - SUNK) / 3
    assert surface.volume == pytest.approx(4 / 3 * np.pi * ROUND**3 - cap, rel=0.01)


def test_a_mesh_is_bonded_to_the_table(dome):
    top = np.array([0.01, 0, 2 * ROUND - SUNK])
    options = {"deepest_m": 0.004, "spacing_m": 0.012, "element_m": 0.004}
    model = shape_of({"shape": dome | {"surface_m": 0.006}}).model(top, options)
    fixed = model.fixed.all(axis=1)
    assert fixed.any()
    assert np.abs(model.solid.nodes_m[fixed, 2]).max() < 1e-9
    # A rigid turn of the nodes is a rigid turn of the surface.
    turn = np.array([[0, -1e-3, 0], [1e-3, 0, 0], [0, 0, 0]])
    moved = model.sample(model.solid.nodes_m @ turn.T)
    assert moved == pytest.approx(model.surface_rest_m @ turn.T, abs=3e-6)
