"""What the lab records, at a small size: motion, boards, grids, traces, and their seeds."""

import hashlib

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.images import read_image
from palpate.vision.camera import camera_from_spec
from virtual_lab.calibration import record_calibration
from virtual_lab.device import device_of
from virtual_lab.experiments import outline_path, record_workspace
from virtual_lab.ladder import ContactLadder, load_ladder, mirrored, save_ladder
from virtual_lab.motion import Hand
from virtual_lab.record import FACING, record_capture, with_motion
from virtual_lab.rig import bare_bench, make_rig, object_bench
from virtual_lab.seeds import seed_of
from virtual_lab.shapes import shape_of

R = 0.00622
MOTION = {
    "rest_s": 0.5,
    "approach_s": 0.6,
    "press_s": 1.8,
    "approach_m": 0.015,
    "depth_m": 0.008,
    "pace_spread": 0.0,
    "depth_spread": 0.0,
    "tilt_deg": 4.0,
    "tilt_tremor_deg": 0.25,
    "depth_tremor_m": 3e-5,
    "lateral_tremor_m": 6e-4,
}


@pytest.fixture(scope="module")
def lab(root):
    spec = yaml.safe_load((root / "config/lab.yaml").read_text())
    common = {key: spec[key] for key in spec if key not in ("objects", "experiments")}
    return common, spec["objects"]["foam_block"], spec["experiments"]


@pytest.fixture(scope="module")
def steps(lab):
    """A made-up dent: the recordings need no mechanics here."""
    rest, faces = shape_of(lab[1]).surface()
    point = np.array([-0.05, 0.0, 0.0475])
    depth = np.linspace(0, 0.009, 10)
    dent = np.exp(-(((rest - point) / 0.03) ** 2).sum(axis=1))
    fields = -depth[:, None, None] * dent[None, :, None] * [0, 0, 1]
    return ContactLadder(point, depth, 200 * depth**1.5, rest, faces, fields)


def half_size(sensor):
    """The same device with a quarter of the pixels."""
    small = dict(sensor)
    for block in ("color", "depth"):
        if block in small:
            halved = {k: small[block][k] / 2 for k in ("fx_px", "fy_px", "cx_px", "cy_px")}
            size = {k: small[block][k] // 2 for k in ("width_px", "height_px")}
            small[block] = small[block] | halved | size
    return small


def digest(folder):
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    return hashlib.sha256(b"".join(p.read_bytes() for p in files)).hexdigest(), len(files)


def test_motion_is_smooth_and_touches_at_the_point():
    point = np.array([-0.05, 0, 0.0475])
    hand = Hand(
        MOTION,
        point_m=point,
        radius_m=R,
        facing=FACING,
        rng=np.random.default_rng(1),
    )
    time_s = np.arange(0, 4, 0.001)
    path = hand.at(time_s)
    assert path.depth_m[0] == pytest.approx(-0.015)
    assert path.depth_m.max() == pytest.approx(0.008, abs=2e-4)
    assert np.abs(np.diff(path.tip_m, axis=0)).max() < 0.06 * 0.001 * 2
    touching = path.depth_m >= 0
    sideways = path.tip_m[touching, :2] - point[:2]
    assert np.abs(sideways).max() < 1e-9
    lowest = path.tip_m[:, 2] - R
    assert np.allclose(point[2] - lowest, path.depth_m)
    turns = path.object_from_force
    assert np.allclose(np.linalg.det(turns), 1)
    tilt = np.degrees(np.arccos(-turns[:, 2, 2]))
    assert tilt.max() < 8


def test_two_hands_differ_in_pace_and_depth():
    options = MOTION | {"pace_spread": 0.15, "depth_spread": 0.08}
    deepest = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        hand = Hand(options, point_m=np.zeros(3), radius_m=R, facing=FACING, rng=rng)
        deepest.append(hand.at(np.arange(0, 4, 0.01)).depth_m.max())
    assert 0.006 < min(deepest) < max(deepest) < 0.0092
    assert np.ptp(deepest) > 2e-4


def test_an_arm_holds_the_probe_where_the_motion_says_so(lab, steps, sensors, probe, tmp_path):
    common, spec, _ = lab
    sensor = half_size(sensors["kinect"])
    bench = object_bench(common, spec, name="foam_block")
    rig = make_rig(common, device_of(common, spec, sensor), spec["cameras"]["kinect"], bench)
    seen = []
    for name, more in (("bare", {}), ("held", {"elbow_m": [0.3, -0.05, -0.2]})):
        motion = with_motion(spec, {"frames": 1, "frame_rate_hz": 1} | more)
        (tmp_path / name).mkdir()
        truth = record_capture(tmp_path / name, rig, steps, common, motion, probe, seed=[1, 2])
        seen.append(np.unpackbits(truth["mask"]).sum())
    assert seen[1] > 1.2 * seen[0]


def test_a_jolted_camera_films_on_from_beside(lab, steps, sensors, probe, tmp_path):
    """From the second of three frames; where the table lies then follows from the two poses."""
    common, spec, _ = lab
    device = device_of(common, spec, half_size(sensors["kinect"]))
    stand = device, spec["cameras"]["kinect"], object_bench(common, spec, name="foam_block")
    motion = with_motion(spec, {"frames": 3, "frame_rate_hz": 1})
    jolt_m = np.array([0.004, 0.0, 0.0])
    rig, jolted = make_rig(common, *stand), make_rig(common, *stand, jolted_m=jolt_m)
    record_capture(tmp_path, rig, steps, common, motion, probe, seed=[1, 2], jolted=jolted)
    files = sorted((tmp_path / "color").iterdir())
    table = [read_image(file, "mono8")[160:].astype(float) for file in files]
    window = cv2.createHanningWindow(table[0].shape[::-1], cv2.CV_64F)
    moved_px = [cv2.phaseCorrelate(table[0], now, window)[0] for now in table[1:]]
    middle_px = np.array([[159.5, 199.5]])
    eye_m, ray = rig.reference.rays(middle_px)
    on_table = np.append(eye_m - ray[0] * eye_m[2] / ray[0, 2], 1)
    view = jolted.reference
    there_px = view.camera.project((view.camera_from_object @ on_table)[None, :3])
    expected = (there_px - middle_px)[0]
    assert np.allclose(moved_px, [expected] * 2, atol=0.1)


def test_a_plain_table_is_bare_and_of_one_colour(lab):
    common, spec, _ = lab
    small = spec | {"shape": {"kind": "block", "size_m": [0.05, 0.05, 0.05]}}
    wood = object_bench(common, small, name="foam_block")
    plain = object_bench(common, small | {"table": "plain"}, name="foam_block")
    assert np.ptp(wood.table, axis=(0, 1)).min() > 0.1
    assert wood.props
    assert not np.ptp(plain.table, axis=(0, 1)).any()
    assert not plain.props


@pytest.mark.long
def test_a_capture_is_the_same_for_the_same_seed_alone(lab, steps, sensors, probe, tmp_path):
    common, spec, _ = lab
    spec = with_motion(spec, {"frames": 2, "frame_rate_hz": 1})
    sensor = half_size(sensors["kinect"])
    bench = object_bench(common, spec, name="foam_block")
    rig = make_rig(common, device_of(common, spec, sensor), spec["cameras"]["kinect"], bench)
    truths, sums = [], []
    for number, seed in enumerate(([1, 2], [1, 2], [1, 3])):
        folder = tmp_path / str(number)
        folder.mkdir()
        truths.append(record_capture(folder, rig, steps, common, spec, probe, seed=seed))
        sums.append(digest(folder))
    assert sums[0] == sums[1]
    assert sums[0][1] == sums[2][1] == 6
    assert sums[0][0] != sums[2][0]
    # The hand and the noise differ, the object's mechanics do not.
    assert np.array_equal(truths[0]["surface_rest_m"], truths[2]["surface_rest_m"])
    assert not np.array_equal(truths[0]["tip_m"], truths[2]["tip_m"])
    assert abs(truths[0]["clock_offset_s"]) <= common["timing"]["clock_offset_s"]


def test_calibration_pairs_show_the_board_to_both_cameras(lab, sensors, tmp_path):
    common, _, experiments = lab
    options = experiments["calibration"] | {"pairs": 3}
    device = device_of(common, {}, sensors["kinect"])
    rig = make_rig(common, device, options["camera"], bare_bench(common, name="c"))
    seed = seed_of(common, "test")
    truth = record_calibration(tmp_path, rig, common, options, None, seed=seed)
    board = pd.read_csv(tmp_path / "board.csv").iloc[0]
    size = (int(board["columns"]), int(board["rows"]))
    assert size == (9, 6)
    camera = camera_from_spec(sensors["kinect"]["color"])
    y, x = np.mgrid[: size[1], : size[0]] * board["square_m"]
    corners = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    for k, pose in enumerate(truth["camera_from_board"]):
        expected = camera.project(corners @ pose[:3, :3].T + pose[:3, 3])
        for stream in ("color", "infrared"):
            image = read_image(tmp_path / stream / f"{k:06d}.png", "mono8")
            found, points = cv2.findChessboardCornersSB(image, size)
            points = points.reshape(-1, 2)
            assert found
            if stream == "color":
                away = np.linalg.norm(points - expected, axis=1)
                back = np.linalg.norm(points[::-1] - expected, axis=1)
                assert min(away.mean(), back.mean()) < 0.15


def test_the_workspaces_grid(lab, sensors, probe, tmp_path):
    common, _, experiments = lab
    options = experiments["workspace"] | {"columns": 2, "rows": 1, "frames": 2}
    device = device_of(common, {}, half_size(sensors["bumblebee"]))
    rig = make_rig(common, device, options["camera"], bare_bench(common, name="w"))
    truth = record_workspace(tmp_path, rig, common, options, probe, seed=[1])
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


def test_the_real_board_is_a_little_off(lab, sensors, probe):
    options = lab[0]["probe_error"]
    device = device_of(lab[0], {}, sensors["kinect"])
    real = np.array(device.probe(probe)["marker_from_force"])
    error = np.linalg.inv(np.array(probe["marker_from_force"])) @ real
    assert 0 < np.linalg.norm(error[:3, 3]) < 4 * options["shift_m"]
    angle = np.degrees(np.arccos((np.trace(error[:3, :3]) - 1) / 2))
    assert 0 < angle < 4 * options["angle_deg"]


def test_a_mirrored_ladder(steps, tmp_path):
    save_ladder(tmp_path / "ladder.npz", steps)
    other = mirrored(load_ladder(tmp_path / "ladder.npz"), np.array([0.05, 0.0, 0.0475]))
    assert other.point_m.tolist() == [0.05, 0.0, 0.0475]
    assert other.force_at([0.004]) == pytest.approx(200 * 0.004**1.5, rel=1e-6)
    moved = np.abs(other.surface_at([0.009])[0] - other.surface_rest_m).max(axis=1)
    assert other.surface_rest_m[moved.argmax(), 0] > 0
    with pytest.raises(ValueError, match="point: expected a mirror image"):
        mirrored(steps, np.array([0.15, 0.0, 0.0475]))
    with pytest.raises(ValueError, match=r"depth: expected at most 0.0090 m, found 0.0100 m"):
        steps.force_at([0.01])
