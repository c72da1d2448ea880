"""Forms and meshes of the lab's objects; the ear phantom: box, topology, slopes, anatomy."""

import numpy as np
import pytest
import trimesh
from scipy.ndimage import label
from skfem import MeshTet
from virtual_lab.level_set import boundary_surface, level_set_mesh, refined_near
from virtual_lab.shapes import Ball, shape_of
from virtual_lab.signed_distance import EAR_BOX_M, ear_distance, uncut_ear_distance
from virtual_lab.tetrahedra import interpolation, tetrahedral_solid

RADIUS = 0.05


def sphere(points):
    return np.linalg.norm(points, axis=-1) - RADIUS


@pytest.fixture(scope="module")
def eighth():
    """An eighth of a sphere: three flat cuts and a curved side."""
    high = np.full(3, 0.055)
    return level_set_mesh(sphere, np.zeros(3), high, 0.008)


def test_a_level_set_is_filled_with_good_tetrahedra(eighth):
    nodes, tets = eighth
    corners = nodes[tets]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    assert volumes.min() > 0
    assert volumes.sum() == pytest.approx(np.pi / 6 * RADIUS**3, rel=0.03)
    surface = trimesh.Trimesh(*boundary_surface(nodes, tets), process=False)
    assert surface.is_watertight
    assert surface.volume == pytest.approx(volumes.sum())


def test_cuts_are_exactly_flat_and_the_curve_is_met(eighth):
    nodes, _ = eighth
    assert nodes.min() == 0
    outside = sphere(nodes)
    assert outside.max() < 1e-4
    cut = nodes[nodes[:, 2] == 0]
    assert np.linalg.norm(cut, axis=1).max() == pytest.approx(RADIUS, abs=1e-4)


def test_refinement_near_a_spot_stays_on_the_surface(eighth):
    nodes, tets = eighth
    mesh = MeshTet(np.ascontiguousarray(nodes.T), np.ascontiguousarray(tets.T))
    spot = np.array([0, 0, RADIUS])
    planes = [(axis, 0.0) for axis in range(3)]
    fine = refined_near(mesh, sphere, [(spot, 0.0015)], planes=planes)
    corners = fine.p.T[fine.t.T]
    near = np.linalg.norm(corners.mean(axis=1) - spot, axis=1) < 0.003
    edges = np.linalg.norm(corners[:, [0, 0, 0, 1, 1, 2]] - corners[:, [1, 2, 3, 2, 3, 3]], axis=2)
    assert edges[near].max() < 2.6 * 0.0015
    surface = np.unique(fine.facets[:, fine.boundary_facets()])
    curved = (np.abs(fine.p[:, surface]) > 1e-9).all(axis=0)
    assert np.abs(sphere(fine.p[:, surface[curved]].T)).max() < 3e-4


def test_curved_quadratic_elements_have_the_balls_volume_and_carry_fields():
    solid, mesh = tetrahedral_solid(
        sphere,
        (np.zeros(3), np.full(3, 0.055)),
        [(axis, 0.0) for axis in range(3)],
        [(np.array([0, 0, RADIUS]), 0.004)],
        spacing_m=0.012,
        reaches={"top": (np.array([0, 0, RADIUS]), 0.02)},
    )
    assert solid.weights_m3.sum() == pytest.approx(np.pi / 6 * RADIUS**3, rel=2e-3)
    # The patch holds the curved side alone, a cap of chord 20 mm or so.
    area = solid.patches["top"].weights_m2.sum()
    assert area == pytest.approx(np.pi * 0.02**2 / 4, rel=0.15)
    points = np.random.default_rng(0).uniform(0.005, 0.02, (200, 3))
    matrix = interpolation(mesh, solid, points)

    def field(x):
        return x[:, 0] ** 2 + 3 * x[:, 1] * x[:, 2] - x[:, 2]

    assert matrix @ field(solid.nodes_m) == pytest.approx(field(points), abs=2e-6)


def test_nothing_in_the_box():
    with pytest.raises(ValueError, match="expected a solid in the box"):
        level_set_mesh(sphere, np.full(3, 0.06), np.full(3, 0.08), 0.01)


def test_the_balls_surface_for_pictures():
    vertices, faces = Ball(0.0614).surface()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.0614**3, rel=1e-3)
    assert mesh.bounds[:, 2] == pytest.approx([0, 0.1228], abs=1e-6)


@pytest.mark.long
def test_the_ear_has_its_size_and_about_twenty_thousand_vertices():
    vertices, faces = shape_of({"shape": {"kind": "ear"}}).surface()
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert mesh.extents * 1e3 == pytest.approx([94, 62, 38], abs=1.0)
    assert 18_000 < len(vertices) < 22_000
    assert mesh.bounds[0, 2] == 0


SPACING_M = 0.0015


def grid(low, high, spacing=SPACING_M):
    axes = [np.arange(a, b, spacing) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def height(x, y):
    """Greatest height of the ear above a point of the table [m]."""
    z = np.arange(0, 0.04, 5e-5)
    column = np.column_stack([np.full_like(z, x), np.full_like(z, y), z])
    inside = z[ear_distance(column) < 0]
    return inside.max() if len(inside) else 0.0


def gradient(points, step_m=1e-5):
    sides = [ear_distance(points + o) - ear_distance(points - o) for o in step_m * np.eye(3)]
    return np.stack(sides, axis=1) / (2 * step_m)


@pytest.fixture(scope="module")
def lattice():
    points = grid((-0.05, -0.035, -0.003), (0.05, 0.035, 0.0415))
    return points, ear_distance(points.reshape(-1, 3)).reshape(points.shape[:3])


@pytest.fixture(scope="module")
def near(lattice):
    """Random points close to the curved surface."""
    points, values = lattice
    spots = points[(np.abs(values) < 0.001) & (points[..., 2] > 0.001)]
    return spots + np.random.default_rng(1).uniform(-2e-4, 2e-4, spots.shape)


@pytest.mark.parametrize(("axis", "sign"), [(0, -1), (0, 1), (1, -1), (1, 1), (2, 1)])
def test_fills_its_box_and_no_more(lattice, axis, sign):
    """It meets the plane 0.1 mm inside each face, and not the one as far outside."""
    points, values = lattice
    inside, face = points[values < 0], EAR_BOX_M[axis] / (1 if axis == 2 else 2)
    assert inside[:, 2].min() > 0 and (sign * inside[:, axis]).max() <= face + 1e-4
    farthest = inside[np.argmax(sign * inside[:, axis])]
    low, high = farthest - 0.012, farthest + 0.012
    low[2] = max(low[2], 1e-5)
    low[axis], high[axis] = 0, 1e-9
    plane = grid(low, high, 4e-4).reshape(-1, 3)
    for beyond, meets in ((-1e-4, True), (1e-4, False)):
        plane[:, axis] = sign * (face + beyond)
        assert (ear_distance(plane).min() < 0) == meets


def test_is_one_piece_without_voids(lattice):
    _points, values = lattice
    assert label(values < 0)[1] == 1
    assert label(values >= 0)[1] == 1


def test_rests_on_a_flat_bottom():
    bottom = grid((-0.03, -0.015, 0), (0.03, 0.015, 1e-9)).reshape(-1, 3)
    above, below = bottom + [0, 0, 1e-4], bottom - [0, 0, 1e-4]
    assert ear_distance(above) == pytest.approx(-1e-4)
    assert ear_distance(below) == pytest.approx(1e-4)
    assert (uncut_ear_distance(below) < -0.001).all()


def test_slopes_like_a_distance(near):
    slope = np.linalg.norm(gradient(near), axis=1)
    assert np.percentile(slope, 99) < 1.1
    assert np.percentile(slope, 10) > 0.7
    step = np.random.default_rng(2).normal(size=near.shape)
    step *= 3e-4 / np.linalg.norm(step, axis=1)[:, None]
    change = np.abs(ear_distance(near + step) - ear_distance(near))
    assert change.max() < 1.2 * 3e-4


def test_lobe_faces_up_and_is_thick_and_smooth():
    x, y = (-0.0345, 0.0010)
    top = height(x, y)
    normal = gradient(np.array([[x, y, top]]))[0]
    assert normal[2] / np.linalg.norm(normal) > np.cos(np.deg2rad(10))
    turn = np.arange(0, 2 * np.pi, np.pi / 8)
    ring = np.array([height(x + 0.006 * np.cos(a), y + 0.006 * np.sin(a)) for a in turn])
    assert ring.min() > 0.010
    assert np.abs(ring - top).max() < 0.0025


def test_has_the_parts_of_an_ear():
    rim, antihelix, concha = height(0.010, 0.0263), height(0.002, 0.015), height(-0.003, 0.001)
    scapha, fossa, crus = height(0.022, 0.017), height(0.027, -0.006), height(0.018, -0.004)
    tragus, antitragus, notch = height(-0.006, -0.015), height(-0.020, 0.0), height(-0.016, -0.009)
    assert rim > concha + 0.008
    assert antihelix > concha + 0.008
    assert scapha < min(rim, antihelix) - 0.003
    assert fossa < crus - 0.002
    assert notch < min(tragus, antitragus) - 0.001
