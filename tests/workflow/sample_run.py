"""Snakemake on a copy of the project."""

import os
import re
import shutil
import subprocess
import sys

SAMPLE = ("--configfile", "tests/sample/config.yaml")
LEFT_BEHIND = shutil.ignore_patterns(
    ".git", ".venv", "results", "raw", ".snakemake", "__pycache__", ".*_cache"
)


def snakemake(folder, *arguments):
    """Run Snakemake in a folder."""
    command = [sys.executable, "-m", "snakemake", "--profile", "workflow/profiles/default"]
    return subprocess.run(
        [*command, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
    )


def ran(folder, *arguments):
    """What a run says that succeeds."""
    done = snakemake(folder, *arguments)
    assert done.returncode == 0, (done.stdout + done.stderr)[-5000:]
    return done.stdout + done.stderr


def counted(told):
    """Rules of a dry-run's job statistics."""
    return set(re.findall(r"^(\w+) +\d+$", told, re.MULTILINE))


def copied(root, folder):
    """A copy of the project in which nothing ran yet."""
    shutil.copytree(root, folder, ignore=LEFT_BEHIND, dirs_exist_ok=True)
    shutil.copytree(root / "tests/sample/raw", folder / "tests/sample/raw", dirs_exist_ok=True)
    return folder
