"""Solid meshes, node sets and loads."""

import numpy as np
import pytest
from palpate.solid.boundary import node_sets
from palpate.solid.load import contact_triangle, nodal_force
from palpate.solid.mesh import (
    SolidMesh,
    element_volumes,
    read_solid,
    refine_near,
    solid_mesh,
    tetrahedralise,
    write_solid,
)
from skfem import MeshTet

PLANE = {"support_plane_point_m": [0, 0, 0], "support_plane_normal": [0, 0, 1], "tolerance_m": 1e-6}
PRESS = {"indenter_radius_m": 0.006, "depth_m": 0.004}


@pytest.fixture(scope="module")
def cube():
    mesh = MeshTet().refined(2)
    return solid_mesh(0.1 * mesh.p.T, mesh.t.T)


@pytest.fixture(scope="module")
def block(root):
    return read_solid(root / "config/meshes/foam_block.vtu")


def test_elements_are_turned_to_positive_volume(cube):
    flipped = solid_mesh(cube.nodes_m, cube.tetrahedra[:, [1, 0, 2, 3]])
    assert element_volumes(flipped.nodes_m, flipped.tetrahedra).min() > 0
    with pytest.raises(ValueError, match="found element 0 without one"):
        solid_mesh(cube.nodes_m, cube.tetrahedra[:1][:, [0, 0, 1, 2]].repeat(2, axis=0))


def test_surface_is_closed_and_outward(cube):
    triangles = cube.surface_triangles()
    a, b, c = (cube.nodes_m[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(cube.volume_m3)
    assert cube.volume_m3 == pytest.approx(1e-3)


def test_kept_mesh_of_the_block(block):
    assert block.volume_m3 == pytest.approx(0.598 * 0.150 * 0.0475, rel=1e-3)
    assert abs(len(block.nodes_m) - 1201) < 0.05 * 1201


def test_refinement_keeps_the_body_and_reaches_the_edge_length(block):
    point = np.array([-0.05, 0.0, 0.0475])
    fine = refine_near(block, point, radius_m=0.02, edge_m=0.007)
    assert fine.volume_m3 == pytest.approx(block.volume_m3, rel=1e-12)
    corners = fine.nodes_m[fine.tetrahedra]
    near = np.linalg.norm(corners.mean(axis=1) - point, axis=1) < 0.02
    edges = np.linalg.norm(corners[near][:, :, None] - corners[near][:, None], axis=-1)
    assert edges.max() <= 0.007
    again = refine_near(block, point, radius_m=0.02, edge_m=0.007)
    assert np.array_equal(again.nodes_m, fine.nodes_m)


def test_file_round_trip_with_the_same_bytes(cube, tmp_path):
    for name in "ab":
        write_solid(tmp_path / f"{name}.vtu", cube)
    assert (tmp_path / "a.vtu").read_bytes() == (tmp_path / "b.vtu").read_bytes()
    again = read_solid(tmp_path / "a.vtu")
    assert np.array_equal(again.nodes_m, cube.nodes_m)
    assert np.array_equal(again.tetrahedra, cube.tetrahedra)


def test_tetrahedralise_meets_the_count():
    import trimesh

    surface = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide()
    mesh = tetrahedralise(surface.vertices, surface.faces, vertices=600)
    assert isinstance(mesh, SolidMesh)
    assert abs(len(mesh.nodes_m) - 600) < 90
    assert mesh.volume_m3 == pytest.approx(1e-3, rel=0.01)
    with pytest.raises(ValueError, match="expected a closed one, found open edges"):
        tetrahedralise(surface.vertices, surface.faces[:-1], vertices=600)


def test_node_sets_part_the_nodes(cube):
    triangle = contact_triangle(cube, np.array([0.05, 0.05, 0.1]), largest_distance_m=0.01)
    sets = node_sets(cube, contact_nodes=triangle, **PLANE)
    parts = np.concatenate([sets.contact, sets.free, sets.support, sets.interior])
    assert np.array_equal(np.sort(parts), np.arange(len(cube.nodes_m)))
    assert np.allclose(cube.nodes_m[sets.support, 2], 0)
    with pytest.raises(ValueError, match="support: expected at least 3 nodes"):
        node_sets(cube, contact_nodes=triangle, **(PLANE | {"support_plane_point_m": [0, 0, -1]}))


def test_contact_far_from_the_surface_is_refused(cube):
    with pytest.raises(ValueError, match="expected within 0.01 m of the surface"):
        contact_triangle(cube, np.array([0.05, 0.05, 0.2]), largest_distance_m=0.01)


def test_force_rules(cube):
    triangle = contact_triangle(cube, np.array([0.05, 0.05, 0.1]), largest_distance_m=0.01)
    force = np.array([0.3, 0.0, -0.4])
    kept = nodal_force(cube, triangle, force, rule="conserve", turn_to_normal=False, **PRESS)
    assert np.allclose(kept.sum(axis=0), force)
    turned = nodal_force(cube, triangle, force, rule="conserve", turn_to_normal=True, **PRESS)
    assert np.allclose(turned.sum(axis=0), [0, 0, -0.5])
    printed = nodal_force(cube, triangle, force, rule="area_ratio", turn_to_normal=False, **PRESS)
    a, b, c = cube.nodes_m[triangle]
    area = np.linalg.norm(np.cross(b - a, c - a)) / 2
    assert np.allclose(printed[triangle[0]], force * area / (np.pi * 0.006 * 0.004))
    with pytest.raises(ValueError, match="force_rule: expected one of conserve, area_ratio"):
        nodal_force(cube, triangle, force, rule="all", turn_to_normal=False, **PRESS)
