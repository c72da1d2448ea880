"""Memory and time that the SLURM profile asks for each rule, from the benchmarks of a full run."""

import math
import sys
from pathlib import Path

import pandas as pd

from palpate.capture.files import whole_file
from palpate.run.resources import resource_table

MARK = "set-resources: # measured: make slurm-resources\n"
# Asked for, over what the largest job of a rule took.
MEMORY_MARGIN, TIME_MARGIN = 1.5, 2.0
# Of the two Snakemakes around a job on its node: their memory, and the time to read the workflow.
AROUND_MB, AROUND_MINUTES = 400, 2
STEP_MB = 100
# Each retry asks for twice as much.
DOUBLED = "{} * 2 ** (attempt - 1)"


def requests(benchmarks: Path) -> dict[str, tuple[int, int]]:
    """Give what to ask for each rule of a run.

    Parameters
    ----------
    benchmarks : Path
        Folder of a run's benchmarks.

    Returns
    -------
    dict
        Memory [MB] and time [min] by rule, in order of the names.

    Raises
    ------
    ValueError
        If the folder holds no benchmark, or one lacks a column.
    """
    table = resource_table(benchmarks)
    rules = table[table["rule"] != "total"].sort_values("rule")
    return {
        row.rule: (_memory_mb(row.peak_memory_mb), _minutes(row.largest_s))
        for row in rules.itertuples()
    }


def _memory_mb(peak_mb: float) -> int:
    """Too short a job was never sampled; it still holds an interpreter."""
    peak_mb = 0.0 if pd.isna(peak_mb) else peak_mb
    return math.ceil((MEMORY_MARGIN * peak_mb + AROUND_MB) / STEP_MB) * STEP_MB


def _minutes(longest_s: float) -> int:
    return math.ceil(TIME_MARGIN * longest_s / 60) + AROUND_MINUTES


def block(wanted: dict[str, tuple[int, int]]) -> str:
    """Write the requests as the profile's last entry."""
    lines = [
        f"  {rule}: {{mem_mb: {DOUBLED.format(memory)}, runtime: {DOUBLED.format(minutes)}}}\n"
        for rule, (memory, minutes) in wanted.items()
    ]
    return MARK + "".join(lines)


def with_block(profile: str, text: str) -> str:
    """Put the requests in place of those that a profile ends with.

    Raises
    ------
    ValueError
        If the profile has no such entry.
    """
    head, mark, _ = profile.partition(MARK)
    if not mark:
        raise ValueError(f"profile: expected the line {MARK.strip()}, found none")
    return head + text


def main(benchmarks: Path, profile: Path) -> None:
    """Measure anew what the profile asks for."""
    text = with_block(profile.read_text(encoding="utf-8"), block(requests(benchmarks)))
    with whole_file(profile) as part:
        part.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    try:
        main(*map(Path, sys.argv[1:]))
    except (OSError, ValueError) as error:
        sys.exit(f"error: slurm: {error}")
