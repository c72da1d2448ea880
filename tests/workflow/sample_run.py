"""Snakemake on a copy of the project."""

import os
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
