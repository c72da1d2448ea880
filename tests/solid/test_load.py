"""Node sets, contact triangle, nodal forces and Hertz's pressure."""

import numpy as np
import pytest
from palpate.solid.laws import lame_from_engineering
from palpate.solid.load import contact_pressure, contact_triangle, hertz_contact_radius, nodal_force
from palpate.solid.mesh import quadratic, refine_near, solid_mesh
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.solid.support import read_support
from skfem import MeshTet
from solid_cases import dofs, of_order

PRESS = {"indenter_radius_m": 0.006, "depth_m": 0.004}
TOP = np.array([0.05, 0.05, 0.1])
DOWN = np.array([0, 0, -1.0])
ORDERS = pytest.mark.parametrize("order", [1, 2])


def test_contact_far_from_the_surface_is_refused(cube):
    for point in (TOP + [0, 0, 0.1], TOP * np.nan):
        with pytest.raises(ValueError, match="expected within 0.01 m of the surface"):
            contact_triangle(cube, point, largest_distance_m=0.01)


@ORDERS
def test_force_is_kept_or_as_printed(cube, order):
    mesh = of_order(cube, order)
    triangle = contact_triangle(mesh, TOP, largest_distance_m=0.01)
    force = np.array([0.3, 0.0, -0.4])
    kept = nodal_force(mesh, triangle, force, rule="conserve", turn_to_normal=False, **PRESS)
    assert np.allclose(kept.sum(axis=0), force)
    turned = nodal_force(mesh, triangle, force, rule="conserve", turn_to_normal=True, **PRESS)
    assert np.allclose(turned.sum(axis=0), [0, 0, -0.5])
    # A uniform traction acts at the triangle's centre.
    moment = np.cross(mesh.nodes_m, kept).sum(axis=0)
    a, b, c = mesh.nodes_m[triangle[:3]]
    assert np.allclose(moment, np.cross((a + b + c) / 3, force))
    if order == 1:
        as_printed = {"rule": "area_ratio", "turn_to_normal": False}
        printed = nodal_force(mesh, triangle, force, **as_printed, **PRESS)
        area = np.linalg.norm(np.cross(b - a, c - a)) / 2
        assert np.allclose(printed[triangle[0]], force * area / (np.pi * 0.006 * 0.004))


@ORDERS
def test_hertz_patch_keeps_force_and_moment(cube, order):
    mesh = of_order(cube, order)
    force, centre = np.array([0.2, -0.1, -2.0]), TOP + [0.004, -0.007, 0]
    loads = contact_pressure(mesh, centre, DOWN, force, contact_radius_m=0.006)
    assert np.allclose(loads.sum(axis=0), force, rtol=1e-14)
    moment = np.cross(mesh.nodes_m, loads).sum(axis=0)
    assert np.allclose(moment, np.cross(centre, force), atol=2e-5 * np.linalg.norm(force))
    assert not loads[np.linalg.norm(mesh.nodes_m - centre, axis=1) > 0.06].any()
    # Twice the radius spreads the same force: its second moment over the disc is 2/5 a^2.
    if order == 2:
        wide = contact_pressure(mesh, TOP, DOWN, DOWN, contact_radius_m=0.03)
        r2 = ((mesh.nodes_m - TOP)[:, :2] ** 2).sum(axis=1)
        assert -wide[:, 2] @ r2 == pytest.approx(0.4 * 0.03**2, rel=2e-3)


def test_hertz_patch_loads_the_near_side_alone(cube):
    mesh = quadratic(solid_mesh(cube.nodes_m * [1, 1, 0.1], cube.tetrahedra))
    loads = contact_pressure(mesh, TOP * [1, 1, 0.1], DOWN, DOWN, contact_radius_m=0.02)
    assert np.allclose(mesh.nodes_m[loads.any(axis=1), 2], 0.01)


def test_hertzs_contact_radius():
    assert hertz_contact_radius(indenter_radius_m=0.009, depth_m=0.004) == pytest.approx(0.006)
    assert hertz_contact_radius(indenter_radius_m=0.009, depth_m=0.02) == 0.009
    with pytest.raises(ValueError, match="depth_m: expected above 0, found 0"):
        hertz_contact_radius(indenter_radius_m=0.009, depth_m=0.0)


def pressed(refinements, edge_m, places):
    """Displacement along z at places of a block under Hertz's pressure."""
    mesh = MeshTet().refined(refinements)
    coarse = solid_mesh((mesh.p.T - [0.5, 0.5, 0]) * [0.2, 0.2, 0.1], mesh.t.T)
    top = np.array([0, 0, 0.1])
    fine = refine_near(coarse, top, radius_m=0.008, edge_m=edge_m)
    solid = quadratic(fine)
    f = contact_pressure(solid, top, DOWN, 1.0 * DOWN, contact_radius_m=0.005)
    free = dofs(np.flatnonzero(solid.nodes_m[:, 2] > 1e-9))
    K = combined(*elastic_stiffness(solid), *lame_from_engineering(25e3, 0.3))[free][:, free]
    u = np.zeros(f.size)
    u[free] = factorise(K)(f.ravel()[free])
    nearest = [int(np.argmin(np.linalg.norm(solid.nodes_m - p, axis=1))) for p in places]
    assert np.allclose(solid.nodes_m[nearest], places)
    return u.reshape(-1, 3)[nearest, 2]


def test_hertz_patch_does_not_depend_on_the_mesh():
    places = np.array([[0, 0, 0.1], [0.05, 0, 0.1], [0, 0, 0.05]])
    one, two = pressed(2, 0.006, places), pressed(3, 0.0035, places)
    assert one == pytest.approx(two, rel=0.03)
    # Half-space under the middle (Johnson 1985, Eq. 3.41a): 3 F / (4 E* a).
    half_space = -3 * 1.0 * (1 - 0.3**2) / (4 * 25e3 * 0.005)
    assert two[0] == pytest.approx(half_space, rel=0.04)


TILTED = {"plane_point_m": [0, 0, 1], "plane_normal": [0, 3, 4], "tolerance_m": 0.1}


def test_a_tilted_plane_s_heights_and_supports_that_are_none():
    support = read_support(TILTED)
    points = np.array([[5.0, 0, 1], [0, 0.05, 1.05], [0, 3, 5]])
    assert support.heights_m(points) == pytest.approx([0, 0.07, 5])
    assert support.holds(points).tolist() == [True, True, False]
    assert not support.resting
    assert read_support(TILTED | {"contact": "resting"}).resting

    for change, line in (
        ({"plane_normal": [0, 0, 0]}, r"support.plane_normal: expected a direction, found \[0.0"),
        ({"plane_normal": [0, 0, np.inf]}, "support.plane_normal: expected a direction"),
        ({"contact": "glued"}, "support.contact: expected one of bonded, resting, found glued"),
    ):
        with pytest.raises(ValueError, match=line):
            read_support(TILTED | change)
