"""A capture of clouds is worked out as one of depth images, from wherever the camera stands."""

import shutil

import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import write_image
from palpate.capture.tables import write_frames
from palpate.open3d_core import o3d
from palpate.vision.camera import PinholeCamera, camera_block, pixel_rays
from palpate.vision.clouds import Reach, clouds_of, scene_points, table_of
from palpate.vision.options import Clouds, SupportPlane
from palpate.vision.probe import AXIS, TIP
from palpate.vision.support_plane import fit_support_plane
from scipy.spatial import cKDTree

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
        points = scene_points({"depth": counts}, DEPTH) @ turn.T + eye
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
    points = scene_points({"depth": scene(OBJECT)[0]}, DEPTH)
    both = np.concatenate([points, 1.5 * points[::2]])
    with pytest.raises(ValueError, match="one 0.300 m below it .*which is the table.*a background"):
        fit_support_plane(both, inlier_distance_m=0.004, rng=np.random.default_rng(0), empty=False)
