"""How a run of Snakemake begins: what its jobs find, its locks, and how it shows its progress."""

import errno
import fcntl
import logging
import os
import platform
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.capture.files import remove_parts
from palpate.workflow.job import OWNER
from palpate.workflow.places import refuse
from palpate.workflow.progress import Pace, Terminal
from palpate.workflow.run import Run

# Freed by the kernel (flock) when the process that holds it ends, however it ends: a run that was
# killed leaves nothing to be unlocked by hand.
LOCK = ".run.lock"
NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
# Of the locks of this process: closed by its end and by nothing else.
_descriptors: list[int] = []
# One thread: sums in another order would change the results' bytes.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
# Of glibc: what a job frees it keeps, as it soon wants as much again. Handed back, each page of a
# large array is zeroed anew by the kernel, 2 to 4 % of a long job's time.
KEEP_FREED = {
    "MALLOC_MMAP_THRESHOLD_": str(32 * 2**20),
    "MALLOC_TRIM_THRESHOLD_": str(2**30),
    "MALLOC_TOP_PAD_": str(32 * 2**20),
}


def environment(scripts: str) -> dict[str, str]:
    """Give what this Snakemake's jobs find in their environment, the folder of scripts among it."""
    paths = [scripts, *filter(None, [os.environ.get("PYTHONPATH")])]
    found = {"PYTHONPATH": os.pathsep.join(dict.fromkeys(paths)), OWNER: str(os.getpid())}
    return found | dict.fromkeys(THREADS, "1") | KEEP_FREED


def start_run(workflow: Any, run: Run, logger: logging.Logger) -> None:
    """Lock the folders that a run writes into, and show one line a job from now on.

    What killed jobs left there is removed; what people import into other folders of ``raw/`` at
    this time is theirs. Where another run is at work this one ends with one line. ``workflow`` and
    ``logger`` are Snakemake's: 9.27 has what is used of them.
    """
    results, made = run.paths["results"], run.lab_folders
    try:
        for folder in [results, *([run.paths["raw"]] if made else [])]:
            lock_folder(folder, warn=logger.warning)
    except ValueError as error:
        refuse(error)
    for folder in [results, *made]:
        remove_parts(folder, unless=LOCK)
    if workflow.local_exec:
        # With it each pass of the scheduler starts a clock that makes another: decisions.md.
        workflow.scheduler.job_rate_limiter = None
    jobs = Counter(job.rule.name for job in workflow.dag.needrun_jobs())
    pace = Pace(jobs, Path(results, "benchmarks"), workflow.resource_settings.cores or 1)
    for handler in [one for one in logger.handlers if one.name == "DefaultStreamHandler"]:
        if logger.level >= logging.INFO:
            logger.removeHandler(handler)
            logger.addHandler(Terminal(handler, pace, Path(results, "logs/progress.log")))


def lock_folder(folder: str, *, warn: Callable[[str], None]) -> None:
    """Hold a folder until this process ends; ``warn`` of a file system that has no locks.

    A `ValueError` if the folder can't be written to, or another process holds it.
    """
    path = Path(folder) / LOCK
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _descriptors.append(descriptor := os.open(path, os.O_RDWR | os.O_CREAT, 0o666))
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode(), 0)
    except BlockingIOError:
        holder = path.read_text(encoding="utf-8", errors="replace").strip() or "just begun"
        raise ValueError(f"{folder}: expected no other run at work, found one ({holder})") from None
    except OSError as error:
        if error.errno not in NO_LOCKS:
            reason = (error.strerror or str(error)).lower()
            raise ValueError(f"{folder}: expected a folder to write into, found {reason}") from None
        warn(f"{folder}: this file system has no locks; see that no other run works on it")
