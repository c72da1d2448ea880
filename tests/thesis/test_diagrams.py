"""What chapter 4 shows: thresholds, the workspace, a box, a sliding template."""

import numpy as np
import pandas as pd
import pytest
import trimesh
from palpate.report.panels import Surface
from palpate.surface.template import Template, refine_template
from palpate.vision.pose import MarkerPose, averages, select_threshold
from scipy.spatial.transform import Rotation
from thesis.chapter4 import workspace
from thesis.chapter4.probe_tests import outline_distance, place_box
from thesis.chapter5 import rigid_slide

WITHIN = {"largest_distance_m": 0.012, "largest_normal_deg": 60}


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
