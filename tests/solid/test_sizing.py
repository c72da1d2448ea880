"""Shorter edges where the object stands."""

import numpy as np
import pytest
import trimesh
from palpate.solid.fill import (
    SUPPORT_NODES,
    _Filler,
    edge_field,
    support_edge,
    supported_area,
)
from palpate.solid.support import Support

RADIUS_M = 0.05


@pytest.fixture(scope="module")
def ball():
    """Ball that stands on the plane z = 0 with the middle of a triangle."""
    surface = trimesh.creation.icosphere(subdivisions=2, radius=RADIUS_M)
    turn = trimesh.geometry.align_vectors(surface.triangles_center[0], [0, 0, -1])
    surface.apply_transform(turn)
    surface.apply_translation([0, 0, -surface.bounds[0, 2]])
    return surface


def table(tolerance_m, normal=(0, 0, 2)):
    return Support(np.zeros(3), np.array(normal, dtype=float), tolerance_m)


def test_area_of_a_cap_and_of_a_box():
    fine = trimesh.creation.icosphere(subdivisions=6, radius=RADIUS_M)
    fine.apply_translation([0, 0, RADIUS_M])
    # Archimedes: as much as the cylinder around it.
    cap = 2 * np.pi * RADIUS_M * 0.004
    assert supported_area(fine, table(0.004)) == pytest.approx(cap, rel=2e-3)
    box = trimesh.creation.box((0.1, 0.2, 0.05))
    box.apply_translation([0, 0, 0.025])
    expected = 0.1 * 0.2 + 0.003 * 2 * (0.1 + 0.2)
    for normal in ((0, 0, 2), (0, 0, -1)):
        assert supported_area(box, table(0.003, normal)) == pytest.approx(expected)


def test_edge_puts_the_wanted_nodes_on_the_area():
    box = trimesh.creation.box((0.1, 0.2, 0.05))
    box.apply_translation([0, 0, 0.025])
    edge = support_edge(box, table(1e-6))
    assert 0.1 * 0.2 / (edge**2 * 3**0.5 / 2) == pytest.approx(SUPPORT_NODES, rel=1e-3)
    box.apply_translation([0, 0, 0.1])
    assert support_edge(box, table(0.001)) == np.inf


def test_field_grows_from_the_support_and_covers_the_surface(ball):
    field = edge_field(ball.vertices, table(0.001), support_edge_m=0.004, edge_m=0.02)
    nodes = field["bg_vertices"]
    heights = np.abs(nodes[:, 2])
    assert field["bg_values"] == pytest.approx(np.minimum(0.004 + heights, 0.02))
    assert (nodes.min(axis=0) < ball.bounds[0]).all()
    assert (nodes.max(axis=0) > ball.bounds[1]).all()
    corners = nodes[field["bg_tets"]]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6
    assert volume == pytest.approx(np.prod(np.ptp(nodes, axis=0)))


def test_a_ball_is_filled_so_that_it_can_be_held(ball):
    def held(support):
        mesh = _Filler.of(ball, 2 * RADIUS_M * 3**0.5, support).fill(0.03, 2e-3)
        heights = mesh.nodes_m[mesh.surface_nodes(), 2]
        return np.count_nonzero(np.abs(heights) < 0.001)

    assert held(table(0.001)) >= 5 > held(None)
