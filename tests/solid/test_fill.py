"""Filling of surfaces, what they must be, quality, local refinement."""

import numpy as np
import pytest
import trimesh
from palpate.solid.fill import refine_near, tetrahedralise
from palpate.solid.mesh import SolidMesh, quadratic, read_solid, solid_mesh
from palpate.solid.quality import dihedral_angles, mesh_quality, radius_ratios, surface_gap
from palpate.solid.surface_check import check_surface, self_intersection

# Wanted nodes of the study's meshes and what must hold of each.
KEPT = {"foam_block": 1201, "simulated_block": 265}


@pytest.mark.parametrize("name", KEPT)
def test_kept_blocks(root, name):
    mesh = read_solid(root / f"config/meshes/{name}.vtu")
    box = trimesh.creation.box((0.598, 0.150, 0.0475))
    box.apply_translation([0, 0, 0.0475 / 2])
    quality = mesh_quality(mesh, box.vertices, box.faces)
    assert quality.nodes == pytest.approx(KEPT[name], rel=0.03)
    assert quality.volume_m3 == pytest.approx(0.598 * 0.150 * 0.0475, rel=1e-3)
    assert quality.largest_gap_m < 2e-4
    assert quality.least_radius_ratio > 0.3
    assert self_intersection(mesh.nodes_m, mesh.surface_triangles()) is None


def test_kept_ball(root):
    """Fills the template of its laser scans, which is a millimetre off the sphere at the top."""
    mesh = read_solid(root / "config/meshes/foam_ball.vtu")
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.0614)
    ball.apply_translation([0, 0, 0.0614])
    quality = mesh_quality(mesh, ball.vertices, ball.faces)
    assert quality.nodes == pytest.approx(642, rel=0.03)
    assert quality.volume_m3 == pytest.approx(ball.volume, rel=0.02)
    assert quality.largest_gap_m < 0.003
    assert quality.least_radius_ratio > 0.15
    assert self_intersection(mesh.nodes_m, mesh.surface_triangles()) is None
    # Rests on the table with enough nodes to hold it.
    assert np.count_nonzero(np.abs(mesh.nodes_m[mesh.surface_nodes(), 2]) < 1e-3) >= 3


def test_tetrahedralise_meets_the_count_and_the_surface():
    surface = trimesh.creation.box((0.3, 0.15, 0.05))
    # Turned inside out, it is turned back.
    mesh = tetrahedralise(surface.vertices, surface.faces[:, ::-1], vertices=700)
    assert isinstance(mesh, SolidMesh)
    assert len(mesh.nodes_m) == pytest.approx(700, rel=0.03)
    assert mesh.volume_m3 == pytest.approx(0.3 * 0.15 * 0.05, rel=0.01)
    gap = surface_gap(mesh.nodes_m, mesh.surface_triangles(), surface.vertices, surface.faces)
    assert gap <= 1e-3 * np.linalg.norm(surface.extents)


def test_a_surface_that_so_few_nodes_cannot_keep_to():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    with pytest.raises(ValueError, match="largest_gap_m: expected at most 1e-05 m, found"):
        tetrahedralise(ball.vertices, ball.faces, vertices=300, largest_gap_m=1e-5)


def test_surfaces_that_nothing_can_fill():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    with pytest.raises(ValueError, match="expected a closed one, found open edges"):
        tetrahedralise(ball.vertices, ball.faces[:-1], vertices=300)
    pushed = ball.vertices.copy()
    pushed[7] *= -1.2
    with pytest.raises(ValueError, match=r"does not cut itself, found triangles \d+ and \d+"):
        tetrahedralise(pushed, ball.faces, vertices=300)


def test_self_intersection_is_told_from_touching():
    box = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide()
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    assert self_intersection(box.copy().apply_transform(turn).vertices, box.faces) is None
    apart = trimesh.util.concatenate([box, box.copy().apply_translation([0.11, 0, 0])])
    assert self_intersection(apart.vertices, apart.faces) is None
    cut = trimesh.util.concatenate([box, box.copy().apply_translation([0.09, 0.013, 0.007])])
    first, second = self_intersection(cut.vertices, cut.faces)
    assert (first < len(box.faces)) != (second < len(box.faces))


def test_orientation_is_turned_outward():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    mixed = ball.faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    assert check_surface(ball.vertices, mixed).volume == pytest.approx(ball.volume)
    assert check_surface(ball.vertices, ball.faces[:, ::-1]).volume == pytest.approx(ball.volume)


def test_quality_of_a_regular_and_of_a_corner_element():
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * 0.01
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 0.01
    one = solid_mesh(regular, np.arange(4)[None])
    assert radius_ratios(one) == pytest.approx([1])
    assert dihedral_angles(one).ravel() == pytest.approx(np.full(6, np.arccos(1 / 3)))
    other = quadratic(solid_mesh(corner, np.arange(4)[None]))
    # Inradius 1/(3 + sqrt 3), circumradius sqrt(3)/2.
    assert radius_ratios(other) == pytest.approx([6 / (3 + 3**0.5) / 3**0.5])
    degrees = np.degrees(np.sort(dihedral_angles(other).ravel()))
    assert degrees == pytest.approx([np.degrees(np.arccos(1 / 3**0.5))] * 3 + [90] * 3)


def test_gap_is_measured_both_ways():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    spike = ball.vertices.copy()
    spike[5] *= 1.2
    for one, two in ((ball.vertices, spike), (spike, ball.vertices)):
        assert surface_gap(one, ball.faces, two, ball.faces) == pytest.approx(0.01, rel=1e-3)


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
    with pytest.raises(ValueError, match="expected four-node elements to refine"):
        refine_near(quadratic(block), point, radius_m=0.02, edge_m=0.007)
