"""What every script of the workflow shares: its log, its thread count, one line per error."""

import logging
import os
import sys
import traceback
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path

# Before NumPy is imported: a job uses the threads its rule asks for, and no more.
for _variable in (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENCV_FOR_THREADS_NUM",
):
    os.environ.setdefault(_variable, "1")


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
