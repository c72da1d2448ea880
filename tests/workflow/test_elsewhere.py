"""The workflow as a module, in another directory, installed, locked, without a network, by make."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.metadata import distributions

import pytest
from sample_run import LEFT_BEHIND, SAMPLE


def left_behind(folder, names):
    """As of other copies, and the tests."""
    return {*LEFT_BEHIND(folder, names), *({"tests"} & set(names))}


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


@pytest.mark.workflow
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


@pytest.mark.workflow
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


@pytest.mark.workflow
def test_a_file_of_the_command_line_is_blamed_for_what_it_says(root, tmp_path):
    """The last that says a thing, as it holds."""
    path = tmp_path / "run.yaml"
    path.write_text("hertz:\n  onset_force_n: -1\n")
    done = snakemake(root, "--dry-run", "--configfile", str(path))
    assert done.returncode == 1
    assert f"error: {path}: hertz.onset_force_n: expected " in done.stderr


@pytest.mark.workflow
def test_as_the_catalog_tries_it(root, tmp_path):
    ignored = shutil.ignore_patterns(".git", ".venv", "results")
    copy = shutil.copytree(root, tmp_path / "palpate", ignore=ignored)
    done = snakemake(copy, "--directory", ".test", "--dry-run")
    assert done.returncode == 0, done.stderr[-3000:]
    assert "summary" in done.stdout


@pytest.mark.workflow
def test_as_a_package(root, tmp_path):
    """Built as pip builds it, and used from a folder where there is nothing else."""
    built, source = tmp_path / "built", tmp_path / "source"
    shutil.copytree(root, source, ignore=left_behind)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--no-build-isolation", "--target", str(built), str(source)], check=True)
    assert not (built / "thesis").exists() and not (built / "virtual_lab").exists()
    rows = "".join(f"{k * 1e-5},{1e3 * (k * 1e-5) ** 1.5}\n" for k in range(40))
    (tmp_path / "curve.csv").write_text(f"depth_m,force_n\n{rows}")
    command = [str(built / "bin/palpate"), "hertz", "curve.csv", "--radius-mm", "6", "--json"]
    how = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(built)}}
    done = subprocess.run(command, capture_output=True, text=True, **how)
    assert done.returncode == 0, done.stderr[-3000:]
    modulus_pa = json.loads(done.stdout)["reduced_modulus_pa"]
    assert modulus_pa == pytest.approx(1e3 * 3 / 4 / 0.006**0.5, rel=1e-3)


# Of `python -m venv` itself, and what is installed of this folder.
NOT_LOCKED = {"pip", "palpate"}


def normal(name):
    """A package's name as indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def entries(path):
    """Entries of a lock by name, each with its version and all that follows."""
    text = path.read_text().replace("\\\n", " ")
    rows = [row for row in map(str.strip, text.splitlines()) if row and row[0] != "#"]
    return {normal(row.partition("==")[0].partition("[")[0]): row for row in rows}


@pytest.fixture(scope="module")
def lock(root):
    return entries(root / "environment.lock")


def test_every_locked_package_has_a_version_the_site_the_same_and_hashes(root, lock):
    assert len(lock) > 100
    wanted = re.compile(r"[A-Za-z0-9._\[\]-]+==\S+.*--hash=sha256:[0-9a-f]{64}")
    site = entries(root / "docs/environment.lock")
    assert [row for row in [*lock.values(), *site.values()] if not wanted.match(row)] == []
    both = site.keys() & lock.keys()
    assert {site[name].split()[0] for name in both} == {lock[name].split()[0] for name in both}


def test_what_people_ask_for_is_locked(root, lock):
    rows = (root / "environment.in").read_text().splitlines()
    asked = {normal(row.partition("==")[0]) for row in rows if row and row[0] != "#"}
    assert asked <= set(lock)


def test_the_environment_is_the_locks(lock):
    there = {normal(one.metadata["Name"]): one.version for one in distributions()}
    locked = {name: re.match(r"[^=]+==([^\s;]+)", row)[1] for name, row in lock.items()}
    assert {name: there[name] for name in set(there) - NOT_LOCKED} == locked


def test_no_job_needs_a_network(fresh):
    """A real target in a namespace without any network: from the background to the table."""
    unshare = shutil.which("unshare")
    alone = [unshare or "", "--net", "--map-root-user"]
    if not unshare or subprocess.run([*alone, "true"], capture_output=True).returncode:
        pytest.skip("unshare --net is not there or not permitted on this machine")
    target = "results/sample/foam_block/kinect/support_plane.json"
    command = [*alone, sys.executable, "-m", "snakemake", "--profile", "workflow/profiles/default"]
    command += [*SAMPLE, "--", target]
    done = subprocess.run(command, cwd=fresh, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    assert (fresh / target).is_file()


def planned(root, *names):
    """Words of the command that make would run."""
    command = ["make", "--no-print-directory", "--dry-run", "--old-file", ".venv/installed"]
    # The tests may be run by a make, which hands its own options on.
    own = {name: text for name, text in os.environ.items() if not name.startswith(("MAKE", "MFL"))}
    command += ["check", *names]
    planned = subprocess.check_output(command, cwd=root, env=own, text=True)
    return shlex.split(planned.replace("\\\n", ""))


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("name", ["toy_cow", "My Cow", "O'Brien", "a;b", "%"])
def test_an_objects_name_goes_to_the_check_as_one_word_and_without_one_all_are_checked(root, name):
    assert planned(root, f"object={name}")[-2:] == ["check", f"raw/{name}"]
    assert planned(root)[-1] == "check"
