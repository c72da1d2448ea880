"""What every script of the workflow shares: its log, its thread count, one line per error."""

import logging
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

# One thread whatever is exported: sums in another order would change the results' bytes.
for _variable in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
):
    os.environ[_variable] = "1"


def run(main: Callable, snakemake: object) -> None:
    """Run a script's main function with its output in the rule's log.

    Bad input (a `ValueError` or a file that can't be read) ends the job with one line on the
    terminal and in the log; any other exception is a defect and keeps its traceback.

    Parameters
    ----------
    main : callable
        Takes the ``snakemake`` object of the script.
    snakemake : object
        The job, as Snakemake hands it to scripts.
    """
    log = Path(str(snakemake.log))
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as stream, redirect_stdout(stream):
        logging.basicConfig(stream=stream, level=logging.INFO, format="%(message)s", force=True)
        try:
            main(snakemake)
        except (ValueError, OSError) as error:
            place = "/".join([snakemake.rule, *map(str, snakemake.wildcards)])
            line = f"error: {place}: {' '.join(str(error).split())}"
            stream.write(line + "\n")
            sys.stderr.write(line + "\n")
            sys.exit(1)
        except Exception:
            traceback.print_exc(file=stream)
            raise


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
