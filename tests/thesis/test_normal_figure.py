"""Figure 4.4: the plane is Eq. 4.4's, and its normal the pipeline's."""

import numpy as np
import open3d as o3d
import pytest
from palpate.vision.clouds import Cloud
from thesis.chapter4 import normal_figure

NEIGHBOURS = 30


@pytest.fixture
def cloud():
    rng = np.random.default_rng(7)
    points = rng.uniform(-0.02, 0.02, (900, 3))
    points[:, 2] = 0.3 * points[:, 0] + 8 * points[:, 1] ** 2 + rng.normal(0, 2e-4, 900) + 0.6
    found = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    found.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    found.orient_normals_towards_camera_location(np.zeros(3))
    return Cloud(np.asarray(found.points), np.asarray(found.normals))


def test_normal_is_the_one_that_the_pipeline_keeps(cloud):
    for place in ([0, 0, 0.6], [0.01, -0.01, 0.6], [-0.015, 0.012, 0.6]):
        fit = normal_figure.fit_plane(cloud, np.array(place), neighbours=NEIGHBOURS)
        assert fit.angle_deg < 1e-4
        assert len(fit.neighbours_m) == NEIGHBOURS


def test_no_other_plane_is_nearer(cloud):
    fit = normal_figure.fit_plane(cloud, np.array([0, 0, 0.6]), neighbours=NEIGHBOURS)
    least = (fit.height_m**2).sum()
    rng = np.random.default_rng(3)
    for tilt in rng.normal(0, 0.02, (50, 3)):
        other = fit.normal + tilt
        other /= np.linalg.norm(other)
        assert (((fit.neighbours_m - fit.centre_m) @ other) ** 2).sum() >= least
    assert fit.height_m.sum() == pytest.approx(0, abs=1e-12)


def test_turning_the_cloud_turns_the_plane(cloud):
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, [0.1, -0.2, 0.9]
    seen = Cloud(cloud.points_m @ turn.T + pose[:3, 3], cloud.normals @ turn.T)
    contact = np.array([0, 0, 0.6])
    alignment = {"camera_from_object": pose.tolist(), "contact_point_m": contact.tolist()}
    moved, fit = normal_figure.pressed_plane(seen, alignment, neighbours=NEIGHBOURS)
    same = normal_figure.fit_plane(cloud, contact + normal_figure.ASIDE_M, neighbours=NEIGHBOURS)
    assert moved.points_m == pytest.approx(cloud.points_m, abs=1e-12)
    assert fit.normal == pytest.approx(same.normal, abs=1e-9)


@pytest.mark.parametrize("neighbours", [2, 901])
def test_number_of_neighbours(cloud, neighbours):
    with pytest.raises(ValueError, match=rf"neighbours: expected 3 to .* 900 .*found {neighbours}"):
        normal_figure.fit_plane(cloud, np.zeros(3), neighbours=neighbours)
