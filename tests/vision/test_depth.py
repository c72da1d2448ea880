"""Depth of each kind of sensor, clouds and the table's plane."""

import cv2
import numpy as np
import pytest
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import (
    Cloud,
    ProbePlace,
    belongs_to_probe,
    object_cloud,
    pack_clouds,
    unpack_clouds,
)
from palpate.vision.depth import kinect_depth, millimetre_depth, stereo_depth, stereo_disparity
from palpate.vision.support_plane import fit_support_plane, height_above

OPTIONS = {
    "lowest_m": 0.004,
    "voxel_m": 0.002,
    "normal_neighbours": 30,
    "outlier_neighbours": 20,
    "outlier_ratio": 2.0,
    "cluster_gap_m": 0.01,
}


def test_kinect_equation(sensors):
    spec = sensors["kinect"]["depth"]
    depth = kinect_depth(np.array([[690, 2047, 1090]], np.uint16), spec)
    assert depth[0, 0] == pytest.approx(584.6213 * 0.075 / 50)
    assert np.isnan(depth[0, 1:]).all()


def test_millimetres():
    assert millimetre_depth(np.array([[850, 0]]))[0, 0] == 0.85
    assert np.isnan(millimetre_depth(np.array([[850, 0]]))[0, 1])


def test_stereo_depth_of_a_textured_plane(sensors):
    sensor = sensors["bumblebee"]
    rng = np.random.default_rng(2)
    texture = cv2.GaussianBlur(rng.uniform(0, 255, (300, 900)).astype(np.float32), (0, 0), 1.2)
    texture = np.clip((texture - 127) * 3 + 127, 0, 255)
    disparity = 140.5
    shift = np.array([[1, 0, -disparity], [0, 1, 0]], dtype=np.float32)
    right = cv2.warpAffine(texture, shift, (900, 300), flags=cv2.INTER_CUBIC)
    depth = stereo_depth(texture.astype(np.uint8), np.clip(right, 0, 255).astype(np.uint8), sensor)
    inner = depth[20:-20, 260:-20]
    expected = 790 * 0.12 / disparity
    assert np.isfinite(inner).mean() > 0.95
    assert np.nanmedian(np.abs(inner - expected)) < 1e-3


def test_stereo_on_measured_disparity(sensors, real_data):
    folder = real_data / "stereo_gt" / "aloe"
    left, right = (cv2.imread(str(folder / f"aloe{side}.jpg")) for side in "LR")
    truth = cv2.imread(str(folder / "aloeGT.png"), cv2.IMREAD_GRAYSCALE).astype(float)
    # Any optics that make the search range 32 to 224 pixels will do.
    sensor = dict(sensors["bumblebee"], range_m=[790 * 0.12 / 224, 790 * 0.12 / 32])
    found = stereo_disparity(left, right, sensor)
    both = np.isfinite(found) & (truth > 32)
    error = np.abs(found - truth)[both]
    assert both.mean() > 0.5
    assert np.median(error) < 0.5
    assert (error > 1).mean() < 0.12


def test_support_plane_among_clutter():
    rng = np.random.default_rng(1)
    normal = np.array([0.1, -0.7, -0.7])
    normal /= np.linalg.norm(normal)
    ground = rng.uniform(-0.4, 0.4, (5000, 2))
    a, b = np.linalg.svd(normal[None])[2][1:]
    points = [0, 0, 0.8] + ground @ np.stack([a, b]) + rng.normal(0, 1e-3, (5000, 1)) * normal
    clutter = [0, 0, 0.7] + rng.uniform(-0.1, 0.1, (1500, 3))
    plane = fit_support_plane(
        np.concatenate([points, clutter]), inlier_distance_m=0.004, rng=np.random.default_rng(0)
    )
    assert np.degrees(np.arccos(plane[:3] @ normal)) < 0.1
    assert abs(height_above(plane, np.array([[0, 0, 0.8]]))[0]) < 3e-4
    with pytest.raises(ValueError, match="at least 100 points, found 3"):
        fit_support_plane(points[:3], inlier_distance_m=0.01, rng=rng)


@pytest.fixture
def wall(sensors):
    """Points on a plane 0.7 m before the camera, seen in the middle of its image."""
    camera = camera_from_spec(sensors["kinect"]["color"])
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 120), np.linspace(-0.1, 0.1, 120)), -1)
    points = np.column_stack([grid.reshape(-1, 2), np.full(120 * 120, 0.7)])
    mask = np.zeros((480, 640), bool)
    mask[:, :311] = True
    return camera, points, mask


def test_cloud_is_cut_thinned_and_oriented(wall, probe):
    camera, points, mask = wall
    place = ProbePlace(np.array([-0.05, 0, 0.7]), np.array([0, 1.0, 0]), np.array([0, -0.5, 0.7]))
    plane = np.array([0, -1.0, 0, 0.06])
    cloud = object_cloud(points, mask, camera, plane, place, probe["exclusion"], **OPTIONS)
    assert cloud.points_m[:, 0].max() < 0.002
    assert cloud.points_m[:, 1].max() < 0.06 - OPTIONS["lowest_m"] + 1e-9
    assert not belongs_to_probe(cloud.points_m, place, probe["exclusion"]).any()
    assert np.allclose(cloud.normals, [0, 0, -1], atol=1e-6)
    with pytest.raises(ValueError, match="expected points of the object, found 0"):
        object_cloud(points, ~(mask | True), camera, plane, place, probe["exclusion"], **OPTIONS)


def test_a_piece_apart_is_not_the_object(wall, probe):
    camera, points, mask = wall
    stray = np.array([-0.05, 0.0, 0.5]) + np.random.default_rng(0).normal(0, 0.001, (60, 3))
    place = ProbePlace(np.array([-0.05, 0, 0.9]), np.array([0, 1.0, 0]), np.array([0, -0.5, 0.9]))
    plane = np.array([0, -1.0, 0, 0.06])
    both = np.concatenate([points, stray])
    cloud = object_cloud(both, mask, camera, plane, place, probe["exclusion"], **OPTIONS)
    assert np.allclose(cloud.points_m[:, 2], 0.7)


def test_clouds_round_trip():
    rng = np.random.default_rng(0)
    clouds = [Cloud(rng.normal(size=(n, 3)), rng.normal(size=(n, 3))) for n in (4, 7, 2)]
    again = unpack_clouds(pack_clouds(clouds))
    for one, other in zip(clouds, again, strict=True):
        assert np.allclose(one.points_m, other.points_m, atol=1e-6)
        assert np.allclose(one.normals, other.normals, atol=1e-6)
