"""What a run took: time and memory of each rule, from Snakemake's benchmarks.

No two runs take the same, so the table is no rule's output: it is made after the run.
"""

import sys
from pathlib import Path

import pandas as pd

from palpate.capture.files import whole_file, write_text
from palpate.markdown import rows_of

# A report on the lab's errors, not a part of the lab.
NOT_LAB = "lab_fidelity"
# By column: that of the benchmarks, and what is made of a rule's jobs.
SUMS = {
    "jobs": ("s", "size"),
    "total_s": ("s", "sum"),
    "largest_s": ("s", "max"),
    "processor_s": ("cpu_time", "sum"),
    "peak_memory_mb": ("max_rss", "max"),
}
NOTE = (
    "Of the jobs' last runs, by Snakemake's benchmarks: times by the clock, added up over jobs that"
    " ran side by side and shared the machine with whatever else ran; processor times as sampled,"
    " which misses the ends of short jobs."
)


def resource_table(benchmarks: Path) -> pd.DataFrame:
    """Sum up ``<rule>.tsv`` and ``<rule>/<job>.tsv`` of a folder by rule: `SUMS` in s and MB.

    The longest total comes first; the totals of ``lab`` and ``pipeline`` are the last rows. A
    `ValueError` if the folder holds no benchmark, or one lacks a column.
    """
    found = [_job(path, benchmarks) for path in sorted(benchmarks.rglob("*.tsv"))]
    if not found:
        raise ValueError(f"{benchmarks}: expected benchmarks of a run, found none")
    jobs = pd.concat(found)
    rules = jobs.groupby(["rule", "part"], as_index=False).agg(**SUMS)
    rules = rules.sort_values(["total_s", "rule"], ascending=[False, True])
    parts = jobs.groupby("part", as_index=False).agg(**SUMS).assign(rule="total")
    return pd.concat([rules, parts], ignore_index=True).round(1)


def _job(path: Path, benchmarks: Path) -> pd.DataFrame:
    """What one job took; Snakemake writes NA or - for what was too short to be sampled."""
    table = pd.read_csv(path, sep="\t", na_values=["-"]).tail(1)
    if missing := {"s", "cpu_time", "max_rss"} - set(table):
        raise ValueError(f"{path}: {min(missing)}: expected a column, found none")
    rule = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
    lab = rule.startswith("lab_") and rule != NOT_LAB
    return table.assign(rule=rule, part="lab" if lab else "pipeline")


def main(results: Path) -> None:
    """Write ``tables/resources.csv`` and ``.md`` of a results folder."""
    table = resource_table(results / "benchmarks")
    rows = table.round(0).astype(object).where(table.notna(), "").astype(str)
    lines = rows_of(list(table), rows.replace(r"\.0$", "", regex=True).to_numpy().tolist(), left=2)
    text = "\n".join(["# Time and memory of a run", "", NOTE, "", *lines, ""])
    with whole_file(results / "tables/resources.csv") as part:
        table.to_csv(part, index=False, lineterminator="\n")
    write_text(results / "tables/resources.md", text)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]))
    except (OSError, ValueError) as error:
        sys.exit(f"error: resources: {error}")
