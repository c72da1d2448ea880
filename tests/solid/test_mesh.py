"""Solid meshes: orientation, surface, checks, files."""

import numpy as np
import pytest
from palpate.solid.mesh import (
    TURNED,
    element_volumes,
    quadratic,
    read_solid,
    solid_mesh,
    write_solid,
)


def test_elements_are_turned_to_positive_volume(cube):
    flipped = solid_mesh(cube.nodes_m, cube.tetrahedra[:, [1, 0, 2, 3]])
    assert element_volumes(flipped.nodes_m, flipped.tetrahedra).min() > 0
    fine = quadratic(cube)
    again = solid_mesh(fine.nodes_m, fine.tetrahedra[:, TURNED])
    assert np.array_equal(again.tetrahedra, fine.tetrahedra)


@pytest.mark.parametrize("order", [1, 2])
def test_surface_is_closed_and_outward(cube, order):
    mesh = cube if order == 1 else quadratic(cube)
    assert mesh.order == order
    a, b, c = mesh.nodes_m[mesh.surface_triangles()].transpose(1, 0, 2)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert volume == pytest.approx(mesh.volume_m3)
    assert mesh.volume_m3 == pytest.approx(1e-3)
    outside = (np.abs(mesh.nodes_m - 0.05) > 0.05 - 1e-9).any(axis=1)
    assert np.array_equal(mesh.surface_nodes(), np.flatnonzero(outside))


def test_elements_that_overlap_or_are_curved_are_named(cube):
    nodes = cube.nodes_m.copy()
    inner = np.setdiff1d(np.arange(len(nodes)), cube.surface_nodes())[0]
    nodes[inner] += [0.06, 0.0, 0.0]
    with pytest.raises(ValueError, match=r"two sides of each face, found elements \d+, \d+ that"):
        solid_mesh(nodes, cube.tetrahedra)
    third = np.append(cube.tetrahedra[0, :3], len(nodes))
    outside = np.append(cube.nodes_m, [[0.3, 0.2, 0.1]], axis=0)
    with pytest.raises(ValueError, match="overlap"):
        solid_mesh(outside, np.append(cube.tetrahedra, [third, third[[1, 0, 2, 3]]], axis=0))
    fine = quadratic(cube)
    nodes = fine.nodes_m.copy()
    nodes[-1] += 1e-3
    with pytest.raises(ValueError, match=r"middle of straight edges, found element \d+"):
        solid_mesh(nodes, fine.tetrahedra)


@pytest.mark.parametrize("order", [1, 2])
def test_file_round_trip_with_the_same_bytes(cube, tmp_path, order):
    mesh = cube if order == 1 else quadratic(cube)
    for name in "ab":
        write_solid(tmp_path / f"{name}.vtu", mesh)
    assert (tmp_path / "a.vtu").read_bytes() == (tmp_path / "b.vtu").read_bytes()
    again = read_solid(tmp_path / "a.vtu")
    assert np.array_equal(again.nodes_m, mesh.nodes_m)
    assert np.array_equal(again.tetrahedra, mesh.tetrahedra)
