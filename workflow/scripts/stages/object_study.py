"""One object, by the ordinary workflow: a Snakemake of its own on the node where this job runs."""

import os
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import yaml
from palpate.capture.files import whole_file
from palpate.run.job import run
from palpate.run.job_run import owned
from palpate.run.object_config import object_config

ROOT = Path(__file__).resolve().parents[3]
PROFILE = ROOT / "workflow" / "profiles" / "slurm"


def main(snakemake):
    """Run the object, and hand on its summary.csv."""
    folder = Path(snakemake.params.folder)
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / "config.yaml") as part:
        own = object_config(snakemake.config, snakemake.wildcards.object, str(folder))
        text = yaml.safe_dump(own, sort_keys=False, allow_unicode=True)
        part.write_text(text, encoding="utf-8")
    done = subprocess.run(
        command(snakemake, folder),
        stdout=sys.stdout,
        stderr=sys.stdout,
        env=owned({k: v for k, v in os.environ.items() if k != "SNAKEMAKE_PROFILE"}),
        check=False,
    )
    if done.returncode:
        raise ValueError(first_error(Path(str(snakemake.log))))
    with whole_file(snakemake.output.summary) as part:
        shutil.copyfile(folder / "summary.csv", part)


def command(snakemake: object, folder: Path) -> list[str]:
    """Give the command of the object's own run, within this job's cores and memory."""
    job = snakemake.resources
    return [
        *(sys.executable, "-m", "snakemake", "--executor", "local", "--retries", "0"),
        *("--snakefile", str(ROOT / "Snakefile"), "--workflow-profile", str(PROFILE)),
        *("--configfile", str(folder / "config.yaml"), "--cores", str(snakemake.threads)),
        *("--resources", f"mem_mb={job.mem_mb}"),
        *("--", *(str(folder / name) for name in snakemake.params.wanted)),
    ]


def first_error(log: Path) -> str:
    """What the object's run says went wrong first."""
    text = log.read_text(encoding="utf-8", errors="replace").splitlines()
    found = [line.removeprefix("error: ") for line in text if line.startswith("error: ")]
    # What stops a run before its first job stands indented below the name of the exception.
    found += [below.strip() for line, below in pairwise(text) if line.startswith("WorkflowError")]
    return found[0] if found else f"{log}: run: expected moduli, found a failed job"


run(main, snakemake)
