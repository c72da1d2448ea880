"""The stage that finds the tip, on a film that the lab made."""

import json

import numpy as np
import pytest
import yaml
from palpate.capture.experiments import check_experiment
from palpate.capture.tables import read_frames, write_frames
from virtual_lab.device import device_of
from virtual_lab.pivot import record_pivot
from virtual_lab.rig import bare_bench, make_rig

PIVOT = {
    "frames": 12,
    "frame_rate_hz": 6,
    "lean_deg": 30.0,
    "spin_deg": 15.0,
    "tremor_deg": 0.3,
    "camera": {"target_m": [0.0, 0.0, 0.11], "distance_m": 0.65, "elevation_deg": 30},
}


# As the validation draws its rigs.
DRAWN = {"focal": 0.001, "principal_px": 0.5, "distortion_px": 0.3}


@pytest.fixture(scope="module")
def sensor(root):
    return yaml.safe_load((root / "tests/sample/sensors/bumblebee.yaml").read_text())


@pytest.fixture(scope="module")
def film(root, sensor, probe, tmp_path_factory):
    """Film the handle with the smaller stereo head, or one that is drawn."""
    lab = yaml.safe_load((root / "config/lab.yaml").read_text())
    apart = ("objects", "experiments", "simulated_block", "laser")
    common = {key: value for key, value in lab.items() if key not in apart}

    def made(spec, options=PIVOT):
        folder = tmp_path_factory.mktemp("sensors") / "pivot"
        folder.mkdir()
        bench, device = bare_bench(common, name="pivot"), device_of(common, spec, sensor)
        rig = make_rig(common, device, options["camera"], bench)
        return folder, record_pivot(folder, rig, common, options, probe, seed=[1])["tip_m"]

    return made


@pytest.fixture(scope="module")
def filmed(film):
    """A film, and where its probe's tip really is."""
    return film({})


@pytest.fixture
def found(stage, sensor, probe, tmp_path):
    """Run the stage; give tip.json, or the line that it ends with."""

    def run(folder, of=probe):
        params = {"part": "tip", "sensor": sensor, "probe": of, "options": {}, "more": {}}
        files = {"inputs": {"film": folder}, "outputs": {"fields": "tip.json"}}
        line = stage("probe_calibration", **files, params=params)
        return line or json.loads((tmp_path / "tip.json").read_text())

    return run


def test_the_labs_film_is_a_recording(filmed, sensor):
    assert not check_experiment(filmed[0], sensor)


def test_the_tip_is_found(filmed, found):
    folder, tip_m = filmed
    told = found(folder)
    assert told["poses"] == 12
    assert np.linalg.norm(told["tip_m"] - tip_m) < 2e-4
    off = told["tip_m"] - tip_m
    assert off @ np.linalg.solve(told["tip_covariance_m2"], off) < 20


def test_a_probe_must_be_named(filmed, found):
    assert "experiments.probe: expected the recorded probe, found none" in found(filmed[0], None)


def test_a_few_frames_are_refused(filmed, found, tmp_path):
    folder, _ = filmed
    short = tmp_path / "pivot"
    short.mkdir()
    for side in ("left", "right"):
        (short / side).symlink_to(folder / side)
    write_frames(short, read_frames(folder)[:9])
    assert f"{short}: poses: expected at least 10, found 9" in found(short)


@pytest.mark.long
def test_deviations_hold_for_cameras_that_the_lab_draws(film, found):
    """What each camera is wrong by is alike in all frames of its film."""
    square = []
    for rig in range(6):
        folder, tip_m = film({"device": DRAWN, "rig": f"drawn_{rig}"}, PIVOT | {"frames": 20})
        told = found(folder)
        off = told["tip_m"] - tip_m
        square.append(off @ np.linalg.solve(told["tip_covariance_m2"], off) / 3)
    # The mean's own deviation is 0.33.
    assert np.mean(square) == pytest.approx(1, abs=0.7)
