"""Facets made smooth, solids bent to them, and mirrors of a surface."""

import numpy as np
import pytest
import trimesh
from palpate.solid.mesh import SolidMesh, element_volumes, quadratic, refine_near, solid_mesh
from palpate.solid.smooth_surface import (
    LEAST_VOLUME,
    SmoothSurface,
    bent_to,
    corner_normals,
    curved_to,
)
from palpate.solid.stiffness import QUADRATURE, combined, elastic_stiffness, point_volumes


def smooth_of(mesh):
    return SmoothSurface(np.array(mesh.vertices), np.array(mesh.faces))


def flat_points(mesh):
    weights = np.random.default_rng(4).dirichlet(np.ones(3), size=len(mesh.faces))
    return np.einsum("mk,mka->ma", weights, mesh.triangles)


def spokes_of(ball, more_nodes=(), more=()):
    """Four-node elements from the facets of a ball to its centre."""
    spokes = np.column_stack([ball.faces, np.full(len(ball.faces), len(ball.vertices))])
    return solid_mesh(np.vstack([ball.vertices, np.zeros(3), *more_nodes]), [*spokes, *more])


def spoked_ball(level):
    """Ten-node elements from the facets of a ball to its centre, and the ball."""
    ball = trimesh.creation.icosphere(level, radius=0.06)
    return quadratic(spokes_of(ball)), ball


def test_sphere_s_facets_come_near_it_with_the_fourth_power_and_a_box_keeps_its_sides():
    errors = []
    for level in (2, 3, 4):
        ball = trimesh.creation.icosphere(level, radius=0.06)
        radius = np.linalg.norm(smooth_of(ball).nearest(flat_points(ball)), axis=1)
        errors.append(np.abs(radius - 0.06).max())
    order = np.polyfit(np.arange(3), -np.log2(errors), 1)[0]
    assert order > 3.5
    assert errors[0] < 1e-4
    box = trimesh.creation.box((0.1, 0.2, 0.05)).subdivide()
    points = flat_points(box)
    assert np.abs(smooth_of(box).nearest(points) - points).max() < 1e-7


def test_refined_ball_comes_nearer_to_its_sphere():
    ball = trimesh.creation.icosphere(2, radius=0.06)
    mesh = refine_near(spokes_of(ball), np.zeros(3), radius_m=0.1, edge_m=0.014)
    bent = bent_to(mesh, smooth_of(ball))
    away = [
        np.abs(np.linalg.norm(m.nodes_m[m.surface_nodes()], axis=1) - 0.06).max()
        for m in (mesh, bent)
    ]
    assert away[1] < 0.05 * away[0]
    assert bent.volume_m3 > mesh.volume_m3


def test_an_element_that_the_surface_would_flatten_is_moved_less():
    ball = trimesh.creation.icosphere(2, radius=0.06)
    # A low roof over two facets, which the smooth sphere would all but flatten.
    (a, b), (left, right) = ball.face_adjacency_edges[0], ball.face_adjacency_unshared[0]
    over, new = ball.vertices[[a, b]].mean(axis=0) * 1.12, len(ball.vertices) + 1
    solid = spokes_of(ball, [over], [[a, left, b, new], [a, right, b, new]])
    bent = bent_to(solid, smooth_of(ball))
    before, after = (element_volumes(m.nodes_m, m.tetrahedra) for m in (solid, bent))
    assert (after / before).min() >= LEAST_VOLUME


def test_curved_elements_fill_a_ball_with_the_fourth_power_of_their_edges():
    exact, errors = 4 / 3 * np.pi * 0.06**3, []
    for level in (2, 3, 4):
        mesh, ball = spoked_ball(level)
        curved = curved_to(mesh, smooth_of(ball))
        assert curved.nodes_m[mesh.corners] == pytest.approx(mesh.nodes_m[mesh.corners])
        errors.append(abs(point_volumes(curved, QUADRATURE[2]).sum() / exact - 1))
        assert errors[-1] < 0.1 * abs(mesh.volume_m3 / exact - 1)
    assert np.polyfit(np.arange(3), -np.log2(errors), 1)[0] > 3.5


def test_curved_elements_keep_rigid_motions_and_straight_strains():
    mesh, ball = spoked_ball(1)
    curved = curved_to(mesh, smooth_of(ball))
    K = combined(*elastic_stiffness(curved), 1.0, 0.7)
    turn = np.cross([0.3, -0.2, 0.5], curved.nodes_m)
    assert np.abs(K @ turn.ravel()).max() < 1e-10 * np.abs(K).max()
    stretch = curved.nodes_m * [1e-2, 0, 0]
    # Its energy is that of the strain, for its volume.
    energy = stretch.ravel() @ K @ stretch.ravel() / 2
    volume = point_volumes(curved, QUADRATURE[2]).sum()
    assert energy == pytest.approx(volume * (1.0 / 2 + 0.7) * 1e-4, rel=1e-9)


def test_a_solid_that_curving_would_fold_is_refused():
    ball = trimesh.creation.icosphere(2, radius=0.06)
    facet = ball.vertices[ball.faces[0]]
    # Flat under one facet, while the sphere rises over it.
    apex = facet.mean(axis=0) * (1 - 2e-4)
    flat = quadratic(solid_mesh(np.vstack([facet, apex]), np.arange(4)[None]))
    with pytest.raises(ValueError, match="expected at most 0.05 of the outer edges off"):
        curved_to(flat, smooth_of(ball))


def test_what_folds_far_from_the_press_stays_as_it_is():
    mesh, ball = spoked_ball(2)
    # Horns in the lower half, which the smooth sphere would flatten.
    corners = SolidMesh(mesh.nodes_m[: len(ball.vertices) + 1], mesh.corners)
    low = np.flatnonzero(corners.nodes_m[:, 2] < -0.02)
    rough = corners.nodes_m.copy()
    rough[low] *= np.random.default_rng(3).uniform(1.5, 3.0, size=(len(low), 1))
    dented = SolidMesh(rough, corners.tetrahedra)
    smooth = smooth_of(ball)
    with pytest.raises(ValueError, match="mesh: expected"):
        curved_to(quadratic(bent_to(dented, smooth)), smooth)

    def upper(points_m):
        return points_m[:, 2] > 0.01

    bent = bent_to(dented, smooth, upper)
    curved = curved_to(quadratic(bent), smooth, upper)
    top = curved.nodes_m[np.unique(curved.surface_faces())]
    top = top[upper(top)]
    assert smooth.distance(top).max() < 1e-6
    whole = element_volumes(dented.nodes_m, dented.tetrahedra)
    assert (element_volumes(bent.nodes_m, bent.tetrahedra) / whole).min() >= LEAST_VOLUME
    watched = np.concatenate([QUADRATURE[2], np.eye(4)])
    kept = len(watched) * point_volumes(curved, watched)
    flat = element_volumes(bent.nodes_m, bent.tetrahedra)
    assert (kept / flat[:, None]).min() >= LEAST_VOLUME


def test_a_solid_on_its_surface_stays_and_one_far_from_it_is_rejected(block):
    box = trimesh.creation.box(bounds=[block.nodes_m.min(axis=0), block.nodes_m.max(axis=0)])
    assert bent_to(block, smooth_of(box)) is block
    small = smooth_of(trimesh.creation.icosphere(2, radius=0.01))
    with pytest.raises(ValueError, match="mesh: expected elements that keep 0.2 of their volume"):
        bent_to(block, small)


def test_normals_are_exact_on_spheres_keep_creases_and_leave_facets_without_an_area_out():
    ball = trimesh.creation.icosphere(2, radius=0.06)
    vertices, faces = np.array(ball.vertices), np.array(ball.faces)
    assert corner_normals(vertices, faces) == pytest.approx(vertices[faces] / 0.06, abs=1e-10)
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    vertices = np.vstack([box.vertices, box.vertices[box.faces[0, :2]].mean(axis=0)])
    faces = np.vstack([box.faces, [*box.faces[0, :2], len(box.vertices)]])
    normals = corner_normals(vertices, faces)
    assert normals[:-1] == pytest.approx(np.repeat(box.face_normals[:, None], 3, axis=1))
    assert np.isfinite(normals).all()
