"""What the Makefile hands on to the commands that it runs."""

import os
import shlex
import shutil
import subprocess

import pytest


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
def test_an_objects_name_goes_to_the_check_as_one_word(root, name):
    assert planned(root, f"object={name}")[-2:] == ["check", f"raw/{name}"]


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_without_a_name_all_are_checked(root):
    assert planned(root)[-1] == "check"
