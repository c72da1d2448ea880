"""Payload and compliance of a probe that the lab knows: the commands and the stages."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from palpate.__main__ import main
from palpate.capture.experiments import check_experiment
from palpate.capture.tables import WRENCH_COLUMNS, read_force, write_force
from palpate.config.probe import asked
from palpate.estimate.direct.options import ProbeUncertainty
from palpate.vision.calibrated_probe import calibrated_probe
from palpate.vision.force import wrenches
from probe_motion import lab_film
from scipy.spatial.transform import Rotation

HELD = {"poses": 7, "hold_s": 1.45, "turn_s": 0.55, "frame_rate_hz": 3}
PRESSED = {"presses": 1, "press_s": 6.0, "rest_s": 1.0, "frame_rate_hz": 4}
STIFFNESS_N_M = 5000

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def sensor(root):
    return yaml.safe_load((root / "tests/sample/sensors/bumblebee.yaml").read_text())


@pytest.fixture(scope="module")
def held(root, sensor, probe, tmp_path_factory):
    """A film of seven poses, and its truth."""
    folder = tmp_path_factory.mktemp("sensors") / "load"
    return folder, lab_film(root, folder, sensor, probe, **HELD)


@pytest.fixture(scope="module")
def pressed(root, sensor, probe, tmp_path_factory):
    """A film of a press on something rigid, and its truth."""
    folder = tmp_path_factory.mktemp("sensors") / "stiffness"
    return folder, lab_film(root, folder, sensor, probe, stiffness_n_m=STIFFNESS_N_M, **PRESSED)


@pytest.fixture
def ran(root, capfd):
    """Run a part of the command on a film: gives its status and what it shows."""

    def run(folder, *more):
        files = (root / "tests/sample/sensors/bumblebee.yaml", "--board")
        given = folder, "--sensor", *files, root / "config/probes/nano25_sphere.yaml", *more
        status = main(["calibrate", folder.name, *map(str, given)])
        shown = capfd.readouterr()
        return status, shown.err if status else shown.out

    return run


@pytest.fixture
def staged(stage, sensor, probe, tmp_path):
    """Run the stage of a recording; gives the path of its result, or the line that it ends with."""

    def run(folder):
        made = tmp_path / f"{folder.name}.json"
        params = {"part": folder.name, "sensor": sensor, "probe": probe, "options": {}}
        params |= {"more": {"support_plane": {}, "force": {}, "seed": 1}}
        files = {"inputs": {"film": folder}, "outputs": {"fields": made.name}}
        return stage("probe_calibration", **files, params=params) or made

    return run


def test_a_load(held, ran, sensor, tmp_path):
    folder, truth = held
    assert not check_experiment(folder, sensor)
    status, text = ran(folder, "--output", tmp_path / "load.json")
    assert status == 0 and ": 7 poses" in text
    found = json.loads((tmp_path / "load.json").read_text())
    std = np.sqrt(np.diag(found["covariance"]))
    turn = np.array(found["marker_from_force_rotation"]).T @ truth["marker_from_force"]
    off = {
        "mass": (found["mass_kg"] - truth["mass_kg"], std[0], 1e-3),
        "turn": (Rotation.from_matrix(turn).as_rotvec(), std[1:4], np.deg2rad(0.3)),
        "centre": (found["centre_of_mass_m"] - truth["centre_of_mass_m"], std[7:10], 1e-3),
    }
    for part, (error, deviation, most) in off.items():
        assert np.linalg.norm(error) < most, part
        assert (np.abs(error) < 3.5 * deviation).all(), part


def test_a_stiffness(pressed, sensor, ran, tmp_path):
    folder, truth = pressed
    assert not check_experiment(folder, sensor)
    assert ran(folder, "--output", tmp_path / "stiffness.json")[0] == 0
    found = json.loads((tmp_path / "stiffness.json").read_text())
    off_m_n = found["compliance_m_n"] - 1 / truth["stiffness_n_m"]
    assert abs(off_m_n) < 2.5 * found["compliance_std_m_n"]
    assert found["compliance_std_m_n"] < 0.15 / STIFFNESS_N_M


def test_stages_give_a_probe_its_numbers(held, pressed, staged, probe):
    paths = staged(held[0]), staged(pressed[0])
    assert {json.loads(path.read_text())["probe"] for path in paths} == {probe["probe"]}
    asks = probe | {"load": "calibration", "axes": "calibration", "stiffness_n_m": "calibration"}
    assert list(asked(asks)) == ["load", "stiffness"]
    found = calibrated_probe(asks, paths)
    assert asked(found) == {}
    assert found["load"]["mass_kg"] == pytest.approx(held[1]["mass_kg"], abs=1e-3)
    turn = np.array(found["marker_from_force"])
    np.testing.assert_allclose(turn[:3, :3], held[1]["marker_from_force"], atol=5e-3)
    stated = np.array(probe["marker_from_force"])
    np.testing.assert_array_equal(turn[:, 3], stated[:, 3])
    off_m_n = 1 / found["stiffness_n_m"] - 1 / pressed[1]["stiffness_n_m"]
    assert abs(off_m_n) < 2.5 * found["compliance_std_m_n"]
    known = ProbeUncertainty.of(found)
    assert known.compliance_std_m_n and found["axes_std_rad"] and found["load"]["mass_std_kg"]


def test_numbers_of_few_steps(held, ran, probe, sensor, tmp_path):
    """A record in steps of 0.05 N and 2 mNm, of which one torque hardly leaves one."""
    new = shutil.copytree(held[0], tmp_path / held[0].name)
    record = read_force(new)
    _, wrench = wrenches(record, probe)
    steps = np.repeat([0.05, 0.002], 3)
    coarse = np.round((wrench - wrench[:300].mean(axis=0)) / steps) * steps
    coarse[:, 5] = 0
    table = pd.DataFrame(np.round(coarse, 6), columns=list(WRENCH_COLUMNS))
    write_force(new, record[["time_s"]].join(table))
    status, text = ran(new, "--output", tmp_path / "load.json")
    assert status == 0 and "rotation: not determined" in text
    found = json.loads((tmp_path / "load.json").read_text())
    off_kg = found["mass_kg"] - held[1]["mass_kg"]
    assert abs(off_kg) < 3 * found["mass_std_kg"] < 3e-3
    table[["tx_nm", "ty_nm"]] = 0.0
    write_force(new, record[["time_s"]].join(table))
    status, line = ran(new)
    expected = "expected torques that change with the pose, found one value"
    assert line == f"error: {new}: force: {expected}\n"
