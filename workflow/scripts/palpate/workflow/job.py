"""What every script of the workflow shares: its log, one line per error, its end with the run."""

import ctypes
import logging
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TextIO

from palpate.capture.discover import stamp

# Process of the Snakemake that a job ends with.
OWNER = "PALPATE_RUN_PID"
PR_SET_PDEATHSIG = 1  # prctl(2): the kernel sends this process a signal when its parent ends
POLL_S = 1.0


def run(main: Callable, snakemake: object) -> None:
    """Run a script's main function, which takes ``snakemake``, with its output in the rule's log.

    Whatever goes wrong ends the job with one line on the terminal and in the log: bad input (a
    `ValueError`, or a file that can't be read or written), input that changes while the job reads
    it, and any other exception, whose traceback is in the log alone. A job ends with its run.
    """
    _end_with_run()
    # Lines that a full disk has no space for are reported at the end, once.
    logging.raiseExceptions = False
    line = ""
    try:
        with _log(snakemake) as stream:
            try:
                _on_steady_inputs(main, snakemake)
            except (ValueError, OSError) as error:
                line = _line(error, snakemake)
            except KeyboardInterrupt:  # Snakemake says so once
                stream.write(_line("stopped", snakemake))
                sys.exit(1)
            except Exception as error:
                traceback.print_exc(file=stream)
                text = f"{type(error).__name__}: {error}"
                line = _line(text, snakemake, where="a defect; traceback in")
            stream.write(line)
    except OSError as error:
        line = line or _line(OSError(error.errno, error.strerror, str(snakemake.log)), snakemake)
    if line:
        sys.stderr.write(line)
        sys.exit(1)


def _end_with_run() -> None:
    """End this process as soon as the run's Snakemake has ended, by ``kill -9`` too.

    It would write its results at some time into those of the next run. A process that no run
    started is left alone.
    """
    owner = int(os.environ.get(OWNER, "0"))
    if owner and sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    # Between them may be a shell, of an environment that is activated first.
    if owner and os.getppid() != owner:
        threading.Thread(target=_outlive, args=(owner,), daemon=True).start()


def _outlive(owner: int) -> None:
    while True:
        try:
            os.kill(owner, 0)
        except ProcessLookupError:
            os._exit(1)
        time.sleep(POLL_S)


def _on_steady_inputs(main: Callable, snakemake: object) -> None:
    """Run the main function; where its inputs change meanwhile, that is what went wrong.

    Dropped folders (the parameter ``content``) are compared with what they were at the checks.
    """
    before = {str(path): stamp(path) for path in snakemake.input if isinstance(path, (str, Path))}
    before |= snakemake.params.get("content", {})
    try:
        main(snakemake)
    finally:
        for path, found in before.items():
            if stamp(path) != found:
                expected = "expected to stay as it is during the run"
                raise ValueError(f"{path}: {expected}, found it changed; run again")


def _line(error: object, snakemake: object, *, where: str = "log:") -> str:
    place = "/".join([snakemake.rule, *map(str, snakemake.wildcards)])
    return f"error: {place}: {' '.join(str(error).split())} ({where} {snakemake.log})\n"


@contextmanager
def _log(snakemake: object) -> Iterator[TextIO]:
    """Everything that is logged or printed goes into the rule's log."""
    log = Path(str(snakemake.log))
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as stream, redirect_stdout(stream):
        logging.basicConfig(stream=stream, level=logging.INFO, format="%(message)s", force=True)
        yield stream


@contextmanager
def naming(path: object, *fields: str) -> Iterator[None]:
    """Put a file's name before the `ValueError` of a block that finds its content wrong.

    Messages that begin with it stay as they are, and, where ``fields`` are given, those about
    others.
    """
    try:
        yield
    except ValueError as error:
        text = str(error)
        others = fields and not text.startswith(fields)
        if others or text.startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {text}") from error
