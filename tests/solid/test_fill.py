"""Filling of surfaces, what they must be, quality, local refinement."""

import numpy as np
import pytest
import trimesh
from palpate.solid import fill
from palpate.solid.mesh import SolidMesh, quadratic, read_solid, refine_near, solid_mesh
from palpate.solid.quality import (
    check_surface,
    cutting_triangles,
    dihedral_angles,
    mesh_quality,
    radius_ratios,
    surface_gap,
)
from palpate.solid.support import Support
from virtual_lab.signed_distance import ear_distance

BLOCK = trimesh.creation.box((0.598, 0.150, 0.0475)).apply_translation([0, 0, 0.0475 / 2])
# Of its laser scans.
BALL = trimesh.creation.icosphere(5, radius=0.0614).apply_translation([0, 0, 0.0614])
# The study's meshes: their surface, wanted nodes, and what must hold of volume, gap [m], radius
# ratios, dihedral angles and nodes on the table.
KEPT = {
    "foam_block": (BLOCK, 1201, 1e-3, 2e-4, 0.3, 0, 0),
    "simulated_block": (BLOCK, 265, 1e-3, 2e-4, 0.3, 0, 0),
    "foam_ball": (BALL, 642, 0.025, 0.001, 0.15, 10, 6),
    "ear": (None, 2993, None, None, 0.05, 5, 30),
}


@pytest.mark.parametrize("name", KEPT)
def test_kept_meshes(root, name):
    """The ear fills the template of its laser scans."""
    mesh = read_solid(root / f"config/meshes/{name}.vtu")
    surface, nodes, volume, gap_m, ratio, dihedral_deg, held = KEPT[name]
    triangles, outer = mesh.surface_triangles(), mesh.nodes_m[mesh.surface_nodes()]
    assert len(mesh.nodes_m) == pytest.approx(nodes, rel=0.03)
    assert radius_ratios(mesh).min() > ratio
    assert np.degrees(dihedral_angles(mesh).min()) > dihedral_deg
    assert not len(cutting_triangles(mesh.nodes_m, triangles))
    assert np.count_nonzero(np.abs(outer[:, 2]) < 1e-3) >= held
    if surface is None:
        off = ear_distance(np.concatenate([outer, mesh.nodes_m[triangles].mean(axis=1)]))
        assert np.abs(off).max() < 0.0015 and np.abs(off).mean() < 0.0003
        return
    quality = mesh_quality(mesh, surface.vertices, surface.faces)
    assert quality.nodes == len(mesh.nodes_m) and quality.largest_gap_m < gap_m
    assert quality.volume_m3 == pytest.approx(surface.volume, rel=volume)
    assert quality.least_radius_ratio == radius_ratios(mesh).min()
    assert quality.least_dihedral_deg == pytest.approx(np.degrees(dihedral_angles(mesh).min()))


@pytest.mark.long
def test_tetrahedralise_meets_the_count_and_the_surface():
    surface = trimesh.creation.box((0.3, 0.15, 0.05))
    # Turned inside out, it is turned back.
    mesh = fill.tetrahedralise(surface.vertices, surface.faces[:, ::-1], vertices=700)
    assert isinstance(mesh, SolidMesh)
    # fTetWild draws at random: the count is that of the nearest of a few fills.
    assert len(mesh.nodes_m) == pytest.approx(700, rel=0.3)
    assert mesh.volume_m3 == pytest.approx(0.3 * 0.15 * 0.05, rel=0.01)
    gap = surface_gap(mesh.nodes_m, mesh.surface_triangles(), surface.vertices, surface.faces)
    assert gap <= 1e-3 * np.linalg.norm(surface.extents)


def test_surfaces_that_nothing_or_so_few_nodes_cannot_fill():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    pushed = ball.vertices.copy()
    pushed[7] *= -1.2
    with pytest.raises(ValueError, match=r"does not cut itself, found triangles \d+ and \d+"):
        fill.tetrahedralise(pushed, ball.faces, vertices=300)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    line = r"largest_gap_m: expected at least 0\.\d+ m with 300 nodes, found 1e-05 m"
    with pytest.raises(ValueError, match=line):
        fill.tetrahedralise(ball.vertices, ball.faces, vertices=300, largest_gap_m=1e-5)


def test_self_intersection_is_told_from_touching():
    box = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide()
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    assert not len(cutting_triangles(box.copy().apply_transform(turn).vertices, box.faces))
    apart = trimesh.util.concatenate([box, box.copy().apply_translation([0.11, 0, 0])])
    assert not len(cutting_triangles(apart.vertices, apart.faces))
    cut = trimesh.util.concatenate([box, box.copy().apply_translation([0.09, 0.013, 0.007])])
    first, second = cutting_triangles(cut.vertices, cut.faces)[0]
    assert (first < len(box.faces)) != (second < len(box.faces))


def test_orientation_is_turned_outward():
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    mixed = ball.faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    assert check_surface(ball.vertices, mixed).volume == pytest.approx(ball.volume)
    assert check_surface(ball.vertices, ball.faces[:, ::-1]).volume == pytest.approx(ball.volume)
    apart = ball.triangles.reshape(-1, 3)
    with pytest.raises(ValueError, match="expected a closed surface, found .* open edges"):
        check_surface(apart, np.arange(len(apart)).reshape(-1, 3))


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
    with pytest.raises(ValueError, match="edge_m: expected at most 1e-06 m after 12 bisections"):
        refine_near(block, point, radius_m=1e-6, edge_m=1e-6)
    with pytest.raises(ValueError, match="expected four-node elements to refine"):
        refine_near(quadratic(block), point, radius_m=0.02, edge_m=0.007)


def table(tolerance_m, normal=(0, 0, 2)):
    return Support(np.zeros(3), np.array(normal, dtype=float), tolerance_m)


def test_nodes_of_the_edge_on_the_area_of_a_cap_and_of_a_box():
    fine = trimesh.creation.icosphere(6, radius=0.05).apply_translation([0, 0, 0.05])
    # Archimedes: as much as the cylinder around it.
    cap = 2 * np.pi * 0.05 * 0.004
    assert fill.supported_area(fine, table(0.004)) == pytest.approx(cap, rel=2e-3)
    box = trimesh.creation.box((0.1, 0.2, 0.05)).apply_translation([0, 0, 0.025])
    expected = 0.1 * 0.2 + 0.003 * 2 * (0.1 + 0.2)
    for normal in ((0, 0, 2), (0, 0, -1)):
        assert fill.supported_area(box, table(0.003, normal)) == pytest.approx(expected)
    edge = fill.support_edge(box, table(1e-6))
    assert 0.1 * 0.2 / (edge**2 * 3**0.5 / 2) == pytest.approx(fill.SUPPORT_NODES, rel=1e-3)
    assert fill.support_edge(box.apply_translation([0, 0, 0.1]), table(0.001)) == np.inf
