"""One door: whichever way a capture comes in, its files and its devices' are held to one list."""

import re
import shutil

import cv2
import numpy as np
import palpate
import pandas as pd
import pytest
import yaml
from palpate.__main__ import main
from palpate.capture.images import mosaic_rggb
from palpate.estimate.hertz.indentation import force_onset
from palpate.press import press_of
from palpate.vision.force import FORCE
from palpate.workflow.options import Config

OBJECT, CAPTURE = "raw/toy_cow", "raw/toy_cow/bench_cam/back"
PROBE = "config/probes/bench_probe.yaml"


@pytest.fixture
def bench(root, tmp_path, monkeypatch):
    """The own object with one capture, and its devices, as the current folder."""
    own = root / "tests/own_object"
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, tmp_path / "config" / name)
    shutil.copytree(
        own / OBJECT, tmp_path / OBJECT, ignore=shutil.ignore_patterns("back-a02", "*.part")
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


def change(path, **blocks):
    """Change fields of a YAML file's blocks."""
    spec = yaml.safe_load(path.read_text())
    for name, value in blocks.items():
        spec[name] = spec[name] | value if isinstance(value, dict) else value
    path.write_text(yaml.safe_dump(spec))


def halve_depth(bench):
    for path in (bench / CAPTURE / "depth").glob("*.png"):
        cv2.imwrite(str(path), cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[::2, ::2].copy())


def lose_depth(bench):
    path = bench / CAPTURE / "frames.csv"
    pd.read_csv(path).drop(columns="depth").to_csv(path, index=False)


def mirror(bench):
    rows = yaml.safe_load((bench / PROBE).read_text())["marker_from_force"]
    change(bench / PROBE, marker_from_force=(np.diag([1, 1, -1, 1]) @ np.array(rows)).tolist())


CORRUPTED = {
    halve_depth: "depth/000000.png: depth: expected 432 x 400 pixels, found 216 x 200",
    lose_depth: "back/frames.csv: columns: expected depth, found frame, time_s, color",
    mirror: "marker_from_force: expected a rotation and a shift, found a mirrored one",
}


@pytest.mark.parametrize("corrupt", CORRUPTED)
def test_every_way_in_makes_every_check(bench, corrupt, capsys):
    corrupt(bench)
    with pytest.raises(ValueError) as refused:
        palpate.open_capture(CAPTURE)
    assert main(["check"]) == 1
    checked = capsys.readouterr().out
    assert main(["direct", OBJECT]) == 1
    told = capsys.readouterr()
    assert not told.out
    (direct,) = told.err.splitlines()
    for line in (str(refused.value), checked, direct):
        assert CORRUPTED[corrupt] in line


def test_a_recording_under_two_names_is_told_before_the_work(bench, capsys):
    shutil.copytree(bench / CAPTURE, bench / f"{CAPTURE}-a02")
    assert main(["direct", OBJECT]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "back-a02/force.csv: content: expected another recording" in line


def scale_force(bench, factor):
    path = bench / CAPTURE / "force.csv"
    table = pd.read_csv(path)
    table.iloc[:, 1:] *= factor
    table.to_csv(path, index=False)


def halve_colour(bench):
    """Colour of half the size, with the focal length of the whole."""
    images = (bench / OBJECT / "bench_cam").glob("*/color/*.png")
    for path in images:
        samples = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        rgb = cv2.cvtColor(samples, cv2.COLOR_BayerBG2BGR)[::2, ::2]
        cv2.imwrite(str(path), mosaic_rggb(rgb[..., ::-1].copy()))
    small = {"width_px": 216, "height_px": 200, "cx_px": 107.3, "cy_px": 101.5}
    change(bench / "config/sensors/bench_cam.yaml", color=small)


# What the long work would be for: told at once by `palpate check`, and by what estimates.
IMPLAUSIBLE = {
    "a force in millinewtons": (
        lambda bench: scale_force(bench, 1e3),
        "force.csv: expected at most 500 N from an operator, found 17[0-9]{2} N",
    ),
    "a force in kilonewtons": (
        lambda bench: scale_force(bench, 1e-3),
        "force: expected above 0.1 N, found at most 0.00598 N",
    ),
    "colour of half the size": (
        halve_colour,
        "marker.square_m: expected the board 0.540 m away, .* images of another size than"
        " 216 x 200 px with fx_px 540?",
    ),
}


@pytest.mark.parametrize("name", IMPLAUSIBLE)
def test_a_check_refuses_what_needs_no_long_work_to_see(bench, name, capsys):
    corrupt, line = IMPLAUSIBLE[name]
    corrupt(bench)
    assert main(["check"]) == 1
    told = capsys.readouterr().out
    assert "nothing wrong" not in told
    assert re.search(f"{CAPTURE}: {line}", told), told
    with pytest.raises(ValueError, match=line):
        capture = palpate.open_capture(CAPTURE)
        press = press_of(capture, Config())
        force_onset(np.linalg.norm(press.wrenches[FORCE], axis=1), onset_force_n=0.1)


def test_a_check_takes_the_configurations_thresholds(bench, capsys):
    (bench / "config/config.yaml").write_text("hertz: {onset_force_n: 2.0}\n")
    assert main(["check"]) == 1
    assert "force: expected above 2 N, found at most 1.7" in capsys.readouterr().out
