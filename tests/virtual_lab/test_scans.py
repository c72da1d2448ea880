"""The laser scanner, and the template that is made from its views."""

import numpy as np
import pytest
import trimesh
from palpate.open3d_core import ClosestPoints, o3d
from palpate.solid.quality import cutting_triangles
from palpate.surface.scans import implicit_surface, read_scans, register, template_from_scans
from palpate.surface.template import unfolded
from virtual_lab.scanner import NOISE_M, scan_views, write_scans

RADII = np.array([0.05, 0.035, 0.03])
LASER = {
    "elevations_deg": [35, -35],
    "turns_deg": [0, 60, 120, 180, 240, 300],
    "distance_m": 0.7,
    "turn_error_deg": 0.5,
    "shift_error_m": 0.0005,
}


@pytest.fixture(scope="module")
def bean():
    """A smooth body without symmetry."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    x, y, z = ball.vertices.T
    bump = 1 + 0.15 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.1 * np.sin(4 * z)
    ball.vertices = ball.vertices * RADII * bump[:, None] + [0, 0, 0.03]
    return ball


@pytest.fixture(scope="module")
def views(bean):
    return scan_views(bean.vertices, bean.faces, LASER, np.random.default_rng(0))


def test_a_view_has_the_scanners_noise(bean, views):
    offsets = ClosestPoints(bean.vertices, bean.faces).signed_distance(views[0][0])
    assert len(offsets) > 20_000
    assert abs(offsets.mean()) < 2e-5
    assert 0.8 * NOISE_M[2] < offsets.std() < 1.2 * NOISE_M[0]


def test_rounding_of_a_processor_changes_no_file(bean, views, tmp_path):
    """A ray that grazes the surface may be counted or not, and no other sample changes."""
    other = scan_views(bean.vertices * (1 + 1e-14), bean.faces, LASER, np.random.default_rng(0))
    for name, one in (("one", views), ("other", other)):
        (tmp_path / name).mkdir()
        write_scans(tmp_path / name, one)
    for file in sorted((tmp_path / "one").iterdir()):
        assert file.read_bytes() == (tmp_path / "other" / file.name).read_bytes()
    fewer = bean.faces[bean.vertices[bean.faces[:, 0], 2] < 0.9 * bean.vertices[:, 2].max()]
    part, *_ = scan_views(bean.vertices, fewer, LASER, np.random.default_rng(0))
    whole, seen = ({tuple(point) for point in one[0]} for one in (views[0], part))
    # Some see the inside of the other wall instead.
    assert len(seen - whole) < 0.2 * len(seen) and len(whole - seen) > 100


@pytest.mark.long
def test_registration_takes_out_the_turntables_errors(bean, views, tmp_path):
    write_scans(tmp_path, views)
    loaded = read_scans(tmp_path)
    assert len(loaded) == 12
    closest = ClosestPoints(bean.vertices, bean.faces)
    before = max(np.abs(closest.distance(points)).mean() for points, _ in loaded)
    after = max(np.abs(closest.distance(points)).mean() for points, _ in register(loaded))
    assert before > 3e-4
    assert after < 0.5 * before


@pytest.mark.long
def test_a_template_is_closed_and_near_the_truth(bean, views, tmp_path):
    write_scans(tmp_path, views)
    mesh = template_from_scans(read_scans(tmp_path), vertices=1200, spacing_m=0.002)
    assert mesh.is_watertight
    assert len(mesh.vertices) == pytest.approx(1200, rel=0.02)
    away = ClosestPoints(bean.vertices, bean.faces).distance(mesh.sample(5000, seed=0))
    assert away.mean() < 2.5e-4
    assert mesh.volume == pytest.approx(bean.volume, rel=0.01)
    rounded = [(points * (1 + 1e-15), normals) for points, normals in read_scans(tmp_path)]
    same = template_from_scans(rounded, vertices=1200, spacing_m=0.002)
    assert np.array_equal(same.faces, mesh.faces) and same.vertices == pytest.approx(mesh.vertices)


@pytest.mark.parametrize("fault", ["turned over", "none"])
def test_normals_that_a_scanner_has_wrong_leave_neither_bump_nor_hole(fault, tmp_path):
    """A grazing view turns some over; there are none where it sees too little around a point."""
    rng, radius_m = np.random.default_rng(1), 0.05
    for k in range(2):
        normals = rng.standard_normal((12_000, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(radius_m * normals))
        if fault == "none":
            normals[::500] = np.nan
        else:
            normals[(np.abs(normals[:, 0]) < 0.2) & (rng.random(len(normals)) < 0.1)] *= -1
        cloud.normals = o3d.utility.Vector3dVector(normals)
        o3d.io.write_point_cloud(str(tmp_path / f"{k}.ply"), cloud)
    mesh = template_from_scans(read_scans(tmp_path), vertices=800, spacing_m=0.004)
    away = np.linalg.norm(mesh.vertices, axis=1) - radius_m
    assert mesh.is_watertight and np.abs(away).max() < 4e-4


def test_views_that_make_no_template_are_refused(views, tmp_path):
    """They do not overlap or close, there are none, or no memory holds their grid."""
    with pytest.raises(ValueError, match="scans: "):
        template_from_scans(views[:2], vertices=1000, spacing_m=0.002)
    with pytest.raises(ValueError, match="scans"):
        read_scans(tmp_path / "none")
    points = np.random.default_rng(1).random((100, 3))
    with pytest.raises(ValueError, match="expected 0.0043 m or more .* found 0.001 m .968 million"):
        implicit_surface(points, points, np.ones(len(points)), 0.001)


def test_a_fold_is_smoothed_away_and_the_rest_stays():
    ball = trimesh.creation.icosphere(subdivisions=3)
    folded = ball.copy()
    folded.vertices[100] += 1.6 * (
        ball.vertices[ball.vertex_neighbors[100][0]] - ball.vertices[100]
    )
    assert len(cutting_triangles(folded.vertices, folded.faces))
    mended = unfolded(folded)
    assert not len(cutting_triangles(mended.vertices, mended.faces))
    moved = np.linalg.norm(mended.vertices - ball.vertices, axis=1) > 1e-12
    assert moved.sum() <= 20
    assert np.allclose(np.linalg.norm(mended.vertices, axis=1), 1, atol=0.1)
