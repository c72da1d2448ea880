"""`palpate noise` finds the noise that recordings were given: made ones, and the lab's."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import trimesh
from palpate.__main__ import main
from palpate.capture.poses import NUMBERS
from palpate.capture.tables import WRENCH_COLUMNS, write_table
from palpate.noise import measure
from palpate.yaml_files import load_yaml
from probe_motion import lab_film
from scipy.spatial.transform import Rotation

RATE_HZ, FRAMES, FORCE_HZ = 10, 24, 500
POSE_STD_M, POSE_STD_RAD, FORCE_STD_N, DRIFT_N = 8e-5, 2e-4, 0.02, np.array([0.0, 0.03, 0.06])
POINT_STD_M, ERROR_M, LENGTH_M = 4e-4, 3e-4, 0.009
TOLERANCE = 0.2
# The plate's pose, and the probe's target beside it, camera frame.
PLATE = np.eye(4)
PLATE[:3, :3] = Rotation.from_euler("xy", [150, 10], degrees=True).as_matrix()
PLATE[:3, 3] = 0.02, 0.01, 0.7
TARGET = np.eye(4)
TARGET[:3, 3] = 0.35, -0.3, 0.75


def surface_error(rng):
    """A smooth random field of which neighbours at a distance d share exp(-d^2 / 2 LENGTH_M^2)."""
    waves, phases = rng.normal(0, 1 / LENGTH_M, (2, 300)), rng.uniform(0, 2 * np.pi, 300)
    return lambda places: ERROR_M * np.sqrt(2 / 300) * np.cos(places @ waves + phases).sum(axis=1)


def record_clouds(folder, rng, moved=()):
    """The plate at rest, and then moved and measured with an error."""
    (folder / "cloud").mkdir(parents=True)
    grid, error = np.mgrid[-0.07:0.07:0.002, -0.07:0.07:0.002].reshape(2, -1).T, None
    error, rows = surface_error(rng), []
    for k, shift_m in enumerate(moved or np.zeros(FRAMES)):
        places = np.column_stack([grid, rng.normal(shift_m, POINT_STD_M, len(grid))])
        if shift_m:
            places[:, 2] += error(grid) + 0.01 * np.sin(k) * grid[:, 0]
        points = places @ PLATE[:3, :3].T + PLATE[:3, 3]
        trimesh.PointCloud(points).export(folder / f"cloud/{k:06d}.ply")
        rows.append({"frame": k, "time_s": k / RATE_HZ, "cloud": f"cloud/{k:06d}.ply"})
    write_table(folder / "frames.csv", pd.DataFrame(rows))


def record_rest(folder, sensor, rng):
    """Clouds of the plate at rest, poses of a tracker with their noise, and an unloaded force."""
    record_clouds(folder, rng)
    time_s = np.arange(-RATE_HZ, FRAMES + RATE_HZ) / RATE_HZ
    base = np.linalg.inv(np.array(sensor["base"]["camera_from_base"])) @ TARGET
    turns = Rotation.from_rotvec(rng.normal(0, POSE_STD_RAD, (len(time_s), 3)))
    quaternions = (turns * Rotation.from_matrix(base[:3, :3])).as_quat(scalar_first=True)
    shifts = base[:3, 3] + rng.normal(0, POSE_STD_M, (len(time_s), 3))
    poses = pd.DataFrame(np.column_stack([time_s, shifts, quaternions]), columns=NUMBERS)
    write_table(folder / "probe_poses.csv", poses)
    time_s = np.arange(0, FRAMES / RATE_HZ, 1 / FORCE_HZ)
    wrench = rng.normal(0, FORCE_STD_N, (len(time_s), 6)) + [0.3, -0.2, 0.5, 0, 0, 0]
    wrench[:, :3] += np.linspace(0, 1, len(time_s))[:, None] * DRIFT_N
    table = pd.DataFrame(wrench, columns=WRENCH_COLUMNS).assign(time_s=time_s)
    write_table(folder / "force.csv", table[["time_s", *WRENCH_COLUMNS]])


@pytest.fixture(scope="module")
def rig(root, tmp_path_factory):
    """A project with both recordings of a sensor of clouds."""
    folder, rng = tmp_path_factory.mktemp("rig"), np.random.default_rng(5)
    shutil.copytree(root / "config", folder / "config")
    text = (path := folder / "config/config.yaml").read_text()
    path.write_text(text.replace("reach_m: 0.1 ", "reach_m: 0.06 "))  # quick
    at = folder / "raw/sensors/kinect_cloud"
    record_rest(at / "rest", load_yaml(folder / "config/sensors/kinect_cloud.yaml"), rng)
    moved = [0.0] * 5 + [*np.linspace(0.002, 0.008, 8)]
    record_clouds(at / "plate", rng, moved)
    return folder


def test_finds_and_writes_what_was_put_in(rig, monkeypatch, capsys):
    monkeypatch.chdir(rig)
    path = rig / "config/sensors/kinect_cloud.yaml"
    before = path.read_text().splitlines()
    given = "kinect_cloud", "nano25_sphere", "--json", "--figure", "noise.svg", "--write"
    assert main(["noise", *given]) == 0
    shown = capsys.readouterr()
    found = {one["name"]: one for one in json.loads(shown.out)}
    expected = {f"f{k}, each sample": FORCE_STD_N for k in "xyz"}
    expected |= {"tracked pose (m)": POSE_STD_M, "tracked pose (rad)": POSE_STD_RAD}
    expected["force, drift in a capture"] = np.sqrt(np.mean(DRIFT_N**2))
    expected["displacement, error beyond noise"] = ERROR_M
    for name, value in expected.items():
        assert found[name]["value"] == pytest.approx(value, rel=TOLERANCE), name
    length_m = found["patch of alike errors"]["value"]
    assert length_m == pytest.approx(2 * np.sqrt(2) * LENGTH_M, rel=0.3)
    assert (rig / "noise.svg").stat().st_size > 10_000
    pairs = zip(before, path.read_text().splitlines(), strict=True)
    changed = [new.split(":")[0].strip() for old, new in pairs if old != new]
    assert changed == ["pose_std_m", "pose_std_rad"]
    assert load_yaml(path)["base"]["pose_std_m"] == pytest.approx(POSE_STD_M, rel=TOLERANCE)
    assert "direct.fit.rig.force_drift_std_n" in shown.err


def test_bad_recordings_are_one_line(rig, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(rig)
    record_clouds(tmp_path / "moving", np.random.default_rng(1), [0.0, 0.004, 0.006, 0.008])
    shutil.copytree(rig / "raw/sensors/kinect_cloud/rest", tmp_path / "short")
    force = pd.read_csv(tmp_path / "short/force.csv")
    write_table(tmp_path / "short/force.csv", force[force["time_s"] < 1.3])
    for sensor, given, words in (
        ("kinect_robot", (), "expected rest, plate or both in it, found neither"),
        ("kinect", ("--plate", tmp_path), "optics: expected results/sensors/kinect/calibration"),
        ("kinect_cloud", ("--plate", tmp_path / "moving"), "plate: expected it at rest"),
        ("kinect_cloud", ("--rest", tmp_path / "short"), "expected 2 s or more at rest"),
    ):
        assert main(["noise", sensor, "nano25_sphere", *map(str, given)]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert words in line


@pytest.mark.long
def test_finds_the_labs_noise(root, tmp_path, sensors, probe):
    """The force's by noise and steps of its volts, the displacement's by where the plate is."""
    sensor, still = sensors["kinect"], {"poses": 1, "hold_s": 2.2, "turn_s": 0, "tremor_deg": 0}
    lab_film(root, tmp_path / "load", sensor, probe, **still)
    away_m = np.array([0.75, 0.75, 0.75, 0.75, 0.747, 0.743, 0.741])
    lab_film(
        root, plate := tmp_path / "planes", sensor, None, frames=1, distances_m={"kinect": away_m}
    )
    rows = [pd.read_csv(path) for path in sorted(plate.glob("*/frames.csv"))]
    for k, row in enumerate(rows):
        row[["color", "depth"]] = f"{k + 1:02d}/" + row[["color", "depth"]]
        row[["frame", "time_s"]] = k, k / RATE_HZ
    write_table(plate / "frames.csv", pd.concat(rows))
    found = measure(sensor, probe, rest=tmp_path / "load", plate=plate)
    volts = np.hypot(load_yaml(root / "config/lab.yaml")["force"]["noise_v"], 20 / 4096 / 12**0.5)
    each_n = volts * np.linalg.norm(probe["gauge"]["calibration"], axis=1)
    for name, value in zip("xyz", each_n, strict=False):
        assert found[f"f{name}, each sample"].value == pytest.approx(value, rel=TOLERANCE)
    true_m = -found.surface.pose[2, 2] * (away_m[0] - away_m)
    error_m = (found.surface.motion.moved_m - true_m[:, None])[away_m < away_m[0]]
    expected = np.sqrt(np.nanmean(error_m**2))
    assert found["displacement, error in space"].value == pytest.approx(expected, rel=TOLERANCE)
