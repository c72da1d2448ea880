"""The validation set: its spread, its measurability, and that Snakemake can plan it."""

import re
import shutil

import numpy as np
import pytest
import yaml
from palpate.capture.schema import load_yaml
from palpate.run.configuration import open_run
from sample_run import LEFT_BEHIND, snakemake
from settings import written
from thesis.options import Simulation

CONFIG = ("--configfile", "config/validation.yaml")


@pytest.fixture(scope="module")
def lab(root):
    return load_yaml(root / "config/validation_lab.yaml")


@pytest.fixture(scope="module")
def materials(lab):
    return {name: spec["material"] for name, spec in lab["objects"].items()}


@pytest.fixture(scope="module")
def run(root, tmp_path_factory):
    """The set as a run of the workflow sees it."""
    config = written(root)
    ours = yaml.safe_load((root / "config/validation.yaml").read_text())
    merged = config | ours | {"paths": config["paths"] | ours["paths"]}
    places = ("sensors", "probes", "meshes", "lab")
    merged["paths"] |= {name: str(root / merged["paths"][name]) for name in places}
    merged["paths"]["raw"] = str(tmp_path_factory.mktemp("raw"))
    return open_run(
        merged,
        sources=["config/validation.yaml"],
        project=root,
        blocks={"simulation": Simulation},
    )


def reduced_modulus(material):
    return material["youngs_modulus_pa"] / (1 - material["poisson_ratio"] ** 2)


def test_captures_of_both_sensors_attempts_and_mirror_images(run, lab):
    assert len(run.captures) == len(run.tracked) == len(run.simulated) >= 60
    for name, spec in lab["objects"].items():
        if spec["shape"]["kind"] == "block":
            assert run.lab_point(name, "02") == "01"
            done = {(c.sensor, c.capture) for c in run.captures if c.object == name}
            attempts = ("01", "01-a01", "02")
            assert done == {(s, a) for s in ("bumblebee", "kinect") for a in attempts}


def test_moduli_and_ratios_are_spread(materials):
    assert len(materials) >= 12
    moduli = np.sort([m["youngs_modulus_pa"] for m in materials.values()])
    ratios = np.sort([m["poisson_ratio"] for m in materials.values()])
    assert (moduli[0], moduli[-1]) == (5000, 500000)
    assert (moduli[1:] / moduli[:-1]).max() < 2
    assert (ratios[0], ratios[-1]) == (0.05, 0.49)
    assert np.diff(ratios).max() < 0.08
    # One must not be told from the other.
    assert abs(np.corrcoef(np.log(moduli), ratios_by_modulus(materials))[0, 1]) < 0.3


def ratios_by_modulus(materials):
    ordered = sorted(materials.values(), key=lambda m: m["youngs_modulus_pa"])
    return [m["poisson_ratio"] for m in ordered]


def test_laws_relaxations_and_depths_differ(lab, materials):
    laws = [material["law"] for material in materials.values()]
    assert min(laws.count("neo_hookean"), laws.count("blatz_ko")) >= 5
    relaxed = {sum(m["relaxation"]["fractions"]) for m in materials.values()}
    assert 0 in relaxed and max(relaxed) >= 0.2 and len(relaxed) >= 5
    depths = {spec["motion"]["depth_m"] for spec in lab["objects"].values()}
    assert min(depths) < 0.0006 and max(depths) >= 0.007 and len(depths) >= 6


def test_nothing_is_the_studys(root, lab):
    study = load_yaml(root / "config/lab.yaml")
    assert lab["seed"] != study["seed"]
    assert not set(lab["objects"]) & set(study["objects"])
    known = [spec["material"] for spec in study["objects"].values()]
    assert all(spec["material"] not in known for spec in lab["objects"].values())
    for block in ("camera_noise", "kinect", "timing", "probe_error"):
        assert lab[block] == study[block]


def test_forces_can_be_measured(lab, probe):
    """Hertz's peak force; layers, finite strain and a loose ball change it by less than half."""
    radius = probe["indenter"]["radius_m"]
    for name, spec in lab["objects"].items():
        motion = spec["motion"]
        depth = motion["depth_m"] * (1 - motion["depth_spread"])
        force = 4 / 3 * reduced_modulus(spec["material"]) * radius**0.5 * depth**1.5
        assert 0.2 < force < 25, name
        assert spec["contact"]["friction"] == 0


@pytest.mark.workflow
def test_dry_run(root, tmp_path):
    folder = tmp_path / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    done = snakemake(folder, *CONFIG, "--dry-run", "--", "validation")
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    counts = dict(re.findall(r"^(\w+) +(\d+)$", text, re.MULTILINE))
    same = {"lab_capture", "clouds", "align", "force", "probe_pose", "direct"}
    assert {counts[rule] for rule in same} == {counts["lab_capture"]}
    assert int(counts["lab_capture"]) >= 60
    assert counts["lab_contact"] == counts["solid_mesh"]
    assert not {"track", "minimise", "summary", "accuracy", "table_5_3"} & set(counts)
