"""How long a run still takes: by what its jobs took the last time, and by how fast it goes now."""

import csv
import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

# The last run's times weigh as much as this part of the run at hand.
BEFORE = 0.1
# Nothing is said before this part of the work, known from before or done, tells how fast it goes.
LEAST = 0.05
MINUTE_S = 60.0


@dataclass(frozen=True)
class Pace:
    """What the jobs of a run are expected to take.

    Attributes
    ----------
    expected_s : mapping of int to float
        By job [s]; where no job of the kind ran before only their shares mean something.
    measured : bool
        Whether any ran before.
    cores : int
        For the run.
    """

    expected_s: Mapping[int, float]
    measured: bool
    cores: int = 1

    def left_s(self, finished: Collection[int], gone_s: float) -> float | None:
        """Time that is left [s]; None where nothing tells it yet.

        Parameters
        ----------
        finished : collection of int
            Jobs that are done.
        gone_s : float
            Since the run began [s].
        """
        whole = sum(self.expected_s.values())
        done = sum(self.expected_s.get(job, 0.0) for job in finished)
        known = BEFORE * whole if self.measured else 0.0
        if whole <= 0 or done + known < LEAST * whole:
            return None
        return (whole - done) * (gone_s + known / self.cores) / (done + known)


def pace_of(jobs: Iterable[Any], *, benchmarks: Path, cores: int | None) -> Pace:
    """Pace of a run that begins.

    A job that ran before is taken to last as long again, another one as the others of its rule on
    the average, and one of a new rule as all of them.

    Parameters
    ----------
    jobs : iterable
        Snakemake's, that are to run.
    benchmarks : Path
        Folder with ``<rule>.tsv`` and ``<rule>/<job>.tsv`` of the last run.
    cores : int or None
        For the run; None where a cluster's scheduler knows.
    """
    there = [job for job in jobs if job.benchmark]
    usual = {name: _mean(_of_rule(benchmarks, name)) for name in {job.rule.name for job in there}}
    own = {job.jobid: benchmark_s(Path(job.benchmark)) for job in there}
    found = {job.jobid: _first(own[job.jobid], usual[job.rule.name]) for job in there}
    all_jobs = _mean(found.values())
    expected = {job: _first(value, all_jobs, 1.0) for job, value in found.items()}
    return Pace(expected, all_jobs is not None, cores or 1)


def benchmark_s(path: Path) -> float | None:
    """Time of a job by its benchmark [s]; None where there is none that can be read."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            head, *_, last = csv.reader(stream, delimiter="\t")
        value = float(last[head.index("s")])
    except (OSError, ValueError, IndexError):
        return None
    return value if math.isfinite(value) else None


def told_left(left_s: float | None) -> str:
    """What a line says of it, with a comma before.

    >>> told_left(700.0), told_left(20.0), told_left(None)
    (', about 12 min left', ', less than a minute left', '')
    """
    if left_s is None:
        return ""
    minutes = math.ceil(left_s / MINUTE_S)
    return f", about {minutes} min left" if minutes > 1 else ", less than a minute left"


def _of_rule(benchmarks: Path, rule: str) -> list[float | None]:
    files = [benchmarks / f"{rule}.tsv", *(benchmarks / rule).rglob("*.tsv")]
    return [benchmark_s(path) for path in files]


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def _first(*values: float | None) -> float | None:
    return next((value for value in values if value is not None), None)
