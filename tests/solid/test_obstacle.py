"""Obstacles of a solid's surface and the equations of a press: by hand and by differences."""

import numpy as np
import pytest
from palpate.solid import obstacle
from palpate.solid.mesh import quadratic, solid_mesh
from skfem import MeshTet

RADIUS, DOWN, TOP = 0.02, np.array([0.0, 0, -1]), np.array([0.05, 0.05, 0.1])


def test_touch_of_a_sphere_and_of_a_plane():
    places = np.array([[[0, 0, 0.03], [0, 0.01, 0]], [[0.05, 0, 0], [0, 0, -0.04]]])
    ball = obstacle.sphere_touch(places, np.array([0, 0, 0.01]), 0.03)
    assert [part.tolist() for part in ball.points] == [[0, 0], [0, 1]]
    assert ball.depth_m == pytest.approx([0.01, 0.03 - np.hypot(0.01, 0.01)])
    assert ball.normals == pytest.approx(np.array([[0, 0, 1], [0, 0.5**0.5, -(0.5**0.5)]]))
    assert ball.curvature == pytest.approx([50, 1 / np.hypot(0.01, 0.01)])
    ground = obstacle.plane_touch(places, np.array([0, 0, -0.01]), np.array([0, 0.6, 0.8]))
    assert [part.tolist() for part in ground.points] == [[1], [1]]
    assert ground.depth_m == pytest.approx([0.8 * 0.03])
    assert ground.normals.tolist() == [[0, 0.6, 0.8]] and ground.curvature.tolist() == [0]


@pytest.mark.parametrize("order", [1, 2])
def test_a_touchs_forces_and_blocks_are_slopes(coarse, order):
    mesh = coarse if order == 1 else quadratic(coarse)
    faces = mesh.surface_faces()
    surface = obstacle.surface_points(mesh, faces, parts=3)
    assert surface.areas_m2.sum() == pytest.approx(6 * 0.1**2)
    x = mesh.nodes_m
    centre, step = np.array([0.04, 0.06, 0.115]), np.random.default_rng(1).normal(size=x.shape)

    def touch(x):
        return obstacle.sphere_touch(surface.places(x), centre, RADIUS)

    def energy(x):
        return obstacle.touch_energy(touch(x), surface)

    def forces(x):
        return obstacle.touch_forces(touch(x), surface, len(x))

    step *= 1e-8
    slope = (energy(x + step) - energy(x - step)) / 2
    assert slope == pytest.approx((forces(x) * step).sum(), rel=1e-5)
    moved = (forces(x + step) - forces(x - step)) / 2
    for positive, stick in ((False, 0.0), (True, 0.0), (False, 3e3)):
        given = {"positive": positive, "stick_per_m": stick}
        touched, blocks = obstacle.touch_blocks(touch(x), surface, **given)
        found = np.zeros_like(x)
        for face, block in zip(faces[touched], blocks, strict=True):
            found[face] += np.einsum("ijab,jb->ia", block, step[face])
        hits, flat = touch(x), np.zeros_like(x)
        # What turns with the sphere's surface, or is held beside it.
        across = positive * obstacle.PENALTY_PER_M * hits.depth_m * hits.curvature + stick
        shift = surface.places(step)[hits.points]
        shift -= (shift * hits.normals).sum(axis=1, keepdims=True) * hits.normals
        pull = (across * surface.areas_m2[hits.points])[:, None] * shift
        for face, inside, part in zip(*hits.points, pull, strict=True):
            flat[faces[face]] += np.outer(surface.shapes[inside], part)
        assert found == pytest.approx(moved + flat, abs=1e-5 * np.abs(moved).max())


def test_thickness_along_a_line(fine):
    """Of a cube, and of two plates 10 and 20 mm thick, with 30 mm between them."""
    top, slanted = np.array([0.052, 0.053, 0.1]), np.array([0.6, 0, -0.8])
    assert obstacle.thickness_m(fine, top, DOWN) == pytest.approx(0.1)
    assert obstacle.thickness_m(fine, top, slanted) == pytest.approx(0.048 / 0.6)  # at the side
    assert obstacle.thickness_m(fine, top - 0.01 * slanted, slanted) == pytest.approx(0.048 / 0.6)
    mesh = MeshTet().refined(1)
    unit = mesh.p.T
    low, high = unit * [0.1, 0.1, 0.02], unit * [0.1, 0.1, 0.01] + [0, 0, 0.05]
    plates = solid_mesh(np.vstack([low, high]), np.vstack([mesh.t.T, mesh.t.T + len(unit)]))
    for height, thickness in ((0.062, 0.01), (0.018, 0.02), (0.024, 0.02)):
        point = np.array([0.052, 0.043, height])
        assert obstacle.thickness_m(plates, point, DOWN) == pytest.approx(thickness)


@pytest.mark.parametrize("above", [-0.004, 0.0, 0.007])
def test_first_touch_of_a_flat_side_and_of_a_slope(fine, above):
    faces = obstacle.facing_faces(fine, TOP, DOWN, radius_m=RADIUS, deepest_m=0.004)
    assert (fine.nodes_m[faces][..., 2] == 0.1).all()

    def touch(nodes, point):
        return obstacle.first_touch(nodes, faces, point, DOWN, radius_m=RADIUS)

    assert touch(fine.nodes_m, TOP + [0, 0, above]) == pytest.approx(above)
    slope = fine.nodes_m + np.outer(fine.nodes_m[:, 0] - 0.05, [0, 0, 0.75])
    # A plane of slope 3/4 is touched R (sqrt(1 + 9/16) - 1) before its height on the line.
    assert touch(slope, TOP + [0, 0, above]) == pytest.approx(above - 0.25 * RADIUS, abs=2e-4)
    with pytest.raises(ValueError, match="a surface under the sphere's way, found none"):
        touch(fine.nodes_m, TOP + [0.2, 0, above])
