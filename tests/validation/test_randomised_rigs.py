"""Randomised rigs: within what is declared, measurable, and a run that Snakemake can plan."""

import json
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
import yaml
from palpate.modulus import LABELS
from palpate.workflow.configuration import open_run
from palpate.yaml_files import load_yaml
from sample_run import LEFT_BEHIND, snakemake
from settings import written
from thesis.options import StudyConfig
from validation import randomised_rigs
from virtual_lab.checks import OF_OBJECT, lab_problems
from virtual_lab.randomise import main, random_lab, single_errors
from virtual_lab.specification import Lab

SEEDS = (1, 2, 3, 4)
RANDOMISE = ("-m", "virtual_lab.randomise", "config/validation.yaml")


@pytest.fixture(scope="module")
def ranges(root):
    return load_yaml(root / "config/validation.yaml")


@pytest.fixture(scope="module")
def base(root):
    return load_yaml(root / "config/lab.yaml")


@pytest.fixture(scope="module")
def labs(ranges, base, probe):
    return {seed: random_lab(ranges, base, probe, seed=seed) for seed in SEEDS}


@pytest.fixture(scope="module")
def objects(labs):
    return [spec for lab in labs.values() for spec in lab["objects"].values()]


def test_a_seed_says_all(ranges, base, probe, labs):
    assert random_lab(ranges, base, probe, seed=2) == labs[2]
    materials = [str(spec["material"]) for lab in labs.values() for spec in lab["objects"].values()]
    assert len(set(materials)) == len(materials)


def test_random_objects_fill_their_ranges(ranges, objects, probe):
    moduli = np.array([spec["material"]["youngs_modulus_pa"] for spec in objects])
    ratios = np.array([spec["material"]["poisson_ratio"] for spec in objects])
    radius = probe["indenter"]["radius_m"]
    depths = np.array([spec["motion"]["depth_m"] for spec in objects]) / radius
    for found, (low, high) in (
        (moduli, ranges["material"]["youngs_modulus_pa"]),
        (ratios, ranges["material"]["poisson_ratio"]),
        (depths, ranges["press"]["depth_over_radius"]),
    ):
        assert low <= found.min() and found.max() <= high
    assert moduli.min() < 6e3 and moduli.max() > 3e5
    assert ratios.min() < 0.08 and ratios.max() > 0.46
    assert depths.min() < 0.25 and depths.max() > 1.05
    assert abs(np.corrcoef(np.log(moduli), ratios)[0, 1]) < 0.2


def test_forms_supports_and_laws_are_mixed(ranges, objects):
    kinds = [randomised_rigs.randomised(spec)["form"] for spec in objects]
    assert set(kinds) == {"bonded block", "resting block", "resting ball", "bonded ear"}
    assert min(kinds.count(kind) for kind in set(kinds)) >= 5
    laws = [spec["material"]["law"] for spec in objects]
    assert set(laws) == set(ranges["material"]["law"])
    assert len({spec["rig"] for spec in objects}) == len(objects)


def test_forces_can_be_measured(ranges, objects, probe):
    radius, (low, high) = probe["indenter"]["radius_m"], ranges["press"]["force_n"]
    for spec in objects:
        material, depth = spec["material"], spec["motion"]["depth_m"]
        star = material["youngs_modulus_pa"] / (1 - material["poisson_ratio"] ** 2)
        assert 0.99 * low < 4 / 3 * star * radius**0.5 * depth**1.5 < 1.01 * high
        assert spec["contact"]["deepest_m"] > depth


def test_ranges_without_a_press_are_one_line(ranges, base, probe):
    nowhere = ranges | {"press": ranges["press"] | {"force_n": [1e5, 1e6]}}
    with pytest.raises(ValueError, match="press: expected depths up to .* found none in"):
        random_lab(nowhere, base, probe, seed=1)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"objects": "two"}, "objects: expected an integer, found 'two'"),
        ({"captures": 0}, "captures: expected a number >= 1, found 0"),
        ({"gloss": [0.4, 0.1]}, "gloss: expected the lower end first, found [0.4, 0.1]"),
        ({"further": 3}, "further: expected one of background_frames, "),
        ({"material": {}}, "material.law: expected "),
    ],
)
def test_bad_ranges_are_one_line(ranges, tmp_path, capsys, monkeypatch, root, change, line):
    monkeypatch.chdir(root)
    (tmp_path / "ranges.yaml").write_text(yaml.safe_dump(ranges | change))
    with pytest.raises(SystemExit) as ended:
        main([str(tmp_path / "ranges.yaml"), str(tmp_path / "out"), "--seed", "1"])
    assert ended.value.code == 1 and not (tmp_path / "out").exists()
    assert f"error: {tmp_path}/ranges.yaml: {line}" in capsys.readouterr().err


def test_a_damaged_estimate_is_named(finished):
    path = finished / "results/object_01/bumblebee/direct.json"
    for text in (path.read_text()[:100], "[]", ""):
        path.write_text(text)
        with pytest.raises(ValueError, match="direct.json: file: expected"):
            randomised_rigs.estimates_of(finished)


def test_all_rejected_is_a_table(finished, capsys):
    (finished / "results/object_01/bumblebee/direct.json").unlink()
    randomised_rigs.main([finished])
    said = capsys.readouterr().out
    assert said.startswith("2 estimates of 1 rigs, 2 rejected.")
    assert "alignment: too far off" in said


def test_a_run_takes_the_randomised_lab(root, tmp_path, monkeypatch):
    monkeypatch.chdir(root)
    main(["config/validation.yaml", str(tmp_path / "7"), "--seed", "7"])
    config = written(root)
    ours = yaml.safe_load((tmp_path / "7/config.yaml").read_text())
    places = {name: str(root / config["paths"][name]) for name in ("probes", "meshes")}
    merged = config | ours | {"paths": config["paths"] | places | ours["paths"]}
    run = open_run(
        merged,
        sources=["config/validation.yaml"],
        project=root,
        kind=StudyConfig,
        lab_kind=Lab,
        check_lab=lab_problems,
    )
    assert len(run.lab_objects) == 24
    assert 2 * len(run.groups()) == len(run.captures) >= 80
    assert run.lab["seed"] == 7
    assert {spec["optics"] for spec in run.sensors.values()} == {"stated"}
    assert not any("clock_offset_std_s" in spec for spec in run.sensors.values())


def test_each_error_stands_alone_at_twice_its_size(ranges, base, probe):
    lab, like = single_errors(ranges, base, probe, seed=1)
    sizes = {k: size for k, size in ranges["device"].items() if k not in OF_OBJECT}
    signs = {"signs_alone": True}
    for spec in lab["objects"].values():
        devices = spec["devices"]
        assert devices["nominal"] == {} and devices["all_errors"] == sizes | signs
        assert set(devices) == set(like) == set(spec["cameras"]) == set(spec["recordings"])
        assert all(devices[name] == {name: 2 * size} | signs for name, size in sizes.items())
    assert set(like.values()) == {"bumblebee", "kinect"}
    assert list(lab["objects"]) == ["block", "ball", "object_01"]


@pytest.mark.long
@pytest.mark.workflow
def test_dry_run(root, tmp_path):
    folder = tmp_path / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    command = [sys.executable, *RANDOMISE, "validation/1", "--seed", "1"]
    subprocess.run(command, cwd=folder, env={"PYTHONPATH": "workflow/scripts"}, check=True)
    config = "validation/1/config.yaml"
    done = snakemake(folder, "--configfile", config, "--dry-run", "--", "validation")
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    counts = dict(re.findall(r"^(\w+) +(\d+)$", text, re.MULTILINE))
    same = {"lab_capture", "clouds", "align", "force", "probe_pose"}
    assert {counts[rule] for rule in same} == {counts["lab_capture"]}
    assert 2 * int(counts["direct_object"]) == int(counts["lab_capture"])
    assert counts["lab_contact"] == counts["solid_mesh"] == "24"
    assert not {"track", "minimise", "summary", "accuracy", "hertz"} & set(counts)


def found(value, low, high):
    return {"value": value, "low": low, "high": high, "verdict": "identified", "unit": "Pa"}


@pytest.fixture
def finished(tmp_path):
    """Two captures of one random object: one estimated 10 % too stiff, one rejected."""
    relaxation = {"fractions": [], "times_s": []}
    material = {"law": "neo_hookean", "youngs_modulus_pa": 1e4, "poisson_ratio": 0.3}
    spec = {
        "rig": "one",
        "shape": {"kind": "ball"},
        "material": material | {"relaxation": relaxation},
        "motion": {"depth_m": 0.004},
        "recordings": {"bumblebee": ["01"], "kinect": ["01"]},
        "object": {"support": {"contact": "resting"}},
    }
    lab = {"seed": 5, "objects": {"object_01": spec}}
    (tmp_path / "lab.yaml").write_text(yaml.safe_dump(lab))
    star = 1e4 / 0.91
    law = {"value": 0.0, "std": 0.3}
    estimate = {
        "captures": ["01"],
        "frames": [12],
        "residuals": [{"motion_scale": 1, "motion_sharing": 1, "depth_scale": 1}],
        "effective": {"depth_m": 0.003},
        "law": {"force": law, "motion": law},
        "warnings": [],
        "information": {name: {"bound": 0.02, "efficiency": 0.5} for name in LABELS},
        "youngs_modulus_pa": found(1.1e4, 1.05e4, 1.15e4),
        "youngs_modulus_1s_pa": found(1.1e4, 1.05e4, 1.15e4),
        "poisson_ratio": found(0.32, 0.25, 0.39),
        "reduced_modulus_pa": found(1.02 * star, 0.9 * star, 1.1 * star),
        "effective_reduced_modulus_pa": found(1.01 * star, 0.95 * star, 1.05 * star),
    }
    places = {"results/object_01/bumblebee/direct.json": json.dumps(estimate)}
    places["results/logs/align/object_01-kinect-01.log"] = (
        "a line before\nerror: alignment: too far off\n"
    )
    for name, text in places.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_estimates_are_compared_with_the_truth(finished, capsys):
    randomised_rigs.main([finished])
    said = capsys.readouterr().out
    assert said.startswith("2 estimates of 1 rigs, 1 rejected.")
    table = randomised_rigs.estimates_of(finished)
    summary = randomised_rigs.summary_of(table).set_index("modulus")
    assert summary.loc["E", "median error"] == "10 %"
    assert summary.loc["E", "over the Cramér-Rao bound"] == "2.00"
    assert summary.loc["E", "intervals that hold"] == "0 of 1"
    assert summary.loc["nu", "median error"] == "0.02"
    assert summary.loc["nu", "intervals that hold"] == "1 of 1"
    assert "alignment: too far off" in said
