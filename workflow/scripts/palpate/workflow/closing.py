"""What a run ends with: where the results are, and the recommended moduli of each object.

Called after ``make results`` and ``make sample``: ``python -m palpate.workflow.closing <results>``.
"""

import csv
import sys
from pathlib import Path

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.modulus import LABELS, VERDICTS, Modulus, verdicts_in
from palpate.units import KILOPASCALS

# The published study's own methods.
STUDY = {
    "hertz": "Hertz fit",
    "minimise_displacement": "displacement error",
    "minimise_force_displacement": "force and displacement error",
}
COMPARED = (
    "The published study's methods, for comparison; not to be relied on"
    " (medians over the captures, with their ranges):"
)
PAGE = "report.html"
ARTEFACTS = Path(__file__).resolve().parents[4] / "config/published/artefacts.csv"
FILES = {"table": "tables/{}.csv", "figure": "figures/{}.png"}


def closing_lines(results: Path) -> list[str]:
    """Sum up a results folder.

    Parameters
    ----------
    results : Path
        Folder that holds ``summary.csv``.

    Returns
    -------
    list of str
        Where the results are; the recommended moduli of each object and sensor, with its page's
        path; medians and ranges of the study's methods over the captures.
    """
    text = {"capture": str, "point": str, "at_bound": str}
    summary = pd.read_csv(results / "summary.csv", dtype=text)
    lines = [f"Results are in {results}/: {', '.join(_places(results, summary))}"]
    lines += _artefacts(results)
    lines += [f"For a browser: {results / PAGE}"] if (results / PAGE).is_file() else []
    groups = [
        (_title(name, sensor, rows), rows)
        for (name, sensor), rows in summary.groupby(["object", "sensor"], sort=False)
    ]
    lines += ["", "Recommended, from all captures of an object by one sensor (95 % intervals):"]
    for title, rows in groups:
        lines += ["", title, *_recommended(rows), *_page(results, rows["object"].iloc[0])]
    lines += _meanings(summary)
    lines += ["", COMPARED]
    for title, rows in groups:
        if found := _of_study(rows):
            lines += ["", title, *found]
    return lines


def _places(results: Path, summary: pd.DataFrame) -> list[str]:
    """What a person opens: pages, the summary, folders."""
    pages = [f"{name}/{PAGE}" for name in dict.fromkeys(summary["object"])]
    names = ["objects.html", PAGE, *pages, "summary.csv", "tables/", "figures/"]
    return [name for name in names if (results / name).exists()]


def _artefacts(results: Path) -> list[str]:
    """How many of the study's tables and figures are there."""
    with ARTEFACTS.open(newline="", encoding="utf-8") as stream:
        names = [FILES[row["kind"]].format(row["id"]) for row in csv.DictReader(stream)]
    there = sum((results / name).is_file() for name in names)
    return [f"{there} of the study's {len(names)} tables and figures are there."] if there else []


def _title(name: str, sensor: str, rows: pd.DataFrame) -> str:
    simulated = (rows["provenance"] == "simulated").any()
    label = " (simulated: captures of the virtual lab)" if simulated else ""
    return f"{name}, {sensor}{label}"


def _recommended(rows: pd.DataFrame) -> list[str]:
    advised = rows[rows["recommended"]]
    if not len(advised):
        return ["  none: no capture of it is estimated directly"]
    lines = []
    for row in advised.to_dict("records"):
        values = {label: Modulus.of_row(row, name) for name, label in LABELS.items()}
        lines += [f"  {label:<13} {one}" for label, one in values.items() if one]
        of_curve = f"curve {row['capture']}" if row["sensor"] == CURVE else ""
        lines += [f"  from {of_curve or _captures(int(row['captures']))}"]
        if isinstance(row.get("doubts"), str):
            lines += [f"  doubtful: {doubt}" for doubt in row["doubts"].split("; ")]
    return lines


def _page(results: Path, name: str) -> list[str]:
    """Where an object's own page is, of one that has a page."""
    path = results / name / PAGE
    return [f"  page: {path}"] if path.is_file() else []


def _meanings(summary: pd.DataFrame) -> list[str]:
    """What the verdicts say that were given."""
    given = verdicts_in(summary[summary["recommended"]])
    return ["", *(f"{verdict}: {VERDICTS[verdict]}." for verdict in given)] if given else []


def _of_study(rows: pd.DataFrame) -> list[str]:
    found = {title: rows[rows["method"] == method] for method, title in STUDY.items()}
    return [f"  {title:<29} {_moduli(chosen)}" for title, chosen in found.items() if len(chosen)]


def _moduli(rows: pd.DataFrame) -> str:
    """Moduli of one method over captures, verdicts on Poisson's ratio, and how many."""
    captures = _captures(len(rows))
    if rows["youngs_modulus_pa"].isna().all():
        return f"E* {_spread(rows['reduced_modulus_pa'] * KILOPASCALS, 1)} kPa; {captures}"
    E = f"E {_spread(rows['youngs_modulus_pa'] * KILOPASCALS, 1)} kPa"
    nu = f"nu {_spread(rows['poisson_ratio'], 2)}"
    stopped = int((rows["at_bound"] == "True").sum())
    limit = f", {stopped} stopped at a bound of the search" if stopped else ""
    return f"{E}, {nu} {_verdicts(rows['poisson_ratio_verdict'])}; {captures}{limit}"


def _captures(count: int) -> str:
    return f"{count} capture{'s' * (count > 1)}"


def _spread(values: pd.Series, places: int) -> str:
    middle, low, high = (
        f"{value:.{places}f}" for value in (values.median(), values.min(), values.max())
    )
    return middle if low == high else f"{middle} ({low} to {high})"


def _verdicts(verdicts: pd.Series) -> str:
    """Verdicts on nu, counted where they differ."""
    counts = verdicts.value_counts()
    if not len(counts):
        return ""
    ordered = [name for name in VERDICTS if name in counts]
    parts = [f"{name} {counts[name]}x" if len(ordered) > 1 else name for name in ordered]
    return f"[{', '.join(parts)}]"


if __name__ == "__main__":
    try:
        print("\n".join(closing_lines(Path(sys.argv[1]))))
    except OSError as error:
        sys.exit(f"error: closing: {error.filename}: {error.strerror}")
