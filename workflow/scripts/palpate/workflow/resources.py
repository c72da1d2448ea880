"""What a run took: time and memory of each rule, from Snakemake's benchmarks.

No two runs take the same, so the table is no rule's output: it is made after the run.
"""

import sys
from pathlib import Path

import pandas as pd

from palpate.capture.files import whole_file
from palpate.markdown import rows_of

LAB_RULES = "lab_"
# A report on the lab's errors, not a part of the lab.
NOT_LAB = ("lab_fidelity",)
TITLES = {
    "rule": "rule",
    "part": "part",
    "jobs": "jobs",
    "total_s": "total (s)",
    "largest_s": "longest job (s)",
    "processor_s": "processor (s)",
    "peak_memory_mb": "peak memory (MB)",
}
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
    """Sum up the benchmarks of a run by rule.

    Parameters
    ----------
    benchmarks : Path
        Folder with ``<rule>.tsv`` and ``<rule>/<job>.tsv``.

    Returns
    -------
    DataFrame
        One row a rule with the columns `TITLES`, the longest total first; then the totals of
        ``lab`` and ``pipeline``. Times [s], memory [MB].

    Raises
    ------
    ValueError
        If the folder holds no benchmark, or one lacks a column.
    """
    found = [_job(path, benchmarks) for path in sorted(benchmarks.rglob("*.tsv"))]
    if not found:
        raise ValueError(f"{benchmarks}: expected benchmarks of a run, found none")
    jobs = pd.concat(found)
    rules = jobs.groupby(["rule", "part"], as_index=False).agg(**SUMS)
    rules = rules.sort_values(["total_s", "rule"], ascending=[False, True])
    parts = jobs.groupby("part", as_index=False).agg(**SUMS).assign(rule="total")
    return pd.concat([rules, parts], ignore_index=True)[list(TITLES)].round(1)


def _job(path: Path, benchmarks: Path) -> pd.DataFrame:
    """What one job took; Snakemake writes NA or - for what was too short to be sampled."""
    table = pd.read_csv(path, sep="\t", na_values=["-"]).tail(1)
    for name in ("s", "cpu_time", "max_rss"):
        if name not in table:
            raise ValueError(f"{path}: {name}: expected a column, found none")
    rule = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
    lab = rule.startswith(LAB_RULES) and rule not in NOT_LAB
    return table.assign(rule=rule, part="lab" if lab else "pipeline")


def markdown(table: pd.DataFrame, *folders: Path) -> str:
    """Write the table in Markdown, below the sizes of folders (links in them are not followed)."""
    sizes = [f"`{folder}/` holds {_gigabytes(folder):.2f} GB." for folder in folders]
    cells = (
        [name, part, str(jobs), *("" if pd.isna(n) else f"{n:.0f}" for n in numbers)]
        for name, part, jobs, *numbers in table.itertuples(index=False)
    )
    rows = rows_of([TITLES[name] for name in table.columns], cells, left=2)
    return "\n".join(["# Time, memory and disk of a run", "", NOTE, "", *sizes, "", *rows, ""])


def _gigabytes(folder: Path) -> float:
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return sum(path.stat().st_size for path in files) / 1e9


def main(raw: Path, results: Path) -> None:
    """Write ``tables/resources.csv`` and ``.md`` of a results folder."""
    table = resource_table(results / "benchmarks")
    place = results / "tables"
    place.mkdir(exist_ok=True)
    with whole_file(place / "resources.csv") as csv, whole_file(place / "resources.md") as md:
        table.to_csv(csv, index=False, lineterminator="\n")
        md.write_text(markdown(table, raw, results), encoding="utf-8")


if __name__ == "__main__":
    try:
        main(*map(Path, sys.argv[1:]))
    except (OSError, ValueError) as error:
        sys.exit(f"error: resources: {error}")
