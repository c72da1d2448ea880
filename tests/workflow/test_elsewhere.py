"""The workflow from elsewhere: as a module, in another directory, installed."""

import json
import os
import shutil
import subprocess
import sys

import pytest
import sample_run

pytestmark = pytest.mark.workflow


def left_behind(folder, names):
    """As of other copies, and the tests."""
    return {*sample_run.LEFT_BEHIND(folder, names), *({"tests"} & set(names))}


MODULE = """
configfile: "config.yaml"


module palpate:
    snakefile: "{root}/workflow/Snakefile"
    config: config


use rule * from palpate
"""
CONFIG = "paths: {raw: raw, sensors: sensors, lab: null}\nseed: 7\n"
PLANE = "results/foam_block/kinect/support_plane.json"


def snakemake(folder, *arguments, **more):
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    command = [sys.executable, "-m", "snakemake", "--workflow-profile", "none", *arguments]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env=environment | more
    )


@pytest.fixture
def elsewhere(root, tmp_path):
    """A folder with captures and files of sensors, and nothing of the project."""
    for name in ("raw", "sensors"):
        shutil.copytree(root / "tests/sample" / name, tmp_path / "here" / name)
    return tmp_path / "here"


@pytest.mark.long
def test_as_a_module(root, elsewhere, tmp_path):
    """As snakedeploy names it: a commit, no folder; what is not configured has its default."""
    copy = shutil.copytree(root, tmp_path / "palpate", ignore=left_behind)
    git = ["git", "-C", str(copy), "-c", "user.name=lab", "-c", "user.email=lab@example.org"]
    for command in (["init", "-q"], ["add", "-A"], ["commit", "-q", "-m", "All"]):
        subprocess.run([*git, *command], check=True)
    named = MODULE.format(root=f"git+file://{copy}").replace('Snakefile"', 'Snakefile@HEAD"')
    (elsewhere / "Snakefile").write_text(named)
    (elsewhere / "config.yaml").write_text(CONFIG)
    done = snakemake(elsewhere, "--cores", "1", "--", PLANE)
    assert done.returncode == 0, done.stderr[-3000:]
    assert json.loads((elsewhere / PLANE).read_text())["offset_m"] > 0
    whole = snakemake(elsewhere, "--dry-run")
    assert "own_report" in whole.stdout and "figure_5_5" not in whole.stdout


def test_in_another_directory_with_devices_of_its_own(root, tmp_path):
    """The project's lab, which films with the project's sensors, stays at home."""
    own, here = root / "tests/own_object", tmp_path / "here"
    for name in ("sensors", "probes"):
        shutil.copytree(own / name, here / "config" / name)
    done = snakemake(root, "--directory", str(here), "--dry-run")
    assert "error: raw: expected captures" in done.stderr
    shutil.copytree(own / "raw", here / "raw")
    done = snakemake(root, "--directory", str(here), "--dry-run")
    assert done.returncode == 0, done.stderr[-3000:]
    assert "own_report" in done.stdout and "lab_capture" not in done.stdout


def test_a_file_of_the_command_line_is_blamed_for_what_it_says(root, tmp_path):
    """The last that says a thing, as it holds."""
    path = tmp_path / "run.yaml"
    path.write_text("hertz:\n  onset_force_n: -1\n")
    done = snakemake(root, "--dry-run", "--configfile", str(path))
    assert done.returncode == 1
    assert f"error: {path}: hertz.onset_force_n: expected " in done.stderr


def test_as_the_catalog_tries_it(root, tmp_path):
    copy = shutil.copytree(
        root, tmp_path / "palpate", ignore=shutil.ignore_patterns(".git", ".venv", "results")
    )
    done = snakemake(copy, "--directory", ".test", "--dry-run")
    assert done.returncode == 0, done.stderr[-3000:]
    assert "summary" in done.stdout


def test_as_a_package(root, tmp_path):
    """Built as pip builds it, and used from a folder where there is nothing else."""
    built, source = tmp_path / "built", tmp_path / "source"
    shutil.copytree(root, source, ignore=left_behind)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--no-build-isolation", "--target", str(built), str(source)], check=True)
    assert not (built / "thesis").exists() and not (built / "virtual_lab").exists()
    (tmp_path / "curve.csv").write_text(
        "depth_m,force_n\n" + "".join(f"{k * 1e-5},{1e3 * (k * 1e-5) ** 1.5}\n" for k in range(40))
    )
    done = subprocess.run(
        [str(built / "bin/palpate"), "hertz", "curve.csv", "--radius-mm", "6", "--json"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(built)},
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert json.loads(done.stdout)["reduced_modulus_pa"] == pytest.approx(
        1e3 * 3 / 4 / 0.006**0.5, rel=1e-3
    )
