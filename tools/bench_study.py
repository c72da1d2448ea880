"""What the study costs: by rule from the last `make results`, and small runs by the clock.

A run in the tens of minutes is not repeated for it: its own benchmarks are read.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml
from palpate.workflow.resources import resource_table

ROOT = Path(__file__).resolve().parents[1]
BENCHMARKS = ROOT / "results/benchmarks"
# Rules that take less are in the totals alone [min].
LEAST_MIN = 1.0
PROFILE = ("--profile", "workflow/profiles/default")


def study_rows() -> list[tuple]:
    """Core-minutes by rule, the sample on two cores and on one, and a run with nothing to do."""
    rows = []
    if BENCHMARKS.is_dir():
        table = resource_table(BENCHMARKS)
        for row in table.itertuples():
            minutes, name = row.total_s / 60, row.rule if row.rule != "total" else f"all {row.part}"
            if minutes >= LEAST_MIN:
                rows.append((f"last make results: {name}", minutes, "min", f"{row.jobs} jobs"))
    with tempfile.TemporaryDirectory() as name:
        one, again = _sample(Path(name, "one"), cores=1)
        two, _ = _sample(Path(name, "two"), cores=2)
    rows.append(("sample, two cores", two, "s", ""))
    rows.append(("sample, two cores over one", two / one, "", ""))
    rows.append(("sample again, nothing to do", again, "s", ""))
    return rows


def _sample(results: Path, *, cores: int) -> tuple[float, float]:
    """Seconds of a run of the sample from nothing, and of the next."""
    results.mkdir()
    config = results / "config.yaml"
    config.write_text(yaml.safe_dump({"paths": {"results": str(results / "results")}}))
    files = ("--configfile", "tests/sample/config.yaml", str(config))
    found = []
    for _ in range(2):
        start = time.perf_counter()
        run_snakemake("study", *PROFILE, "--cores", str(cores), *files)
        found.append(time.perf_counter() - start)
    return found[0], found[1]


def run_snakemake(section: str, *arguments: str) -> None:
    """Run the workflow for a section of the benchmarks; a run that fails ends them."""
    command = [sys.executable, "-m", "snakemake", *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"error: {section}: {done.stderr[-500:]}")
