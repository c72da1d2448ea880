"""What a run ends with: the recommended moduli of each object, and what was not made.

Called after ``make results`` and ``make sample``: ``python -m palpate.run.closing <results>``.
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
# The run's own list of what it makes (rule configuration), and what make makes after it.
WANTED = "wanted.txt"
PAGE = "report.html"
AFTERWARDS = (PAGE, "tables/resources.csv")
ARTEFACTS = Path(__file__).resolve().parents[4] / "config/published/artefacts.csv"
FILES = {"table": "tables/{}.csv", "figure": "figures/{}.png"}


def closing_lines(results: Path, wanted: list[str]) -> list[str]:
    """Sum up a results folder.

    Parameters
    ----------
    results : Path
        Folder that holds ``summary.csv``.
    wanted : list of str
        Of `wanted_files`.

    Returns
    -------
    list of str
        Where the results are; the recommended moduli of each object and sensor, with its page's
        path; medians and ranges of the study's methods over the captures.
    """
    text = {"capture": str, "point": str, "at_bound": str}
    summary = pd.read_csv(results / "summary.csv", dtype=text)
    places = [name for name in _places(wanted) if (results / name).exists()]
    lines = [f"Results are in {results}/: {', '.join(places)}", *_artefacts(results, wanted)]
    lines += [f"For a browser: {results / PAGE}"] if PAGE in places else []
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
        if told := _of_study(rows):
            lines += ["", title, *told]
    return lines


def wanted_files(results: Path) -> list[str]:
    """Files that a run was to make, within its results.

    Raises
    ------
    ValueError
        If the run left no list.
    """
    path = results / WANTED
    if not path.is_file():
        raise ValueError(f"{path}: expected the list of what the run makes, found none")
    return [*path.read_text(encoding="utf-8").splitlines(), *AFTERWARDS]


def missing(results: Path, wanted: list[str]) -> list[str]:
    """One line for each file that the run was to make, and that is not there or is empty."""
    found = {results / name: _found(results / name) for name in wanted}
    return [f"{path}: expected it made by the run, {what}" for path, what in found.items() if what]


def _found(path: Path) -> str:
    if not path.is_file():
        return "found nothing"
    return "" if path.stat().st_size else "found it empty"


def _places(wanted: list[str]) -> list[str]:
    """What a person opens: pages of their own, the summary, folders."""
    pages = [name for name in wanted if name.endswith(".html") and not name.startswith("pages/")]
    return [*sorted(pages, key=lambda name: name.count("/")), "summary.csv", "tables/", "figures/"]


def _artefacts(results: Path, wanted: list[str]) -> list[str]:
    """How many of the study's tables and figures a run makes, and how many are there."""
    with ARTEFACTS.open(newline="", encoding="utf-8") as stream:
        names = [FILES[row["kind"]].format(row["id"]) for row in csv.DictReader(stream)]
    made = set(names) & set(wanted)
    there = sum((results / name).is_file() for name in made)
    count = f"{len(made)} of the study's {len(names)} tables and figures"
    return [f"This run makes {count}; {there} are there."] if made else []


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


def main(results: Path) -> int:
    """Print the summary, and an error line for each file that is missing: 1 if any is."""
    try:
        wanted = wanted_files(results)
    except ValueError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    lacking = missing(results, wanted)
    if not _found(results / "summary.csv"):
        print("\n".join(closing_lines(results, wanted)), flush=True)
    sys.stderr.write("".join(f"error: {line}\n" for line in lacking))
    return int(bool(lacking))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
