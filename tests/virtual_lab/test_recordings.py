"""What the lab records, at a small size: captures, calibration, grids, traces, and their seeds."""

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import read_image
from palpate.vision.camera import camera_from_spec
from virtual_lab.load_steps import mirrored, read_load_steps, write_load_steps
from virtual_lab.record import record_capture, with_motion
from virtual_lab.rig import bare_bench, make_rig, object_bench
from virtual_lab.rig_errors import errors_of
from virtual_lab.sensor_experiments import outline_path, record_calibration, record_workspace

R = 0.00622


@pytest.fixture
def recorded(common, spec, bench, steps, half, probe, tmp_path):
    """A small capture of the Kinect: its folder and its truth."""

    def record(name, motion, *, seed=2, **more):
        place = errors_of(common, spec, half["kinect"]), spec["cameras"]["kinect"], bench
        ours = with_motion(spec, {"frame_rate_hz": 1, "tilt_deg": 4.0} | motion)
        jolted = {key: make_rig(common, *place, **value) for key, value in more.items()}
        (tmp_path / name).mkdir()
        rig, given = make_rig(common, *place), {"seed": [1, seed]} | jolted
        return tmp_path / name, record_capture(tmp_path / name, rig, steps, ours, probe, **given)

    return record


def files_of(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_the_operators_arm_is_in_the_picture_where_the_motion_has_one(recorded):
    seen = [
        np.unpackbits(recorded(name, {"frames": 1} | more)[1]["mask"]).sum()
        for name, more in (("bare", {}), ("arm", {"elbow_m": [0.3, -0.05, -0.2]}))
    ]
    assert seen[1] > 1.2 * seen[0]


def test_a_jolted_camera_records_on_from_beside(recorded, common, spec, bench, half):
    """From the second of three frames; where the table lies then follows from the two poses."""
    shift = {"jolted_m": np.array([0.004, 0.0, 0.0])}
    folder, _ = recorded("jolted", {"frames": 3}, jolted=shift)
    files = sorted((folder / "color").iterdir())
    table = [read_image(file, "mono8")[160:].astype(float) for file in files]
    window = cv2.createHanningWindow(table[0].shape[::-1], cv2.CV_64F)
    moved_px = [cv2.phaseCorrelate(table[0], now, window)[0] for now in table[1:]]
    place = errors_of(common, spec, half["kinect"]), spec["cameras"]["kinect"], bench
    before, after = (make_rig(common, *place, **more).reference for more in ({}, shift))
    middle_px = np.array([[159.5, 199.5]])
    origin_m, ray = before.rays(middle_px)
    on_table = origin_m - ray * origin_m[2] / ray[0, 2]
    expected = (after.camera.project(after.local(on_table)) - middle_px)[0]
    assert np.allclose(moved_px, [expected] * 2, atol=0.1)


def test_a_plain_table_is_bare_and_of_one_colour(common, spec):
    small = spec | {"shape": {"kind": "block", "size_m": [0.05, 0.05, 0.05]}}
    wood = object_bench(common, small, name="foam_block")
    plain = object_bench(common, small | {"table": "plain"}, name="foam_block")
    assert np.ptp(wood.table, axis=(0, 1)).min() > 0.1 and wood.props
    assert not np.ptp(plain.table, axis=(0, 1)).any() and not plain.props


@pytest.mark.long
def test_a_capture_is_the_same_for_the_same_seed_alone(recorded, common):
    (one, truth), (same, _), (other, others) = (
        recorded(str(k), {"frames": 2}, seed=seed) for k, seed in enumerate((2, 2, 3))
    )
    assert files_of(one) == files_of(same)
    assert files_of(one).keys() == files_of(other).keys() and files_of(one) != files_of(other)
    # Motion and noise differ, the object's mechanics do not.
    assert np.array_equal(truth["surface_rest_m"], others["surface_rest_m"])
    assert not np.array_equal(truth["tip_m"], others["tip_m"])
    assert abs(truth["clock_offset_s"]) <= common["timing"]["clock_offset_s"]


def test_calibration_pairs_show_the_target_to_both_cameras(lab, common, sensors, tmp_path):
    options = lab["experiments"]["calibration"] | {"pairs": 3}
    errors = errors_of(common, {}, sensors["kinect"])
    rig = make_rig(common, errors, options["camera"], bare_bench(common, name="c"))
    truth = record_calibration(tmp_path, rig, options, None, seed=[1])
    columns, rows, square_m = pd.read_csv(tmp_path / "board.csv").iloc[0]
    size = int(columns), int(rows)
    assert size == (9, 6)
    camera = camera_from_spec(sensors["kinect"]["color"])
    y, x = np.mgrid[: size[1], : size[0]] * square_m
    corners = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    for k, pose in enumerate(truth["camera_from_board"]):
        expected = camera.project(corners @ pose[:3, :3].T + pose[:3, 3])
        for stream in ("color", "infrared"):
            image = read_image(tmp_path / stream / f"{k:06d}.png", "mono8")
            found, points = cv2.findChessboardCornersSB(image, size)
            assert found
            if stream == "color":
                ways = (points.reshape(-1, 2)[::step] - expected for step in (1, -1))
                assert min(np.linalg.norm(way, axis=1).mean() for way in ways) < 0.15


def test_the_workspaces_grid(lab, common, half, probe, tmp_path):
    options = lab["experiments"]["workspace"] | {"columns": 2, "rows": 1, "frames": 2}
    errors = errors_of(common, {}, half["bumblebee"])
    rig = make_rig(common, errors, options["camera"], bare_bench(common, name="w"))
    truth = record_workspace(tmp_path, rig, options, probe, seed=[1])
    grid = pd.read_csv(tmp_path / "grid.csv")
    assert grid[["row", "column"]].to_numpy().tolist() == [[1, 1], [1, 2]]
    assert np.linalg.norm(np.diff(truth["tip_m"], axis=0)) == pytest.approx(options["step_m"])
    images = [(tmp_path / "01/left" / f"00000{k}.png").read_bytes() for k in range(2)]
    assert images[0] != images[1]


def test_the_outline_of_the_case_is_a_radius_away_from_it():
    size = np.array([0.142, 0.124, 0.0104])
    path = outline_path(size, R, np.linspace(0, 1, 500))
    outside = np.maximum(np.abs(path[:, :2]) - size[:2] / 2, 0)
    assert np.linalg.norm(outside, axis=1) == pytest.approx(R, abs=2e-5)
    assert np.allclose(path[0], path[-1])
    assert set(path[:, 2]) == {R}


def test_load_steps_of_a_mirror_image(steps, tmp_path):
    write_load_steps(tmp_path / "steps.npz", steps)
    other = mirrored(read_load_steps(tmp_path / "steps.npz"), np.array([0.05, 0.0, 0.0475]))
    assert other.point_m.tolist() == [0.05, 0.0, 0.0475]
    assert other.force_at([0.004]) == pytest.approx(200 * 0.004**1.5, rel=1e-6)
    moved = np.abs(other.surface_at([0.009])[0] - other.surface_rest_m).max(axis=1)
    assert other.surface_rest_m[moved.argmax(), 0] > 0
    with pytest.raises(ValueError, match="point: expected a mirror image"):
        mirrored(steps, np.array([0.15, 0.0, 0.0475]))
    with pytest.raises(ValueError, match=r"depth: expected at most 0.0090 m, found 0.0100 m"):
        steps.force_at([0.01])
