"""What the Makefile hands on to the commands that it runs."""

import shlex
import shutil
import subprocess

import pytest


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
@pytest.mark.parametrize("name", ["toy_cow", "My Cow", "O'Brien", "a;b", "%"])
def test_an_objects_name_goes_to_the_check_as_one_word(root, name):
    command = ["make", "--dry-run", "--old-file", ".venv/installed", "check", f"object={name}"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    assert shlex.split(done.stdout.replace("\\\n", ""))[-2:] == ["check", f"raw/{name}"]


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_without_a_name_all_are_checked(root):
    command = ["make", "--dry-run", "--old-file", ".venv/installed", "check"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    assert shlex.split(done.stdout.replace("\\\n", ""))[-1] == "check"
