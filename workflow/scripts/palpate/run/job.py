"""What every script of the workflow shares: its log, its thread count, one line per error."""

import cProfile
import logging
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path
from types import TracebackType
from typing import TextIO

from palpate.run.job_run import THREADS, Inputs, end_with_run

# One thread whatever is exported: sums in another order would change the results' bytes.
os.environ |= dict.fromkeys(THREADS, "1")
# Before the script's other imports, which take seconds.
end_with_run()
# Folder for a profile of each job, where it is set (docs/performance.md).
PROFILES = "PALPATE_PROFILES"


def run(main: Callable, snakemake: object) -> None:
    """Run a script's main function with its output in the rule's log.

    Bad input (a `ValueError` or a file that can't be read or written) ends the job with one line
    on the terminal and in the log, and so does input that is changed while the job reads it; of
    any other exception see `tell_defect`. The job ends when its run does.

    Parameters
    ----------
    main : callable
        Takes the ``snakemake`` object of the script.
    snakemake : object
        The job, as Snakemake hands it to scripts.
    """
    # Lines that a full disk has no space for are told at the end, once.
    logging.raiseExceptions = False
    refused = None
    try:
        with _log(snakemake) as stream:
            try:
                _on_steady_inputs(main, snakemake)
            except (ValueError, OSError) as error:
                refused = _line(error, snakemake)
                stream.write(refused)
    except OSError as error:
        refused = refused or _line(
            OSError(error.errno, error.strerror, str(snakemake.log)), snakemake
        )
    if refused:
        sys.stderr.write(refused)
        sys.exit(1)


def _on_steady_inputs(main: Callable, snakemake: object) -> None:
    """Run the main function; what it made of inputs that changed meanwhile is taken away."""
    inputs = Inputs(snakemake.input)
    try:
        _profiled(main, snakemake)
    except (ValueError, OSError):
        inputs.require_unchanged()
        raise
    try:
        inputs.require_unchanged()
    except ValueError:
        for path in map(Path, snakemake.output):
            if path.is_file():
                path.unlink()
        raise


def _profiled(main: Callable, snakemake: object) -> None:
    folder = os.environ.get(PROFILES)
    if not folder:
        main(snakemake)
        return
    profile = cProfile.Profile()
    profile.runcall(main, snakemake)
    Path(folder).mkdir(parents=True, exist_ok=True)
    name = "-".join([snakemake.rule, *map(str, snakemake.wildcards)]).replace("/", "-")
    profile.dump_stats(Path(folder, f"{name}.prof"))


def tell_defect(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Say in one line what ends a script that expected no such thing; its log has the traceback.

    It stands for ``sys.excepthook``, so that imports that fail come here too.
    """
    snakemake = getattr(sys.modules["__main__"], "snakemake", None)
    if snakemake is None:
        sys.__excepthook__(kind, error, trace)
        return
    if not issubclass(kind, Exception):  # Ctrl-C: Snakemake says so once
        return
    lines = "".join(traceback.format_exception(kind, error, trace))
    told = _line(
        f"{kind.__name__}: {error}", snakemake, where=f"a defect; traceback in {snakemake.log}"
    )
    with suppress(OSError):
        log = Path(str(snakemake.log))
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a", encoding="utf-8") as stream:
            stream.write(lines + told)
    sys.stderr.write(told)


sys.excepthook = tell_defect


def _line(error: object, snakemake: object, *, where: str = "") -> str:
    place = "/".join([snakemake.rule, *map(str, snakemake.wildcards)])
    text = " ".join(str(error).split())
    return f"error: {place}: {text} ({where or f'log: {snakemake.log}'})\n"


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
    """Put a file's name before what a block finds wrong with its content.

    Parameters
    ----------
    path : path
        The file to look into. Messages that begin with it already stay as they are.
    fields : str
        Name the file only in messages about these of its fields; in all if none is given.

    Raises
    ------
    ValueError
        That of the block, as ``<path>: <message>``.
    """
    try:
        yield
    except ValueError as error:
        text = str(error)
        others = fields and not text.startswith(fields)
        if others or text.startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {text}") from error
