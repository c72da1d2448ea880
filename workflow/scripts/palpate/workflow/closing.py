"""What a run ends with: where the results are, and the recommended moduli of each object.

Called after ``make results`` and ``make sample``: ``python -m palpate.workflow.closing <results>``.
"""

import sys
from pathlib import Path

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.modulus import LABELS, VERDICTS, Modulus, verdicts_in

PAGE = "report.html"
ARTEFACTS = Path(__file__).resolve().parents[4] / "config/published/artefacts.csv"
FILES = {"table": "tables/{}.csv", "figure": "figures/{}.png"}


def closing_lines(results: Path) -> list[str]:
    """Say where the results of a folder with ``summary.csv`` are, and the recommended moduli."""
    summary = pd.read_csv(results / "summary.csv", dtype={"capture": str, "point": str})
    pages = [f"{name}/{PAGE}" for name in dict.fromkeys(summary["object"])]
    names = ["objects.html", PAGE, *pages, "summary.csv", "tables/", "figures/"]
    there = ", ".join(name for name in names if (results / name).exists())
    lines = [f"Results are in {results}/: {there}"]
    names = [FILES[one.kind].format(one.id) for one in pd.read_csv(ARTEFACTS).itertuples()]
    if count := sum((results / name).is_file() for name in names):
        lines += [f"{count} of the study's {len(names)} tables and figures are there."]
    lines += [f"For a browser: {results / PAGE}"] if (results / PAGE).is_file() else []
    lines += ["", "Recommended, from all captures of an object by one sensor (95 % intervals):"]
    for (name, sensor), rows in summary.groupby(["object", "sensor"], sort=False):
        simulated = (rows["provenance"] == "simulated").any()
        label = " (simulated: captures of the virtual lab)" if simulated else ""
        lines += ["", f"{name}, {sensor}{label}", *_recommended(rows[rows["recommended"]])]
        page = results / name / PAGE
        lines += [f"  page: {page}"] if page.is_file() else []
    given = verdicts_in(summary[summary["recommended"]])
    return [*lines, "", *(f"{verdict}: {VERDICTS[verdict]}." for verdict in given)]


def _recommended(rows: pd.DataFrame) -> list[str]:
    lines = [] if len(rows) else ["  none: no capture of it is estimated directly"]
    for row in rows.to_dict("records"):
        values = {label: Modulus.of_row(row, name) for name, label in LABELS.items()}
        lines += [f"  {label:<15} {one}" for label, one in values.items() if one]
        count = int(row["captures"]) if row["sensor"] != CURVE else 0
        captures = f"{count} capture{'s' * (count > 1)}"
        lines += [f"  from {captures if count else 'curve ' + row['capture']}"]
        if isinstance(row.get("warnings"), str):
            lines += [f"  warning: {one}" for one in row["warnings"].split("; ")]
    return lines


if __name__ == "__main__":
    try:
        print("\n".join(closing_lines(Path(sys.argv[1]))))
    except OSError as error:
        sys.exit(f"error: closing: {error.filename}: {error.strerror}")
