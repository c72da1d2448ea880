"""What is locked, that no job needs a network or a shell, and what the Makefile hands on."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from importlib.metadata import distributions

import pytest

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


def test_every_locked_package_has_version_and_hashes(root, lock):
    assert len(lock) > 100
    wanted = re.compile(r"[A-Za-z0-9._\[\]-]+==\S+.*--hash=sha256:[0-9a-f]{64}")
    site = entries(root / "docs/environment.lock")
    assert [row for row in [*lock.values(), *site.values()] if not wanted.match(row)] == []


def test_the_site_is_built_with_the_same_versions(root, lock):
    site = entries(root / "docs/environment.lock")
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


def test_no_job_needs_a_network(root, tmp_path):
    """A real target in a namespace without any network: from the background to the table."""
    unshare = shutil.which("unshare")
    alone = [unshare or "", "--net", "--map-root-user"]
    if not unshare or subprocess.run([*alone, "true"], capture_output=True).returncode:
        pytest.skip("unshare --net is not there or not permitted on this machine")
    for name in ("Snakefile", "config", "environment.lock", "workflow"):
        source = root / name
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, tmp_path / name)
    shutil.copytree(root / "tests/sample", tmp_path / "tests/sample")
    target = "results/sample/foam_block/kinect/support_plane.json"
    command = ["-m", "snakemake", "--profile", "workflow/profiles/default"]
    sample = ["--configfile", "tests/sample/config.yaml", "--", target]
    done = subprocess.run(
        [*alone, sys.executable, *command, *sample], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / target).is_file()


def planned(root, *names):
    """Words of the command that make would run."""
    command = ["make", "--no-print-directory", "--dry-run", "--old-file", ".venv/installed"]
    # The tests may be run by a make, which hands its own options on.
    own = {
        name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFL"))
    }
    done = subprocess.run(
        [*command, "check", *names], cwd=root, env=own, capture_output=True, text=True, check=True
    )
    return shlex.split(done.stdout.replace("\\\n", ""))


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("name", ["toy_cow", "My Cow", "O'Brien", "a;b", "%"])
def test_an_objects_name_goes_to_the_check_as_one_word_and_without_one_all_are_checked(root, name):
    assert planned(root, f"object={name}")[-2:] == ["check", f"raw/{name}"]
    assert planned(root)[-1] == "check"
