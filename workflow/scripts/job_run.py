"""What a job has to do with its run: it ends with it, and its inputs stay as the run found them."""

import json
import os
import platform
import select
import threading
import time
from pathlib import Path

from palpate.capture.fingerprint import stamp

# Process and host of the Snakemake that runs a job; file of what stood there when its run began.
OWNER = "PALPATE_RUN_PID"
INPUTS = "PALPATE_RUN_INPUTS"
POLL_S = 1.0


def own_run() -> None:
    """Make this process the one that jobs end with; it ends with the job that it is part of."""
    end_with_run()
    os.environ[OWNER] = f"{os.getpid()} {platform.node()}"


def end_with_run() -> None:
    """End this process as soon as the run's Snakemake, or this process's parent, has ended.

    Without it a job would go on after ``kill -9`` of its run, and write its results at some time
    into those of the next. A process that no run started is left alone; on the node of a cluster it
    is the node's own Snakemake that counts.
    """
    if OWNER not in os.environ:
        return
    owner, host = os.environ[OWNER].split(" ", 1)
    here = {int(owner)} if host == platform.node() else set()
    wait = _wait if hasattr(os, "pidfd_open") else _poll
    threading.Thread(target=wait, args=(sorted(here | {os.getppid()}),), daemon=True).start()


def _wait(owners: list[int]) -> None:
    """Sleep until one of some processes ends; then end too, without a last word."""
    try:
        ends = [os.pidfd_open(pid) for pid in owners]
    except ProcessLookupError:
        os._exit(1)
    select.select(ends, [], [])
    os._exit(1)


def _poll(owners: list[int]) -> None:
    """Do the same on a system without descriptors of processes."""
    try:
        while True:
            for pid in owners:
                os.kill(pid, 0)
            time.sleep(POLL_S)
    except ProcessLookupError:
        os._exit(1)


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
        expected = json.loads(begun.read_text(encoding="utf-8")) if begun.is_file() else {}
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
