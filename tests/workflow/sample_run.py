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


def counted(done):
    """Rules of a dry-run's job statistics."""
    return set(re.findall(r"^(\w+) +\d+$", done.stdout + done.stderr, re.MULTILINE))
