"""What the SLURM profile asks for, from a full run's benchmarks: `make slurm-resources`."""

import math
import sys
from pathlib import Path

from palpate.workflow.resources import resource_table

MARK = "set-resources: # measured: make slurm-resources\n"
# Asked for, over what the largest job of a rule took.
MEMORY_MARGIN, TIME_MARGIN = 1.5, 2.0
# Of the two Snakemakes around a job on its node: their memory, and the time to read the workflow.
AROUND_MB, AROUND_MINUTES = 400, 2
STEP_MB = 100
# Each retry asks for twice as much.
LINE = "  {}: {{mem_mb: {} * 2 ** (attempt - 1), runtime: {} * 2 ** (attempt - 1)}}\n"


def requests(benchmarks: Path) -> str:
    """Give the profile's last entry: memory [MB] and time [min] of each rule."""
    table = resource_table(benchmarks)
    rules = table[table["rule"] != "total"].sort_values("rule")
    # Too short a job was never sampled; it still holds an interpreter.
    peaks_mb = MEMORY_MARGIN * rules["peak_memory_mb"].fillna(0.0) + AROUND_MB
    lines = [
        LINE.format(rule, math.ceil(mb / STEP_MB) * STEP_MB, math.ceil(minutes) + AROUND_MINUTES)
        for rule, mb, minutes in zip(
            rules["rule"], peaks_mb, TIME_MARGIN * rules["largest_s"] / 60, strict=True
        )
    ]
    return MARK + "".join(lines)


if __name__ == "__main__":
    profile = Path(sys.argv[2])
    head, mark, _ = profile.read_text(encoding="utf-8").partition(MARK)
    if not mark:
        sys.exit(f"error: {profile}: expected the line {MARK.strip()}, found none")
    try:
        profile.write_text(head + requests(Path(sys.argv[1])), encoding="utf-8")
    except ValueError as error:
        sys.exit(f"error: {error}")
