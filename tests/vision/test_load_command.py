"""`palpate calibrate load` on a table, and on a film with its record of forces."""

import json

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.capture.tables import WRENCH_COLUMNS, write_table
from palpate.vision.indentation import weight_wrenches
from palpate.vision.probe import marker_columns
from palpate.vision.probe_recordings import static_poses
from probe_motion import held_free
from scipy.spatial.transform import Rotation

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
def devices(root):
    sensor = root / "tests/sample/sensors/bumblebee.yaml"
    return "--sensor", sensor, "--board", root / "config/probes/nano25_sphere.yaml"


@pytest.fixture
def table(tmp_path, probe):
    path, poses = tmp_path / "poses.csv", held_free()
    noisy = wrenches(poses, probe) + NOISE * np.random.default_rng(0).standard_normal((12, 6))
    rows = marker_columns(poses).join(pd.DataFrame(noisy, columns=list(WRENCH_COLUMNS)))
    write_table(path, rows)
    return path


def test_a_table(table, given, tmp_path, devices, probe):
    out = tmp_path / "load.json"
    text = given(table, *VERTICAL, *devices[2:], "--output", out)
    assert "mass: determined, to" in text and "rotation: determined, to" in text
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


def recorded(time_s, turns, samples_s, wrench):
    """Tables of poses and forces of a recording."""
    poses = np.tile(np.eye(4), (len(time_s), 1, 1))
    poses[:, :3, :3] = turns.as_matrix()
    table = marker_columns(poses).assign(frame=range(len(time_s)), time_s=time_s)
    return table, pd.DataFrame(wrench, columns=list(WRENCH_COLUMNS)).assign(time_s=samples_s)


def test_static_poses_of_a_recording(probe):
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
    found = static_poses(*recorded(time_s, seen, samples_s, record), probe)
    # The last pose is held to the end.
    assert len(found.names) == 8
    np.testing.assert_allclose(found.wrench[:7], wrenches(poses, probe)[:7], atol=0.01)
    off = (found.wrench[:7] - wrenches(poses, probe)[:7]) / found.noise
    assert off.std() == pytest.approx(1, abs=0.4)


def test_an_operator_who_never_rests(probe):
    turns = Rotation.from_rotvec(np.linspace(0, 6, 60)[:, None] * [1.0, 0, 0])
    tables = recorded(np.arange(60) / 10, turns, np.arange(6000) / 1e3, np.zeros((6000, 6)))
    with pytest.raises(ValueError, match="expected the probe to be held still for 1 s"):
        static_poses(*tables, probe)


def test_recordings_of_something_else(refused, root, devices):
    folder = root / "tests/sample/raw/foam_block/bumblebee"
    line = refused(folder / "background", *VERTICAL, *devices)
    assert "background: marker: expected its corners" in line
    assert "at least 6, found" in refused(folder / "08", *VERTICAL, *devices)


def test_what_is_not_given_and_wrong_tables(table, refused, tmp_path):
    assert "--up: expected it, or a recording with background/, found none" in refused(table)
    assert "--up: expected a direction" in refused(table, "--up", "0", "0", "0")
    assert "frames.csv: expected a recording's, found none" in refused(tmp_path)
    assert "none: source: expected a recording or a table, found none" in refused(tmp_path / "none")
    rows = pd.read_csv(table)
    write_table(table, rows.drop(columns="tz_nm"))
    assert f"{table}: tz_nm: expected a column" in refused(table, *VERTICAL)
    write_table(table, rows[:5])
    assert f"{table}: poses: expected at least 6, found 5" in refused(table, *VERTICAL)
