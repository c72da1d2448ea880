"""The stage that finds the tip, and the command, on a recording that the lab made."""

import json

import numpy as np
import pytest
import yaml
from palpate.__main__ import main
from palpate.capture.experiments import check_experiment
from palpate.capture.tables import read_frames, write_frames
from virtual_lab.probe_experiments import record_pivot
from virtual_lab.rig import bare_bench, make_rig
from virtual_lab.rig_errors import errors_of

PIVOT = {
    "frames": 12,
    "frame_rate_hz": 6,
    "lean_deg": 30.0,
    "spin_deg": 15.0,
    "tremor_deg": 0.3,
    "camera": {"target_m": [0.0, 0.0, 0.11], "distance_m": 0.65, "elevation_deg": 30},
}
SENSOR, PROBE = "tests/sample/sensors/bumblebee.yaml", "config/probes/nano25_sphere.yaml"


@pytest.fixture(scope="module")
def sensor(root):
    return yaml.safe_load((root / SENSOR).read_text())


@pytest.fixture(scope="module")
def recorded(root, sensor, probe, tmp_path_factory):
    """A recording of the handle by the smaller stereo head, and where its probe's tip really is."""
    lab = yaml.safe_load((root / "config/lab.yaml").read_text())
    apart = ("objects", "experiments", "simulated_block", "laser")
    common = {key: value for key, value in lab.items() if key not in apart}
    folder = tmp_path_factory.mktemp("sensors") / "pivot"
    folder.mkdir()
    bench, errors = bare_bench(common, name="pivot"), errors_of(common, {}, sensor)
    rig = make_rig(common, errors, PIVOT["camera"], bench)
    return folder, record_pivot(folder, rig, PIVOT, probe, seed=[1])["tip_m"]


@pytest.fixture
def found(stage, sensor, probe, tmp_path):
    """Run the stage; give tip.json, or the line that it ends with."""

    def run(folder, of=probe):
        params = {"part": "tip", "sensor": sensor, "probe": of, "options": {}, "more": {}}
        files = {"inputs": {"film": folder}, "outputs": {"fields": "tip.json"}}
        line = stage("probe_calibration", **files, params=params)
        return line or json.loads((tmp_path / "tip.json").read_text())

    return run


def test_the_tip_is_found(recorded, found, sensor, root, tmp_path):
    """By the stage, and as well by the command."""
    folder, tip_m = recorded
    assert not check_experiment(folder, sensor)
    told = found(folder)
    assert told["poses"] == 12
    assert np.linalg.norm(told["tip_m"] - tip_m) < 2e-4
    off = told["tip_m"] - tip_m
    assert off @ np.linalg.solve(told["tip_covariance_m2"], off) < 20
    out = tmp_path / "by_command.json"
    given = folder, "--sensor", root / SENSOR, "--board", root / PROBE, "--output", out
    assert main(["calibrate", "tip", *map(str, given)]) == 0
    assert json.loads(out.read_text()) == told


def test_a_probe_must_be_named_and_a_few_frames_are_rejected(recorded, found, tmp_path):
    folder, _ = recorded
    assert "experiments.probe: expected the recorded probe, found none" in found(folder, None)
    short = tmp_path / "pivot"
    short.mkdir()
    for side in ("left", "right"):
        (short / side).symlink_to(folder / side)
    write_frames(short, read_frames(folder)[:9])
    assert f"{short}: poses: expected at least 10, found 9" in found(short)
