"""`palpate calibrate load` on a table, and on a film with its record of forces."""

import json

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.force_record import WRENCH_COLUMNS
from palpate.capture.tables import write_table
from palpate.vision.camera import camera_from_spec
from palpate.vision.indentation import weight_wrenches
from palpate.vision.marker import board_of
from palpate.vision.probe import marker_columns
from palpate.vision.rests import find_rests
from printed_boards import noisy, picture
from scipy.spatial.transform import Rotation
from turned_handle import held_free

PART = "load"

UP = np.array([0.0, -0.8, -0.6])
LOAD = {"mass_kg": 0.0304, "centre_of_mass_m": [0.0005, 0.0, 0.0365]}
BIAS = np.array([1.2, -2.0, 4.0, 0.05, -0.03, 0.02])
NOISE = np.repeat([1e-3, 1e-5], 3)
VERTICAL = ("--up", *map(str, UP))


def wrenches(poses, probe):
    turn = np.array(probe["marker_from_force"])[:3, :3]
    return weight_wrenches(poses[:, :3, :3] @ turn, UP, LOAD) + BIAS


@pytest.fixture
def table(tmp_path, probe):
    path, poses = tmp_path / "poses.csv", held_free()
    noisy = wrenches(poses, probe) + NOISE * np.random.default_rng(0).standard_normal((12, 6))
    rows = marker_columns(poses).join(pd.DataFrame(noisy, columns=list(WRENCH_COLUMNS)))
    write_table(path, rows)
    return path


def test_a_table(table, given, tmp_path, root, probe):
    out = tmp_path / "load.json"
    file = root / "config/probes/nano25_sphere.yaml"
    text = given(table, *VERTICAL, "--board", file, "--output", out)
    assert "mass: told, to" in text and "rotation: told, to" in text
    blocks = yaml.safe_load(text[text.index("\nload:") : text.index("written")])
    assert blocks["load"]["mass_kg"] == pytest.approx(LOAD["mass_kg"], abs=3e-4)
    np.testing.assert_allclose(
        blocks["load"]["centre_of_mass_m"], LOAD["centre_of_mass_m"], atol=3e-4
    )
    turn, typed = np.array(blocks["marker_from_force"]), np.array(probe["marker_from_force"])
    np.testing.assert_allclose(turn, typed, atol=5e-3)
    np.testing.assert_allclose(turn[:, 3], typed[:, 3])
    found = json.loads(out.read_text())
    assert found["probe"] == "nano25_sphere"
    variance = np.array(found["covariance"])
    assert blocks["load"]["mass_std_kg"] == pytest.approx(np.sqrt(variance[0, 0]), rel=0.05)
    worst = np.sqrt(np.linalg.eigvalsh(variance[1:4, 1:4])[-1])
    # A table is level to half a degree, all as likely; poses do not tell what it is.
    level = np.radians(0.5) / np.sqrt(3)
    assert worst < level / 3
    assert found["axes_std_rad"] == pytest.approx(np.hypot(worst, level), rel=1e-9)
    assert blocks["axes_std_rad"] == pytest.approx(found["axes_std_rad"], rel=0.02)
    assert len(found["unknowns"]) == len(found["covariance"]) == 13


def test_a_row_that_is_touched(table, given, tmp_path):
    rows, out = pd.read_csv(table), tmp_path / "load.json"
    rows.loc[4, "fx_n"] += 0.1
    write_table(table, rows)
    text = given(table, *VERTICAL, "--output", out)
    assert "12 poses, 11 count" in text
    assert "\n  left out: row 5: 1" in text
    found = json.loads(out.read_text())
    assert found["poses"] == 12
    assert list(found["left_out_n_nm"]) == ["row 5"]
    assert found["left_out_n_nm"]["row 5"][0] > 0.1


def test_a_sensor_whose_place_is_not_known_yet(table, given):
    text = given(table, *VERTICAL)
    rows = yaml.safe_load(text[text.index("\nload:") :])["marker_from_force"]
    assert [row[3] for row in rows] == ["FILL_IN"] * 3 + [1.0]


def test_the_tables_plane_is_a_vertical(table, given, tmp_path):
    plane = tmp_path / "support_plane.json"
    plane.write_text(json.dumps({"normal": UP.tolist(), "offset_m": 0.8}))
    assert given(table, "--plane", plane) == given(table, *VERTICAL)


def test_rests_of_a_film(probe):
    """Held for two seconds each, and turned within one; what is turned tells nothing."""
    poses, rng = held_free(8), np.random.default_rng(2)
    turns = Rotation.from_matrix(poses[:, :3, :3])
    time_s = np.arange(0, 24, 1 / 10)
    place = np.minimum(time_s // 3, 7).astype(int)
    part = np.clip(time_s - 3 * place - 2, 0, 1)
    after = turns[np.minimum(place + 1, 7)]
    way = turns[place] * Rotation.from_rotvec(
        part[:, None] * (turns[place].inv() * after).as_rotvec()
    )
    seen = Rotation.from_rotvec(rng.normal(0, 2e-3, (len(time_s), 3))) * way
    samples_s = np.arange(-0.1, 24.1, 1e-3)
    nearest = np.clip((samples_s * 10).round().astype(int), 0, len(time_s) - 1)
    clean = wrenches(way.as_matrix(), probe)[nearest]
    record = clean + np.repeat([0.03, 3e-4], 3) * rng.standard_normal(clean.shape)
    frames = np.arange(len(time_s))
    found = find_rests(frames, time_s, seen.as_matrix(), samples_s, record)
    # The last pose is held to the end.
    assert len(found.names) == 8
    np.testing.assert_allclose(found.wrench[:7], wrenches(poses, probe)[:7], atol=0.01)
    off = (found.wrench[:7] - wrenches(poses, probe)[:7]) / found.noise
    assert off.std() == pytest.approx(1, abs=0.4)


def test_a_hand_that_never_rests():
    turns = Rotation.from_rotvec(np.linspace(0, 6, 60)[:, None] * [1.0, 0, 0]).as_matrix()
    time_s = np.arange(60) / 10
    with pytest.raises(ValueError, match="expected the probe to be held still for 1 s"):
        find_rests(np.arange(60), time_s, turns, np.arange(6000) / 1e3, np.zeros((6000, 6)))


def test_a_film(tmp_path, given, root, probe):
    """Six poses of a second and a half, by a stereo head with its noise."""
    sensor = root / "tests/sample/sensors/bumblebee.yaml"
    spec = yaml.safe_load(sensor.read_text())
    camera, baseline_m = camera_from_spec(spec["color"]), spec["stereo"]["baseline_m"]
    board, rng = board_of(probe["marker"]), np.random.default_rng(4)
    way = np.arange(6) * np.pi / 3
    spin = 0.5 * (-1.0) ** np.arange(6)
    lean = np.deg2rad(35) * np.column_stack([np.cos(way), np.sin(way), spin])
    poses = np.tile(np.eye(4), (6, 1, 1))
    poses[:, :3, :3] = Rotation.from_rotvec(lean).as_matrix()
    poses[:, :3, 3] = [-0.03, -0.02, 0.5]
    shifts = {"left": 0.0, "right": baseline_m}
    rows = []
    for k, pose in enumerate(poses):
        for side, shift_m in shifts.items():
            (tmp_path / side).mkdir(exist_ok=True)
            seen = pose.copy()
            seen[0, 3] -= shift_m
            clean = picture(board, seen, camera)
            for j in range(12 * k, 12 * k + 12):
                cv2.imwrite(str(tmp_path / side / f"{j:06d}.png"), noisy(clean, rng))
        rows += [
            {"frame": j, "time_s": j / 8} | {side: f"{side}/{j:06d}.png" for side in shifts}
            for j in range(12 * k, 12 * k + 12)
        ]
    write_table(tmp_path / "frames.csv", pd.DataFrame(rows))
    time_s = np.arange(-0.2, 9.2, 1e-3)
    clean = wrenches(poses, probe)[np.clip(time_s / 1.5, 0, 5).astype(int)]
    noise = np.repeat([0.02, 2e-4], 3) * rng.standard_normal(clean.shape)
    record = pd.DataFrame(clean + noise, columns=list(WRENCH_COLUMNS))
    write_table(tmp_path / "force.csv", pd.DataFrame({"time_s": time_s}).join(record))
    text = given(
        tmp_path,
        *VERTICAL,
        "--sensor",
        sensor,
        "--board",
        root / "config/probes/nano25_sphere.yaml",
        "--output",
        tmp_path / "load.json",
    )
    assert ": 6 poses" in text
    found = json.loads((tmp_path / "load.json").read_text())
    assert found["mass_kg"] == pytest.approx(LOAD["mass_kg"], abs=1e-3)
    np.testing.assert_allclose(found["centre_of_mass_m"], LOAD["centre_of_mass_m"], atol=1e-3)
    typed = np.array(probe["marker_from_force"])[:3, :3]
    turn = np.array(found["marker_from_force_rotation"]).T @ typed
    assert np.degrees(Rotation.from_matrix(turn).magnitude()) < 1


def test_a_film_without_the_board(refused, root):
    folder = root / "tests/sample/raw/foam_block/bumblebee/background"
    files = (
        "--sensor",
        root / "tests/sample/sensors/bumblebee.yaml",
        "--board",
        root / "config/probes/nano25_sphere.yaml",
    )
    assert "background: marker: expected its corners" in refused(folder, *VERTICAL, *files)


def test_a_press_is_no_load(refused, root):
    folder = root / "tests/sample/raw/foam_block/bumblebee/08"
    files = (
        "--sensor",
        root / "tests/sample/sensors/bumblebee.yaml",
        "--board",
        root / "config/probes/nano25_sphere.yaml",
    )
    assert "at least 6, found" in refused(folder, *VERTICAL, *files)


def test_what_is_not_given(table, refused, tmp_path):
    assert "--up: expected it or --plane, found none" in refused(table)
    assert "--plane, found both" in refused(table, *VERTICAL, "--plane", tmp_path)
    assert "found nothing at" in refused(table, "--plane", tmp_path / "plane.json")
    assert "--up: expected a direction" in refused(table, "--up", "0", "0", "0")
    assert "frames.csv: expected a film's, found none" in refused(tmp_path)
    assert "none: source: expected a film or a table, found none" in refused(tmp_path / "none")


def test_wrong_tables(table, refused):
    rows = pd.read_csv(table)
    write_table(table, rows.drop(columns="tz_nm"))
    assert f"{table}: tz_nm: expected a column" in refused(table, *VERTICAL)
    write_table(table, rows[:5])
    assert f"{table}: poses: expected at least 6, found 5" in refused(table, *VERTICAL)
