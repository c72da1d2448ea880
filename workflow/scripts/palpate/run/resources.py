"""What a run took: time and memory of each rule, from Snakemake's benchmarks.

No two runs take the same, so the table is no rule's output: it is made after the run.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from palpate.capture.files import whole_file
from palpate.markdown import rows_of

LAB_RULES = "lab_"
# A report on the lab's errors, not a part of the lab.
NOT_LAB = ("lab_fidelity",)
COLUMNS = ("rule", "part", "jobs", "total_s", "largest_s", "processor_s", "peak_memory_mb")
TITLES = {
    "rule": "rule",
    "part": "part",
    "jobs": "jobs",
    "total_s": "total (s)",
    "largest_s": "longest job (s)",
    "processor_s": "processor (s)",
    "peak_memory_mb": "peak memory (MB)",
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
        One row a rule with the columns `COLUMNS`, the longest total first; then the totals of
        ``lab`` and ``pipeline``. Times [s], memory [MB].

    Raises
    ------
    ValueError
        If the folder holds no benchmark, or one lacks a column.
    """
    files = sorted(benchmarks.rglob("*.tsv"))
    if not files:
        raise ValueError(f"{benchmarks}: expected benchmarks of a run, found none")
    jobs = pd.DataFrame([_job(path, benchmarks) for path in files])
    rules = _summed(jobs.groupby("rule", as_index=False)).assign(part=lambda t: t.rule.map(_part))
    rules = rules.sort_values(["total_s", "rule"], ascending=[False, True])
    parts = _summed(jobs.assign(rule=jobs.rule.map(_part)).groupby("rule", as_index=False))
    parts = parts.assign(part=parts["rule"], rule="total")
    return pd.concat([rules, parts], ignore_index=True)[list(COLUMNS)].round(1)


def _part(rule: str) -> str:
    return "lab" if rule.startswith(LAB_RULES) and rule not in NOT_LAB else "pipeline"


def _job(path: Path, benchmarks: Path) -> dict:
    """What one job took; Snakemake writes NA or - for what was too short to be sampled."""
    row = pd.read_csv(path, sep="\t", na_values=["-"]).iloc[-1]
    for name in ("s", "cpu_time", "max_rss"):
        if name not in row:
            raise ValueError(f"{path}: {name}: expected a column, found none")
    rule = path.relative_to(benchmarks).parts[0].removesuffix(".tsv")
    return {"rule": rule, "s": row["s"], "cpu_s": row["cpu_time"], "memory_mb": row["max_rss"]}


def _summed(groups: object) -> pd.DataFrame:
    return groups.agg(
        jobs=("s", "size"),
        total_s=("s", "sum"),
        largest_s=("s", "max"),
        processor_s=("cpu_s", "sum"),
        peak_memory_mb=("memory_mb", "max"),
    )


def gigabytes(folder: Path) -> float:
    """Size of a folder's files [GB], links to other places not followed."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return sum(path.stat().st_size for path in files) / 1e9


def markdown(table: pd.DataFrame, sizes: Sequence[str]) -> str:
    """Write the table in Markdown, with the sizes of folders as sentences before it."""
    lines = ["# Time, memory and disk of a run", "", NOTE, "", *sizes, ""]
    cells = (
        [name, part, str(jobs), *("" if pd.isna(n) else f"{n:.0f}" for n in numbers)]
        for name, part, jobs, *numbers in table.itertuples(index=False)
    )
    lines += rows_of([TITLES[name] for name in table.columns], cells, left=2)
    return "\n".join(lines) + "\n"


def main(raw: Path, results: Path) -> None:
    """Write ``tables/resources.csv`` and ``.md`` of a results folder."""
    table = resource_table(results / "benchmarks")
    sizes = [f"`{folder}/` holds {gigabytes(folder):.2f} GB." for folder in (raw, results)]
    place = results / "tables"
    place.mkdir(exist_ok=True)
    with whole_file(place / "resources.csv") as csv, whole_file(place / "resources.md") as md:
        table.to_csv(csv, index=False, lineterminator="\n")
        md.write_text(markdown(table, sizes), encoding="utf-8")


if __name__ == "__main__":
    try:
        main(*map(Path, sys.argv[1:]))
    except (OSError, ValueError) as error:
        sys.exit(f"error: resources: {error}")
