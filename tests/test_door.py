"""One door: whichever way a capture comes in, its files and its devices' are held to one list."""

import shutil

import cv2
import numpy as np
import palpate
import pandas as pd
import pytest
import yaml
from palpate.__main__ import main

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


def double_radius(bench):
    change(bench / PROBE, indenter={"radius_m": 0.012})


def mirror(bench):
    rows = yaml.safe_load((bench / PROBE).read_text())["marker_from_force"]
    change(bench / PROBE, marker_from_force=(np.diag([1, 1, -1, 1]) @ np.array(rows)).tolist())


def narrow_exclusion(bench):
    change(bench / PROBE, exclusion={"radius_m": 0.004})


def point_nowhere(bench):
    path = bench / OBJECT / "object.yaml"
    spec = yaml.safe_load(path.read_text())
    spec["points"]["back"]["direction"] = [0, 0, 0]
    path.write_text(yaml.safe_dump(spec))


SPOILT = {
    halve_depth: "depth/000000.png: depth: expected 432 x 400 pixels, found 216 x 200",
    lose_depth: "back/frames.csv: columns: expected depth, found frame, time_s, color",
    double_radius: "bench_probe.yaml: exclusion.tip_radius_m: expected indenter.radius_m 0.012 to",
    mirror: "marker_from_force: expected a rotation and a shift, found a mirrored one",
    narrow_exclusion: "exclusion.radius_m: expected indenter.radius_m 0.006 or more, found 0.004",
    point_nowhere: "object.yaml: points.back.direction: expected a direction, found zeros",
}


@pytest.mark.parametrize("spoil", SPOILT)
def test_every_way_in_makes_every_check(bench, spoil, capsys):
    spoil(bench)
    with pytest.raises(ValueError) as refused:
        palpate.open_capture(CAPTURE)
    assert main(["check"]) == 1
    checked = capsys.readouterr().out
    assert main(["direct", OBJECT, "--fast"]) == 1
    told = capsys.readouterr()
    assert not told.out
    (direct,) = told.err.splitlines()
    for line in (str(refused.value), checked, direct):
        assert SPOILT[spoil] in line


def test_a_recording_under_two_names_is_told_before_the_work(bench, capsys):
    shutil.copytree(bench / CAPTURE, bench / f"{CAPTURE}-a02")
    assert main(["direct", OBJECT, "--fast"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "back-a02/force.csv: content: expected another recording" in line
