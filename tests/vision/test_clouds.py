"""Clouds of the object, of depth images and of clouds, and the plane of the table."""

import shutil

import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import write_image
from palpate.capture.tables import write_frames
from palpate.open3d_core import o3d
from palpate.vision.camera import PinholeCamera, camera_block, camera_from_spec, pixel_rays
from palpate.vision.clouds import (
    Cloud,
    ProbePlace,
    Reach,
    clouds_of,
    in_mask,
    object_cloud,
    scene_cloud,
    table_of,
)
from palpate.vision.options import Clouds, SupportPlane
from palpate.vision.probe import AXIS, TIP
from palpate.vision.support_plane import fit_support_plane, height_above
from scipy.spatial import cKDTree

REACH = Reach(np.array([-0.05, 0, 0.7]), 0.2, 0.2, np.array([0, -1.0, 0, 0.06]))


def test_points_in_a_mask():
    """To the nearest pixel, and outside the image in none."""
    mask = np.zeros((6, 8), bool)
    mask[1, 2] = mask[5, 7] = mask[0, 0] = True
    inside = [(2, 1), (2.4, 0.6), (7.4, 5.4), (-0.4, -0.4)]
    outside = [(2.6, 1), (2, 1.6), (7.6, 5), (7, 5.6), (-0.6, 0), (0, -0.6), (3, 3)]
    camera = PinholeCamera(8, 6, 10.0, 20.0, 3.5, 2.5)
    found = in_mask(2.0 * camera.rays(inside + outside), mask, camera)
    assert found.tolist() == [True] * 4 + [False] * 7
    assert in_mask(np.zeros((0, 3)), mask, camera).shape == (0,)


@pytest.fixture
def cut(sensors, probe):
    """Gives the cloud of points in the left half of an image, of a probe so far from the camera."""
    camera = camera_from_spec(sensors["kinect"]["color"])
    left = np.zeros((480, 640), bool)
    left[:, :311] = True

    def cloud(points, z_m, mask=left):
        places = np.array([[-0.05, 0, z_m], [0, 1.0, 0], [0, -0.5, z_m]])
        place = ProbePlace(*places, np.zeros((4, 3)), probe["exclusion"])
        return object_cloud(Cloud(points[in_mask(points, mask, camera)]), place, REACH, Clouds())

    return cloud


@pytest.fixture
def wall():
    """Points on a plane 0.7 m before the camera, seen in the middle of its image."""
    grid = np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 120)] * 2), -1).reshape(-1, 2)
    return np.column_stack([grid, np.full(len(grid), 0.7)])


def test_cloud_is_cut_thinned_and_oriented(wall, cut):
    cloud = cut(wall, 0.7)
    assert cloud.points_m[:, 0].max() < 0.002
    assert cloud.points_m[:, 1].max() < 0.06 - Clouds().lowest_m + 1e-9
    assert np.allclose(cloud.normals, [0, 0, -1], atol=1e-6)
    with pytest.raises(ValueError, match="expected points of the object, found 0"):
        cut(wall, 0.7, np.zeros((480, 640), bool))


def test_a_piece_apart_is_not_the_object(wall, cut):
    stray = np.array([-0.05, 0.0, 0.5]) + np.random.default_rng(0).normal(0, 0.001, (60, 3))
    cloud = cut(np.concatenate([wall, stray]), 0.9)
    assert np.allclose(cloud.points_m[:, 2], 0.7)


CAMERA = PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5)
BLOCK = camera_block(CAMERA, "counts") | {"count_m": 1e-4, "color_from_depth": np.eye(4)}
DEPTH = {"kind": "depth", "color": BLOCK, "depth": BLOCK, "range_m": [0.3, 2.0]}
# A table 0.6 m from the camera, with a top 40 mm above it.
UP, BACK, TOP_M = np.array([0, -1, -1]) / 2**0.5, np.array([0, -1, 1]) / 2**0.5, [0, 0, 0.792]
CLAMP, OBJECT = (0.065, 0.12), (-0.06, 0.06)


def scene(*tops):
    """Depth image of the table with flat tops from x to x on it [m], and the last one's mask."""
    table = -0.6 / (pixel_rays(CAMERA) @ UP)
    away_m, high_m = table.copy(), 0.56 / 0.6 * table
    x, y = np.array([[1, 0, 0], BACK]) @ (high_m[:, None] * pixel_rays(CAMERA) - TOP_M).T
    for left, right in tops:
        inside = (x > left) & (x < right) & (np.abs(y) < 0.05)
        away_m[inside] = high_m[inside]
    return (np.rint(away_m / 1e-4).astype(np.uint16).reshape(240, 320), inside.reshape(240, 320))


@pytest.mark.parametrize(
    ("turn", "eye"),
    [(np.eye(3), np.zeros(3)), (np.array([[1, 0, 0], BACK, UP]), np.array([0.1, 0.2, 0.6]))],
    ids=["camera", "base"],
)
def test_clouds_and_table_are_those_of_depth_images(turn, eye, tmp_path):
    """In the camera's frame, and in a robot's with z up; a clamp stands 5 mm beside the object."""
    sensor = {"kind": "cloud", "cloud": {"unit": "m", "viewpoint_m": eye}, "range_m": [0.3, 2.0]}
    for name, tops in (("background", [CLAMP]), ("08", [CLAMP, OBJECT])):
        (folder := tmp_path / name).mkdir()
        counts, mask = scene(*tops)
        write_image(folder / "0.png", counts, "counts")
        points = scene_cloud({"depth": counts}, DEPTH).points_m @ turn.T + eye
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        o3d.io.write_point_cloud(str(folder / "0.ply"), cloud)
        files = {"color": "0.png", "depth": "0.png", "cloud": "0.ply"}
        write_frames(folder, pd.DataFrame({"frame": [0], "time_s": [0.0]} | files))
        plane = table_of(folder, sensor, SupportPlane(), seed=1)
        assert plane == pytest.approx([*(turn @ UP), 0.6 - turn @ UP @ eye], abs=1e-3), name

    def clouds(spec, turn, eye, masks):
        tip, plane = turn @ (TOP_M + 0.03 * UP) + eye, np.append(turn @ UP, 0.6 - turn @ UP @ eye)
        poses = pd.DataFrame([[*tip, *(turn @ -UP)]], columns=TIP + AXIS)
        probe = {"exclusion": {"radius_m": 0.01, "tip_radius_m": 0.008}}
        given = probe, masks, poses, Reach(tip, 0.08, 0.04, plane), Clouds()
        (found,) = clouds_of(folder, spec, *given)
        return (found.points_m - eye) @ turn, found.normals @ turn

    expected = clouds(DEPTH, np.eye(3), np.zeros(3), [mask])[0]
    found, normals = clouds(sensor, turn, eye, None)
    for one, other in ((expected, found), (found, expected)):
        assert cKDTree(one).query(other)[0].max() < Clouds().voxel_m
    assert normals == pytest.approx(np.tile(UP, (len(found), 1)), abs=0.02)
    shutil.rmtree(tmp_path / "background")
    assert clouds(sensor, turn, eye, None)[0][:, 0].max() > 0.09 > CLAMP[0] > found[:, 0].max()


def test_a_floor_below_the_table_makes_it_ambiguous():
    points = scene_cloud({"depth": scene(OBJECT)[0]}, DEPTH).points_m
    both = np.concatenate([points, 1.5 * points[::2]])
    with pytest.raises(ValueError, match="one 0.300 m below it .*which is the table.*a background"):
        fit_support_plane(both, inlier_distance_m=0.004, rng=np.random.default_rng(0), empty=False)


def table_in(points):
    return fit_support_plane(points, inlier_distance_m=0.004, rng=np.random.default_rng(0))


def test_support_plane_among_clutter():
    rng = np.random.default_rng(1)
    normal = np.array([0.1, -0.7, -0.7])
    normal /= np.linalg.norm(normal)
    ground = rng.uniform(-0.4, 0.4, (5000, 2))
    a, b = np.linalg.svd(normal[None])[2][1:]
    points = [0, 0, 0.8] + ground @ np.stack([a, b]) + rng.normal(0, 1e-3, (5000, 1)) * normal
    clutter = [0, 0, 0.7] + rng.uniform(-0.1, 0.1, (1500, 3))
    plane = table_in(np.concatenate([points, clutter]))
    assert np.degrees(np.arccos(plane[:3] @ normal)) < 0.1
    assert abs(height_above(plane, np.array([[0, 0, 0.8]]))[0]) < 3e-4
    with pytest.raises(ValueError, match="at least 100 points, found 3"):
        table_in(points[:3])


def test_false_matches_are_no_table():
    """What a stereo head makes of a table of one colour: depths of any size."""
    rng = np.random.default_rng(2)
    rays = np.column_stack([rng.uniform(-0.5, 0.5, (20000, 2)), np.ones(20000)])
    points = rays / rng.uniform(1 / 1.5, 1 / 0.4, (20000, 1))
    with pytest.raises(ValueError, match="25% or more .* 3% .a table without a pattern"):
        fit_support_plane(points, inlier_distance_m=0.004, rng=rng)
