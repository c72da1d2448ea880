"""Kill runs of the sample at random moments, and see whether plain runs come to the same bytes.

Used as ``python tools/faults.py results/faults.md --kills 50`` (``make faults kills=50``). A run is
started, something of it is killed with ``kill -9``, the same plain command is given again, and so
on until one finishes; then its results are held to those of an undisturbed run, all is thrown away,
and the next pass begins. No command but ``snakemake -j2 --configfile tests/sample/config.yaml``,
with the same targets each time, is ever given.
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
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = "results/sample"
COMMAND = [sys.executable, "-m", "snakemake", "-j2", "--configfile", "tests/sample/config.yaml"]
LEFT_BEHIND = shutil.ignore_patterns(
    ".git", ".venv", "results", "raw", ".snakemake", "__pycache__", ".*_cache"
)
KINDS = ("snakemake", "job", "group")
# Run times and logs differ from run to run; hidden files are the run's own.
NOT_RESULTS = ("benchmarks", "logs")
JOB_SCRIPT = re.compile(r"\.snakemake/scripts/tmp\w+\.(\w+)\.py$")
STARTED = re.compile(r"^\d+:\d\d:\d\d  (\d+) of (\d+) steps")
# A kill falls this long after a job began, at most; one in six while the run is still starting.
LATEST_S, IN_START = 6.0, 1 / 6
# Share of the runs that are struck again while they deal with a job that was killed.
TWICE = 0.6
ORPHANS_END_S = 30.0
GIVE_UP_S = 1800.0


@dataclass
class Kill:
    """One kill and what it met."""

    number: int
    attempt: int
    kind: str
    moment_s: float
    done: str
    running: list[str]
    outcome: str


@dataclass
class Run:
    """A run of Snakemake in a session of its own, and what it says."""

    folder: Path
    targets: list[str]
    lines: list[str] = field(default_factory=list)
    begun: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.start = time.monotonic()
        self.process = subprocess.Popen(
            [*COMMAND, *(["--", *self.targets] if self.targets else [])],
            cwd=self.folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.process.stderr:
            self.lines.append(line.rstrip())
            if STARTED.match(line):
                self.begun.set()

    @property
    def age_s(self) -> float:
        """Time since the start [s]."""
        return time.monotonic() - self.start

    @property
    def done(self) -> str:
        """Steps done of those that the run had to do, as it last said."""
        found = [match for line in self.lines if (match := STARTED.match(line))]
        return f"{found[-1][1]} of {found[-1][2]}" if found else "-"

    def jobs(self) -> list[psutil.Process]:
        """Scripts that run, as children of Snakemake."""
        try:
            children = psutil.Process(self.process.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            return []
        return [child for child in children if _rule_of(child)]

    def wait(self) -> int:
        """Exit status, once the run ended."""
        status = self.process.wait(timeout=GIVE_UP_S)
        self.reader.join(timeout=5)
        return status

    def errors(self) -> list[str]:
        """What it said of jobs that failed."""
        return [line for line in self.lines if line.startswith("error: ")]

    def ended_within(self, seconds: float) -> bool:
        """Whether the run ends by itself in a time."""
        try:
            self.process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            return False
        return True


def _rule_of(process: psutil.Process) -> str:
    try:
        found = [match for word in process.cmdline() if (match := JOB_SCRIPT.search(word))]
    except psutil.NoSuchProcess:
        return ""
    return found[0][1] if found else ""


def make_copy(folder: Path) -> Path:
    """Copy the project and the sample's captures, without results."""
    shutil.copytree(ROOT, folder, ignore=LEFT_BEHIND)
    shutil.copytree(ROOT / "tests/sample/raw", folder / "tests/sample/raw", dirs_exist_ok=True)
    return folder


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
    """Parts of files that nobody removed, and files that Snakemake still holds for unfinished."""
    parts = [str(path) for path in (folder / SAMPLE).rglob(".part-*")]
    marks = [path for path in (folder / ".snakemake/incomplete").rglob("*") if path.is_file()]
    return parts + [str(path) for path in marks]


def forget(folder: Path) -> None:
    """Throw all results away."""
    shutil.rmtree(folder / SAMPLE, ignore_errors=True)
    shutil.rmtree(folder / ".snakemake", ignore_errors=True)


def strike(run: Run, kind: str, rng: random.Random) -> tuple[list[str], list[psutil.Process]]:
    """Kill, and tell which rules were running and which of their processes should end by now."""
    jobs = run.jobs()
    rules = [_rule_of(job) for job in jobs]
    if kind == "job" and jobs:
        with suppress(psutil.NoSuchProcess):
            rng.choice(jobs).kill()
        return rules, []
    if kind == "group":
        os.killpg(run.process.pid, signal.SIGKILL)
    else:
        run.process.kill()
    return rules, jobs


def record(run: Run, kind: str, kills: list[Kill], *, attempt: int, rng: random.Random) -> None:
    """Strike, and write down what came of it."""
    moment, done, errors = run.age_s, run.done, run.errors()
    running, orphans = strike(run, kind, rng)
    told = outcome_of(run, kind, orphans, after=len(errors))
    kills.append(Kill(len(kills) + 1, attempt, kind, moment, done, running, told))
    print(f"{kills[-1]}", flush=True)


def outcome_of(run: Run, kind: str, orphans: list[psutil.Process], *, after: int) -> str:
    """What a run said of a killed job, or when the last of its jobs ended after it was killed."""
    start = time.monotonic()
    if kind == "job":
        while len(run.errors()) == after and time.monotonic() < start + ORPHANS_END_S:
            if run.ended_within(0.1):
                run.wait()
                break
        told = run.errors()[after:]
        return told[-1].rstrip(":") if told else "it had just ended"
    run.wait()
    _, alive = psutil.wait_procs(orphans, timeout=ORPHANS_END_S)
    if alive:
        return f"{len(alive)} jobs lived on for {ORPHANS_END_S:.0f} s"
    return f"its jobs ended within {time.monotonic() - start:.1f} s" if orphans else "no jobs"


def one_pass(folder, targets, kills, *, attempt, budget, rng) -> str:
    """Kill runs until one finishes; a run that gets nowhere twice is left alone until it does."""
    stuck, last = 0, None
    while True:
        run = Run(folder, targets)
        wanted = len(kills) < budget
        early = wanted and rng.random() < IN_START
        if early:
            run.ended_within(rng.uniform(0.2, 5.0))
        while wanted and not early and not run.begun.wait(0.2) and run.process.poll() is None:
            pass
        if wanted and stuck >= 2:
            _until_a_step_more(run)
            stuck = 0
        if not wanted or run.ended_within(0 if early else rng.uniform(0, LATEST_S)):
            return "" if run.wait() == 0 else "\n".join(run.lines[-30:])
        done = run.done
        if rng.random() < TWICE and run.jobs():
            record(run, "job", kills, attempt=attempt, rng=rng)
            run.ended_within(rng.uniform(0, LATEST_S / 3))
        if run.process.poll() is None and len(kills) < budget:
            kind = KINDS[len(kills) % len(KINDS)]
            kind = "snakemake" if kind == "job" and not run.jobs() else kind
            record(run, kind, kills, attempt=attempt, rng=rng)
        run.wait()
        left = done.rpartition(" ")[2]
        stuck = stuck + 1 if left == last and left != "-" else 0
        last = left


def _until_a_step_more(run: Run) -> None:
    done = run.done
    while run.done == done and run.process.poll() is None:
        time.sleep(0.2)


def table(kills: list[Kill], verdicts: list[str]) -> str:
    """Markdown of all kills, below what came of each pass."""
    rows = [
        f"| {k.number} | {k.attempt} | {k.kind} | {k.moment_s:.1f} | {k.done} "
        f"| {', '.join(k.running) or '-'} | {k.outcome} |"
        for k in kills
    ]
    head = "| kill | pass | killed | after (s) | steps done | jobs running | outcome |"
    counts = ", ".join(f"{sum(k.kind == kind for k in kills)} {kind}" for kind in KINDS)
    title = f"# Faults\n\n{len(kills)} kills with signal 9 ({counts}) of runs of the sample."
    return "\n".join([title, "", *verdicts, "", head, "|---" * 7 + "|", *rows, ""])


def main() -> int:
    """Run the passes; 1 if any came to other bytes, left something behind, or did not finish."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", type=Path, help="where the table goes")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--targets", nargs="*", default=[], help="files of the sample; else all")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    kills, verdicts, failed = [], [], False
    with tempfile.TemporaryDirectory(prefix="palpate-faults-") as place:
        folder = make_copy(Path(place) / "main")
        if Run(folder, options.targets).wait():
            raise SystemExit("faults: expected the undisturbed run to finish, found it failed")
        wanted = digests(folder)
        while len(kills) < options.kills:
            forget(folder)
            attempt, before = len(verdicts) + 1, len(kills)
            said = one_pass(
                folder, options.targets, kills, attempt=attempt, budget=options.kills, rng=rng
            )
            verdict = said or _compared(wanted, digests(folder), leftovers(folder))
            failed |= "same bytes" not in verdict
            verdicts.append(f"- pass {attempt}, {len(kills) - before} kills: {verdict}")
            print(verdicts[-1], flush=True)
            options.target.parent.mkdir(parents=True, exist_ok=True)
            options.target.write_text(table(kills, verdicts), encoding="utf-8")
    return int(failed)


def _compared(wanted: dict[str, str], found: dict[str, str], left: list[str]) -> str:
    other = sorted(name for name in wanted | found if wanted.get(name) != found.get(name))
    if other or left:
        return f"differs: {', '.join(other)}; left behind: {', '.join(left)}"
    return f"finished, {len(wanted)} results of the same bytes, nothing left behind"


if __name__ == "__main__":
    sys.exit(main())
