"""Thickness of a solid along a line, and where a sphere first touches it."""

import numpy as np
import pytest
from palpate.solid import obstacle
from palpate.solid.mesh import solid_mesh
from skfem import MeshTet

RADIUS, DOWN, TOP = 0.02, np.array([0.0, 0, -1]), np.array([0.05, 0.05, 0.1])


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
