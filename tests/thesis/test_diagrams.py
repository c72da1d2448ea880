"""What chapter 4 and the explanatory figures show: instruments, thresholds, a box, views."""

import numpy as np
import open3d as o3d
import pandas as pd
import pytest
import trimesh
from palpate.capture.images import depth_of
from palpate.report.panels import Surface
from palpate.surface.template import Template, refine_template
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import Cloud
from palpate.vision.pose import MarkerPose, averages, select_threshold
from palpate.vision.probe import MARKER, QUATERNION, marker_from_tip
from scipy.spatial.transform import Rotation
from thesis.chapter3 import simplex
from thesis.chapter4 import normal_figure, pinhole_figure, rig, triangulation, workspace
from thesis.chapter4.box import outline_distance, place_box
from thesis.chapter5 import rigid_slide
from thesis.views import View, render_surface

WITHIN = {"largest_distance_m": 0.012, "largest_normal_deg": 60}


def test_moves_of_a_known_triangle():
    found = simplex.moves([[0, 0], [2, 0], [1, 2]])
    wanted = {"m": (1, 0), "r": (1, -2), "e": (1, -4), "c1": (1, 1), "c2": (1, -1)}
    for name, place in (wanted | {"s_g": (1, 0), "s_w": (0.5, 1)}).items():
        assert found[name] == pytest.approx(place)


def test_chain_ends_at_the_tip(probe):
    table = pd.DataFrame({"frame": [0, 1], "detected": [0, 1]})
    table[QUATERNION] = [0.19, -0.01, 0.02, np.sqrt(1 - 0.19**2 - 0.01**2 - 0.02**2)]
    table[MARKER] = [[0.0, 0.0, 0.5], [-0.07, -0.11, 0.53]]
    frames = rig.chain(table, probe)
    assert frames["marker"][:3, 3] == pytest.approx([-0.07, -0.11, 0.53])
    assert frames["tip"] == pytest.approx(frames["marker"] @ marker_from_tip(probe))
    with pytest.raises(ValueError, match="expected a frame with the marker, found none of 2"):
        rig.chain(table.assign(detected=0), probe)


def test_camera_stands_at_its_distance_and_sees_the_table(sensors, probe):
    pose = rig.camera_pose({"target_m": [0, 0, 0.09], "distance_m": 0.65, "elevation_deg": 45})
    assert pose[:3, :3].T @ pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
    assert [0, 0, 0.09] - pose[:3, 3] == pytest.approx(0.65 * pose[:3, 2])
    assert pose[2, 3] == pytest.approx(0.09 + 0.65 * np.sin(np.pi / 4))
    corners = rig.frustum(sensors["bumblebee"]["color"], pose, 0.7)
    assert corners[3:, 2] == pytest.approx(0, abs=1e-12)
    assert (corners[1:3] - pose[:3, 3]) @ pose[:3, 2] == pytest.approx(0.7)
    camera = {"width_px": 200, "fx_px": 100.0, "cx_px": 100.0}
    camera |= {"height_px": 100, "fy_px": 100.0, "cy_px": 0.0}
    assert rig.field_deg(camera) == pytest.approx((90, 45))
    assert rig.tilt_deg(probe) == pytest.approx(20, abs=1e-3)


@pytest.mark.parametrize("depth_m", [0.5, 0.85, 7.9])
def test_disparity_of_the_drawn_point_gives_its_depth(sensors, depth_m):
    spec = sensors["bumblebee"]
    shape = triangulation.triangle(spec["color"], spec["stereo"]["baseline_m"], depth_m)
    product = spec["color"]["fx_px"] * spec["stereo"]["baseline_m"]
    assert product / shape.disparity_px == pytest.approx(depth_m, rel=1e-12)
    camera = camera_from_spec(spec["color"])
    seen = camera.project([[shape.x_m, 0, depth_m], [shape.x_m - 0.12, 0, depth_m]])[:, 0]
    assert (shape.first_px, shape.second_px) == pytest.approx(tuple(seen), abs=1e-6)
    camera = camera_from_spec(sensors["kinect"]["color"] | {"distortion": [0.0] * 5})
    pixel, point = pinhole_figure.shown_point(camera, depth_m)
    assert camera.project(point)[0] == pytest.approx(pixel, abs=1e-6)
    assert point[2] == pytest.approx(depth_m)
    with pytest.raises(ValueError, match=r"depth_m: expected a positive length, found -\d"):
        triangulation.triangle(spec["color"], 0.1, -depth_m)


def test_counts_and_depth_are_the_sensors_own(sensors):
    spec = sensors["kinect"]["depth"]
    counts = np.arange(400, 1050)
    depth_m = depth_of(counts[None].astype(np.uint16), spec)[0]
    disparity = spec["fx_px"] * spec["baseline_m"] / depth_m
    assert triangulation.counts_of(spec, disparity) == pytest.approx(counts, rel=1e-5)


def test_drawn_normal_is_that_of_the_pipeline_and_of_the_nearest_plane():
    """Eq. 4.4: no other plane has a smaller sum of squares."""
    rng = np.random.default_rng(7)
    points = rng.uniform(-0.02, 0.02, (900, 3))
    points[:, 2] = 0.3 * points[:, 0] + 8 * points[:, 1] ** 2 + rng.normal(0, 2e-4, 900) + 0.6
    found = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    found.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(30))
    found.orient_normals_towards_camera_location(np.zeros(3))
    cloud = Cloud(np.asarray(found.points), np.asarray(found.normals))
    fit = normal_figure.fit_plane(cloud, np.array([0.01, -0.01, 0.6]), neighbours=30)
    assert fit.angle_deg < 1e-4
    for tilt in rng.normal(0, 0.02, (50, 3)):
        other = (fit.normal + tilt) / np.linalg.norm(fit.normal + tilt)
        height = (fit.neighbours_m - fit.centre_m) @ other
        assert (height**2).sum() >= (fit.height_m**2).sum()
    for neighbours in (2, 901):
        with pytest.raises(ValueError, match=rf"expected 3 to .* 900 .*found {neighbours}"):
            normal_figure.fit_plane(cloud, np.zeros(3), neighbours=neighbours)


def test_a_cloud_without_ends_slides_and_added_ends_hold_it():
    mesh, right = trimesh.creation.box((0.6, 0.15, 0.05)), np.eye(4)
    rough = Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    template = refine_template(rough, np.zeros(3), radius_m=1.0, edge_m=0.02)
    points, faces = trimesh.sample.sample_surface(mesh, 20000, seed=0)
    normals, x = mesh.face_normals[faces], points[:, 0]
    seen = (normals @ [0, -1, 1] > 0.5) & (x > -0.02) & (x < 0.27)
    start, left = rigid_slide.shifted(right, 0.01), []
    for kept in (seen, seen | (abs(normals[:, 0]) > 0.5)):
        found = rigid_slide.align_to_nearest(template, points[kept], normals[kept], start, **WITHIN)
        left.append(abs(rigid_slide.slide(found, right)))
    assert left[0] > 0.005
    assert left[1] < 0.5 * left[0]
    with pytest.raises(ValueError, match="cloud_m: expected points near the template"):
        rigid_slide.align_to_nearest(template, points + 1, normals, right, **WITHIN)


def test_picture_of_a_ball_covers_its_disc():
    frame = np.array([-80.0, 80, -80, 80])
    fine = trimesh.creation.icosphere(4, 0.06)
    picture = render_surface(fine.vertices, fine.faces, View(20, 30), frame, width_px=320)
    assert picture[..., 3].mean() * 160**2 == pytest.approx(np.pi * 60**2, rel=0.01)
    assert picture[160, 160, 3] == 1


def test_volume_and_displacement_of_a_squeezed_ball():
    mesh = trimesh.creation.icosphere(2, 0.06)
    moved = mesh.vertices * [1, 1, 0.9]
    ball = Surface(mesh.vertices, moved, mesh.faces, np.array([0, 0, 0.06]))
    assert ball.volume_change() == pytest.approx(-0.1)
    assert ball.displacement_mm().max() == pytest.approx(6)


ANGLES = {0.05: 9e-3, 0.10: 4e-3, 0.15: 2.02e-3, 0.20: 2.0e-3, 0.25: 2.3e-3}


def rows(found=100):
    """Two points at five thresholds and refined; the two lowest find part of the frames."""
    shared = {"frames": 100, "inliers": 11.0, "reprojection_error_px2": 0.02, "farthest_m": 0.003}
    shared |= {"mean_x_m": 0.1, "mean_y_m": 0.0, "mean_z_m": 0.7, "method": "corners"}
    table = [
        shared | {"threshold_px": threshold, "std_angle_rad": angle}
        | {f"std_{axis}_m": angle / (k + 10) for k, axis in enumerate("xyz")}
        | {"found": found if threshold < 0.12 else 100}
        for threshold, angle in ANGLES.items()
    ]  # fmt: skip
    refined = {"method": "photometric", "threshold_px": np.nan, "std_angle_rad": 1e-4, "found": 100}
    table.append(shared | refined | {f"std_{axis}_m": 1e-5 for axis in "xyz"})
    return pd.concat([pd.DataFrame(table).assign(point=point) for point in ("01", "02")])


def test_the_smallest_of_the_equally_good_thresholds_that_lose_no_frames_is_selected():
    assert select_threshold(rows()) == 0.15
    table = rows(found=90)
    assert select_threshold(table[table["threshold_px"] != 0.15]) == 0.20
    assert set(averages(table).query("found < 0.99").index) == {0.05, 0.10}
    with pytest.raises(ValueError, match="a pose in 99% of the frames, found at most 90%"):
        select_threshold(table[table["threshold_px"] < 0.12])


def test_table_4_2_is_in_centimetres_beside_the_published():
    published = pd.DataFrame({"axis": list("xyz"), "kinect_cm": [0.0033, 0.0012, 0.0168]})
    table = workspace.table_4_2({"kinect": rows()}, {"kinect": 0.45}, published)
    assert table["std_cm"].tolist() == pytest.approx([0.0202, 0.01836, 0.01683], abs=1e-5)
    assert table["refined_std_cm"].tolist() == pytest.approx([0.001] * 3)
    assert table["published_std_cm"].tolist() == [0.0033, 0.0012, 0.0168]
    assert table["points"].tolist() == [2, 2, 2]


def test_a_points_row():
    pose = np.eye(4)
    pose[:3, 3] = [0, 0, 0.7]
    other = pose.copy()
    other[2, 3] += 2e-3
    poses = [MarkerPose(p, np.eye(6), 12, 0.1) for p in (pose, other)]
    row = workspace.point_row([*poses, None], np.eye(4))
    assert (row["frames"], row["found"], row["inliers"]) == (3, 2, 12)
    assert row["std_z_m"] == pytest.approx(1e-3)
    assert row["farthest_m"] == pytest.approx(1e-3)
    assert row["reprojection_error_px2"] == pytest.approx(0.12)
    assert workspace.point_row([None], np.eye(4)) == {"frames": 1, "found": 0}


SIZE = np.array([0.142, 0.124, 0.0104])


@pytest.fixture(scope="module")
def scene():
    """Top and front of a box and the table, dense near the camera, camera frame."""
    rng = np.random.default_rng(2)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [-2.2, 0.05, 0.3]).as_matrix()
    pose[:3, 3] = [0.03, 0.05, 0.6]
    x = rng.uniform(-0.071, 0.071, 14000)
    y = 0.124 * rng.beta(1.0, 1.4, 14000) - 0.062
    top = np.column_stack([x, y, np.full(14000, SIZE[2])])
    front = np.column_stack([x[:900], np.full(900, -0.062), rng.uniform(0, SIZE[2], 900)])
    ground = np.column_stack([rng.uniform(-0.2, 0.2, (20000, 2)), np.zeros(20000)])
    ground = ground[outline_distance(ground[:, :2], SIZE) > 0]
    points = np.concatenate([top, front, ground]) + rng.normal(0, 4e-4, (len(ground) + 14900, 3))
    hidden = np.hypot(points[:, 0] - 0.02, points[:, 1] - 0.04) < 0.012
    stray = rng.uniform(-0.1, 0.1, (60, 3)) * [1, 1, 0.1] + [0, 0, 0.02]
    points = np.concatenate([points[~hidden], stray]) @ pose[:3, :3].T + pose[:3, 3]
    return points, np.append(pose[:3, 2], -pose[:3, 2] @ pose[:3, 3]), pose


def test_the_box_is_laid_where_it_stands(scene):
    points, plane, pose = scene
    apart = np.linalg.inv(pose) @ place_box(points, plane, SIZE)
    assert np.linalg.norm(apart[:3, 3]) < 4e-4
    assert np.degrees(np.arcsin(np.abs(apart[0, 1]))) < 0.2
    assert apart[:3, :3] @ apart[:3, :3].T == pytest.approx(np.eye(3))


def test_another_box_or_one_seen_in_part(scene):
    points, plane, pose = scene
    y = (points - pose[:3, 3]) @ pose[:3, 1]
    for size, seen_to_m, line in (
        ((0.1, 0.1, 0.05), np.inf, "at least 200 points 50 mm above the table, found"),
        ((0.124, 0.142, 0.0104), np.inf, "expected length >= width, found 0.124, 0.142 m"),
        ((0.06, 0.06, 0.0104), np.inf, "differs from it in"),
        (SIZE, 0.025, "differs from it in"),
    ):
        with pytest.raises(ValueError, match=line):
            place_box(points[y < seen_to_m], plane, size)
