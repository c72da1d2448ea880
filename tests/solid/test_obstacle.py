"""Obstacles of a solid's surface and the equations of a press: by hand and by differences."""

import numpy as np
import pytest
from floor import floor
from palpate.solid.indentation_setup import IndentationOptions, indentation_setup
from palpate.solid.indenting import State
from palpate.solid.load import face_parts
from palpate.solid.mesh import quadratic, solid_mesh
from palpate.solid.obstacle import (
    PENALTY_PER_M,
    facing_faces,
    plane_touch,
    sphere_touch,
    surface_points,
    touch_blocks,
    touch_energy,
    touch_forces,
)
from skfem import MeshTet

RADIUS, DOWN, TOP = 0.02, np.array([0.0, 0, -1]), np.array([0.05, 0.05, 0.1])


@pytest.fixture(scope="module")
def coarse():
    cube = MeshTet().refined(1)
    return solid_mesh(0.1 * cube.p.T, cube.t.T)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_points_of_a_triangle_are_exact_for_squares(count):
    points = face_parts(count)
    assert points.shape == (3 * count**2, 3)
    assert points.sum(axis=1) == pytest.approx(np.ones(3 * count**2))
    assert points.min() > 0
    # Of barycentric coordinates: 2 a! b! c! / (2 + a + b + c)!.
    assert (points**2).mean(axis=0) == pytest.approx([1 / 6] * 3)
    assert (points * np.roll(points, 1, axis=1)).mean(axis=0) == pytest.approx([1 / 12] * 3)


def test_touch_of_a_sphere_and_of_a_plane():
    places = np.array([[[0, 0, 0.03], [0, 0.01, 0]], [[0.05, 0, 0], [0, 0, -0.04]]])
    ball = sphere_touch(places, np.array([0, 0, 0.01]), 0.03)
    assert [part.tolist() for part in ball.points] == [[0, 0], [0, 1]]
    assert ball.depth_m == pytest.approx([0.01, 0.03 - np.hypot(0.01, 0.01)])
    assert ball.normals == pytest.approx(np.array([[0, 0, 1], [0, 0.5**0.5, -(0.5**0.5)]]))
    assert ball.curvature == pytest.approx([50, 1 / np.hypot(0.01, 0.01)])
    ground = plane_touch(places, np.array([0, 0, -0.01]), np.array([0, 0.6, 0.8]))
    assert [part.tolist() for part in ground.points] == [[1], [1]]
    assert ground.depth_m == pytest.approx([0.8 * 0.03])
    assert ground.normals.tolist() == [[0, 0.6, 0.8]] and ground.curvature.tolist() == [0]


@pytest.mark.parametrize("order", [1, 2])
def test_a_touchs_forces_and_blocks_are_slopes(coarse, order):
    mesh = coarse if order == 1 else quadratic(coarse)
    faces = mesh.surface_faces()
    surface = surface_points(mesh, faces, parts=3)
    assert surface.areas_m2.sum() == pytest.approx(6 * 0.1**2)
    x = mesh.nodes_m
    centre, step = np.array([0.04, 0.06, 0.115]), np.random.default_rng(1).normal(size=x.shape)

    def touch(x):
        return sphere_touch(surface.places(x), centre, RADIUS)

    def energy(x):
        return touch_energy(touch(x), surface)

    def forces(x):
        return touch_forces(touch(x), surface, len(x))

    step *= 1e-8
    slope = (energy(x + step) - energy(x - step)) / 2
    assert slope == pytest.approx((forces(x) * step).sum(), rel=1e-5)
    moved = (forces(x + step) - forces(x - step)) / 2
    for positive, stick in ((False, 0.0), (True, 0.0), (False, 3e3)):
        touched, blocks = touch_blocks(touch(x), surface, positive=positive, stick_per_m=stick)
        found = np.zeros_like(x)
        for face, block in zip(faces[touched], blocks, strict=True):
            found[face] += np.einsum("ijab,jb->ia", block, step[face])
        expected = moved
        hits, flat = touch(x), np.zeros_like(x)
        # What turns with the sphere's surface, or is held beside it.
        across = np.where(positive, PENALTY_PER_M * hits.depth_m * hits.curvature, 0.0) + stick
        shift = surface.places(step)[hits.points]
        shift -= (shift * hits.normals).sum(axis=1, keepdims=True) * hits.normals
        pull = (across * surface.areas_m2[hits.points])[:, None] * shift
        for face, inside, part in zip(*hits.points, pull, strict=True):
            flat[faces[face]] += np.outer(surface.shapes[inside], part)
        assert found == pytest.approx(expected + flat, abs=1e-5 * np.abs(moved).max())


def test_the_faces_under_a_sphere():
    """Those that look up, within 2.2 radii and their own size of its line."""
    cube = MeshTet().refined(3)
    mesh = solid_mesh(0.1 * cube.p.T, cube.t.T)
    radius = 0.006
    faces = facing_faces(mesh, TOP, DOWN, radius_m=radius, deepest_m=0.002)
    every = mesh.surface_faces()
    corners = mesh.nodes_m[every]
    size = np.sqrt(np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1))
    near = np.linalg.norm(corners.mean(axis=1) - TOP, axis=1) < 2.2 * radius + size
    expected = every[near & (corners[..., 2] == 0.1).all(axis=1)]
    assert np.array_equal(faces, expected)
    assert 0 < len(faces) < (corners[..., 2] == 0.1).all(axis=1).sum() / 2
    for above, count in ((0.015, len(faces)), (0.0153, 0)):
        # 2.2 radii and the depth are 15.2 mm.
        found = facing_faces(mesh, TOP + [0, 0, above], DOWN, radius_m=radius, deepest_m=0.002)
        assert len(found) == count


@pytest.fixture(scope="module")
def standing(coarse):
    setup = indentation_setup(
        coarse,
        floor(1e-4, contact="resting"),
        TOP,
        DOWN,
        radius_m=RADIUS,
        deepest_m=0.004,
        surface=None,
        options=IndentationOptions(edge_m=0.03, growth=1.0, refine_radius_m=0.03, base_edge_m=0.05),
    )
    return setup, setup.pressed("neo_hookean", 0.3)


def test_the_equations_of_a_press_are_slopes_of_its_energy(standing):
    setup, solid = standing
    x = setup.first_start(0.003)
    assert x[:, 2] == pytest.approx(setup.moved.nodes_m[:, 2] - 0.0015)
    solid.table.settle(x)
    rng = np.random.default_rng(2)
    x = x + 1e-5 * rng.normal(size=x.shape)
    centre = solid.centre_m(0.003)
    assert centre == pytest.approx(TOP + [0, 0, RADIUS - 0.003])
    step = 1e-8 * rng.normal(size=x.shape)
    ends = [solid._energy(x + sign * step, centre) for sign in (1, -1)]
    forces = solid._forces(x, centre)
    assert (ends[0] - ends[1]) / 2 == pytest.approx((forces * step).sum(), rel=1e-5)
    moved = [solid._forces(x + sign * step, centre) for sign in (1, -1)]
    found = solid._matrix(x, centre, positive=False) @ step.ravel()
    slope = (moved[0] - moved[1]).ravel() / 2
    assert np.linalg.norm(found - slope) < 1e-4 * np.linalg.norm(slope)


def test_what_the_spheres_skin_gives(standing):
    """Of complementary energy Q at a force F: its slope over the force."""
    setup, solid = standing
    x, centre = setup.moved.nodes_m, solid.centre_m(0.002)
    force = solid.sphere_force(x, centre)
    assert force[2] < 0 and np.abs(force[:2]).max() < 0.1 * -force[2]
    touch = sphere_touch(solid.reach.places(x), centre, RADIUS)
    skin = touch_energy(touch, solid.reach)
    first = solid._given(x, centre, State.at_rest(x))
    assert first == pytest.approx(4 / 3 * skin / -force[2])
    # Half of the force before, with a third of the energy.
    before = State(x, force / 2, 0.0, skin / 3, 1)
    power = np.log(3) / np.log(2)
    assert solid._given(x, centre, before) == pytest.approx(power * skin / -force[2])
    assert solid._given(x, solid.centre_m(-0.001), before) == 0.0
