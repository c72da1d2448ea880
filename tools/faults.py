"""Kill runs of the sample at random moments, and see whether plain runs come to the same bytes.

Used as ``python tools/faults.py results/faults.md --kills 50`` (``make faults kills=50``). A run is
started, something of it is killed with ``kill -9``, the same plain command is given again, and so
on until one finishes; then its results are compared with those of an undisturbed run. What finishes
before all kills are made begins anew from nothing. No command but ``snakemake -j2 --configfile
tests/sample/config.yaml``, with the same targets each time, is ever given.
"""

import argparse
import hashlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = "results/sample"
COMMAND = [sys.executable, "-m", "snakemake", "-j2", "--configfile", "tests/sample/config.yaml"]
LEFT_BEHIND = shutil.ignore_patterns(
    ".git", ".venv", "results", "raw", ".snakemake", "__pycache__", ".*_cache"
)
# What is killed: Snakemake, one of its jobs, or all processes of the run.
KINDS = ("snakemake", "job", "group")
# Run times and logs differ from run to run; hidden files are the run's own.
NOT_RESULTS = ("benchmarks", "logs")
JOB_SCRIPT = re.compile(r"\.snakemake/scripts/tmp\w+\.(\w+)\.py$", re.MULTILINE)
STEPS = re.compile(r"^\d+:\d\d:\d\d  (\d+ of \d+) steps", re.MULTILINE)
# A kill falls this long after the run's start, at most; one in six before its first job.
LATEST_S, STARTING_S, IN_START = 40.0, 5.0, 1 / 6
ENDING_S, GIVE_UP_S = 30.0, 1800.0


class Run:
    """A run of Snakemake in a session of its own, and what it prints."""

    def __init__(self, folder: Path, targets: list[str]) -> None:
        self.log = folder / "run.log"
        command = [*COMMAND, *(["--", *targets] if targets else [])]
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                command, cwd=folder, stdout=log, stderr=log, start_new_session=True
            )

    def lines(self) -> list[str]:
        """What it has printed."""
        return self.log.read_text().splitlines()

    def steps(self) -> str:
        """Steps done of those that the run had to do, as last printed; - while it starts."""
        return (STEPS.findall(self.log.read_text()) or ["-"])[-1]

    def errors(self) -> list[str]:
        """What it printed of jobs that failed."""
        return [line for line in self.lines() if line.startswith("error: ")]

    def jobs(self) -> dict[psutil.Process, str]:
        """Scripts that run, as children of Snakemake, and their rules."""
        found, children = {}, []
        with suppress(psutil.NoSuchProcess):
            children = psutil.Process(self.process.pid).children(recursive=True)
        for child in children:
            with suppress(psutil.NoSuchProcess):
                if script := JOB_SCRIPT.search("\n".join(child.cmdline())):
                    found[child] = script[1]
        return found

    def ended(self, within_s: float = GIVE_UP_S) -> bool:
        """Whether it ends within a time."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(within_s)
        return self.process.returncode is not None


def strike(run: Run, kind: str, rng: random.Random) -> str:
    """Kill, and wait for what follows: cells of a row of the table, ending with the outcome."""
    jobs, before, steps = run.jobs(), len(run.errors()), run.steps()
    if kind == "job" and jobs:
        with suppress(psutil.NoSuchProcess):
            rng.choice(list(jobs)).kill()
        until = time.monotonic() + ENDING_S
        while len(run.errors()) == before and time.monotonic() < until and not run.ended(0.1):
            pass
        outcome = (run.errors()[before:] or ["it had just ended"])[-1]
    else:
        kind = "snakemake" if kind == "job" else kind
        os.killpg(run.process.pid, signal.SIGKILL) if kind == "group" else run.process.kill()
        run.ended()
        _, alive = psutil.wait_procs(list(jobs), timeout=ENDING_S)
        outcome = f"{len(alive)} jobs lived on for {ENDING_S:.0f} s" if alive else "its jobs ended"
    return f"{kind} | {steps} | {', '.join(jobs.values()) or '-'} | {outcome}"


def until_one_finishes(
    folder: Path, targets: list[str], kills: list[str], *, wanted: int, rng: random.Random
) -> str:
    """Kill runs until one ends by itself, and none after so many kills; why that one failed."""
    while True:
        run = Run(folder, targets)
        moment = rng.uniform(0.2, STARTING_S if rng.random() < IN_START else LATEST_S)
        all_made = len(kills) >= wanted
        if run.ended(GIVE_UP_S if all_made else moment):
            errors = "; ".join(run.errors()) or "no error line"
            return "" if run.process.returncode == 0 else f"failed: {errors}"
        if all_made:
            os.killpg(run.process.pid, signal.SIGKILL)
            return f"did not finish within {GIVE_UP_S:.0f} s"
        row = strike(run, KINDS[len(kills) % len(KINDS)], rng)
        kills.append(f"| {len(kills) + 1} | {moment:.1f} | {row} |")
        print(kills[-1], flush=True)
        run.ended()


def make_copy(folder: Path) -> Path:
    """Copy the project and the sample's captures, without results."""
    shutil.copytree(ROOT, folder, ignore=LEFT_BEHIND)
    shutil.copytree(ROOT / "tests/sample/raw", folder / "tests/sample/raw", dirs_exist_ok=True)
    return folder


def forget(folder: Path) -> None:
    """Remove all results."""
    for name in (SAMPLE, ".snakemake"):
        shutil.rmtree(folder / name, ignore_errors=True)


def digests(folder: Path) -> dict[str, str]:
    """SHA-256 of each result, by its path."""
    results = folder / SAMPLE
    names = {path: path.relative_to(results) for path in sorted(results.rglob("*"))}
    return {
        str(name): hashlib.sha256(path.read_bytes()).hexdigest()
        for path, name in names.items()
        if path.is_file() and name.parts[0] not in NOT_RESULTS and not name.name.startswith(".")
    }


def leftovers(folder: Path) -> list[str]:
    """Parts of files that nobody removed, and files that Snakemake still marks as incomplete."""
    marks = [path for path in (folder / ".snakemake/incomplete").rglob("*") if path.is_file()]
    return [str(path) for path in [*(folder / SAMPLE).rglob(".part-*"), *marks]]


def verdict_on(folder: Path, wanted: dict[str, str]) -> str:
    """How results differ from those of an undisturbed run, and what was left behind."""
    found, left = digests(folder), leftovers(folder)
    other = sorted(name for name in wanted | found if wanted.get(name) != found.get(name))
    if other or left:
        return f"differs: {', '.join(other)}; left behind: {', '.join(left)}"
    return f"finished, {len(wanted)} results of the same bytes, nothing left behind"


def main() -> int:
    """Kill and compare; 1 if a run came to other bytes, left something behind or did not finish."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("target", type=Path, help="where the table goes")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--targets", nargs="*", default=[], help="files of the sample; else all")
    options = parser.parse_args()
    rng, kills, verdicts = random.Random(options.seed), [], []
    head = "| kill | after (s) | killed | steps done | jobs running | outcome |"
    with tempfile.TemporaryDirectory(prefix="palpate-faults-") as place:
        folder = make_copy(Path(place) / "main")
        if not (first := Run(folder, options.targets)).ended() or first.process.returncode:
            sys.exit("faults: expected the undisturbed run to finish, found that it failed")
        wanted = digests(folder)
        while len(kills) < options.kills:
            forget(folder)
            failure = until_one_finishes(
                folder, options.targets, kills, wanted=options.kills, rng=rng
            )
            verdict = failure or verdict_on(folder, wanted)
            verdicts.append(f"- after kill {len(kills)}: {verdict}")
            print(verdicts[-1], flush=True)
            options.target.parent.mkdir(parents=True, exist_ok=True)
            lines = ["# Faults", "", *verdicts, "", head, "|---" * 6 + "|", *kills, ""]
            options.target.write_text("\n".join(lines), encoding="utf-8")
    lived = any("lived on" in kill for kill in kills)
    return int(lived or not all("same bytes" in line for line in verdicts))


if __name__ == "__main__":
    sys.exit(main())
