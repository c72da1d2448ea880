"""What a job has to do with its run: it ends with it, and its inputs stay as the run found them."""

import json
import os
import platform
import select
import threading
import time
from collections.abc import Mapping
from pathlib import Path

from palpate.capture.fingerprint import stamp

# Process and host of the Snakemake that runs a job; file of what stood there when its run began,
# and that run's number.
OWNER = "PALPATE_RUN_PID"
INPUTS = "PALPATE_RUN_INPUTS"
RUN = "PALPATE_RUN_ID"
# Of the libraries that would take more threads than one.
THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
)
# Of glibc: what a job frees it keeps, as it soon wants as much again. Handed back, each page of a
# large array is zeroed anew by the kernel, 2 to 4 % of a long job's time.
KEEP_FREED = {
    "MALLOC_MMAP_THRESHOLD_": str(32 * 2**20),
    "MALLOC_TRIM_THRESHOLD_": str(2**30),
    "MALLOC_TOP_PAD_": str(32 * 2**20),
}
POLL_S = 1.0
# Between looks at whether another run has begun: on a cluster all nodes ask the file server.
SUPERSEDED_S = 5.0


def own_run(scripts: str) -> None:
    """Make this process the one that jobs end with; it ends with the job that it is part of.

    Parameters
    ----------
    scripts : str
        Folder of the packages, for its jobs.
    """
    end_with_run()
    os.environ |= owned({})
    paths = [scripts, *filter(None, [os.environ.get("PYTHONPATH")])]
    os.environ["PYTHONPATH"] = os.pathsep.join(dict.fromkeys(paths))
    # Sums in another order would change the results' bytes.
    os.environ |= dict.fromkeys(THREADS, "1")
    os.environ |= KEEP_FREED


def owned(environment: Mapping[str, str]) -> dict[str, str]:
    """Give an environment whose processes end with this one."""
    return {**environment, OWNER: f"{os.getpid()} {platform.node()}"}


def end_with_run() -> None:
    """End this process as soon as the run's Snakemake, or this process's parent, has ended.

    Without it a job would go on after ``kill -9`` of its run, and write its results at some time
    into those of the next. A process that no run started is left alone. On the node of a cluster it
    is the node's own Snakemake that counts, and the number of the run: once another has begun on
    the same results, what the former still has on any node ends with one line.
    """
    if OWNER not in os.environ:
        return
    run = Run(os.environ.get(INPUTS, ""), os.environ.get(RUN, ""))
    run.end_if_superseded()
    owner, host = os.environ[OWNER].split(" ", 1)
    here = {int(owner)} if host == platform.node() else set()
    wait = _wait if hasattr(os, "pidfd_open") else _poll
    owners = sorted(here | {os.getppid()})
    threading.Thread(target=wait, args=(owners, run), daemon=True).start()


class Run:
    """The run that a job belongs to.

    Parameters
    ----------
    begun : path
        Where the last run on the same results has its number.
    number : str
        That of the job's own run; empty where there is none.
    """

    def __init__(self, begun: str | Path, number: str) -> None:
        self.begun, self.number = Path(begun), number
        self.seen: tuple | None = None

    def end_if_superseded(self) -> None:
        """End this process with one line if another run has begun since."""
        if self.number and (found := self._last()) not in (None, self.number):
            line = f"error: {self.begun}: expected run {self.number}, found run {found} begun since"
            os.write(2, f"{line}\n".encode())
            os._exit(1)

    def _last(self) -> str | None:
        """Number of the last run; None where the file is gone, or stands as it was."""
        try:
            status = self.begun.stat()
            seen = (status.st_ino, status.st_mtime_ns, status.st_size)
            if seen == self.seen:
                return None
            found = json.loads(self.begun.read_text(encoding="utf-8"))["run"]
        except (OSError, ValueError, LookupError, TypeError):
            return None
        self.seen = seen
        return str(found)


def _wait(owners: list[int], run: Run) -> None:
    """Sleep until one of some processes ends; then end too, without a last word."""
    try:
        ends = [os.pidfd_open(pid) for pid in owners]
    except ProcessLookupError:
        os._exit(1)
    except OSError:  # of a kernel or a container without them, or no descriptors left
        _poll(owners, run)
        return
    while not select.select(ends, [], [], SUPERSEDED_S)[0]:
        run.end_if_superseded()
    os._exit(1)


def _poll(owners: list[int], run: Run) -> None:
    """Do the same without descriptors of processes."""
    looked = time.monotonic()
    while all(map(_lives, owners)):
        time.sleep(POLL_S)
        if time.monotonic() - looked >= SUPERSEDED_S:
            looked = time.monotonic()
            run.end_if_superseded()
    os._exit(1)


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


class Inputs:
    """Inputs of a job, as they are when it begins.

    Parameters
    ----------
    paths : iterable
        Of files and folders; anything else is passed over.

    Raises
    ------
    ValueError
        If one is not as the run found it when it began.
    """

    def __init__(self, paths: object) -> None:
        names = [str(path) for path in paths if isinstance(path, (str, Path))]
        self.begun = {name: stamp(name) for name in names}
        begun = Path(os.environ.get(INPUTS, ""))
        expected = (
            json.loads(begun.read_text(encoding="utf-8"))["inputs"] if begun.is_file() else {}
        )
        for name, found in self.begun.items():
            if found != expected.get(name, found):
                raise ValueError(
                    f"{name}: expected as it was when the run began, found it changed; run again"
                )

    def require_unchanged(self) -> None:
        """Refuse inputs that were changed since the job began.

        Raises
        ------
        ValueError
            With the name of the first that was.
        """
        for name, begun in self.begun.items():
            if stamp(name) != begun:
                raise ValueError(
                    f"{name}: expected to stay while it is read, found it changed; run again"
                )
