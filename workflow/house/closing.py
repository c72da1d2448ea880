"""What a run ends with: where the results are, and the stiffness of each object."""

import sys
from pathlib import Path

import pandas as pd

# What of the summary is shown of each object and sensor, and what it is called.
METHODS = {
    "hertz": "Hertz fit",
    "hertz_recommended": "recommended contact model",
    "minimise_displacement": "displacement error",
    "minimise_force_displacement": "force and displacement error",
}
PLACES = ("tables", "figures", "summary.csv", "report.html", "objects.html")
# Verdicts on Poisson's ratio, the best first.
VERDICTS = ("identified", "bounded", "not identified", "not judged")


def closing_lines(results: Path) -> list[str]:
    """Sum up a results folder in a few lines.

    Parameters
    ----------
    results : Path
        Folder that holds ``summary.csv``.

    Returns
    -------
    list of str
        Where the results are; for each object and sensor one line a method, with medians and
        ranges over the captures.

    Raises
    ------
    ValueError
        If there is no summary.
    """
    path = results / "summary.csv"
    if not path.is_file():
        raise ValueError(f"{path}: expected the summary of a run, found none")
    summary = pd.read_csv(path, dtype={"capture": str, "point": str})
    found = ", ".join(f"{name}/" * (results / name).is_dir() or name for name in _present(results))
    lines = [f"Results are in {results}/: {found}"]
    for (name, sensor), rows in summary.groupby(["object", "sensor"], sort=False):
        simulated = " (simulated)" if (rows["provenance"] == "simulated").any() else ""
        lines += ["", f"{name}, {sensor}{simulated}"]
        for method, title in METHODS.items():
            chosen = rows[rows["method"] == method]
            if len(chosen):
                lines.append(f"  {title:<29} {_moduli(chosen)}")
    lines += ["", "Medians over the captures, with their ranges; each capture: summary.csv."]
    if (summary["provenance"] == "simulated").any():
        lines.append("Simulated: computed from captures of the virtual lab.")
    return lines


def _present(results: Path) -> list[str]:
    return [name for name in PLACES if (results / name).exists()]


def _moduli(rows: pd.DataFrame) -> str:
    """Moduli of one method over captures, their number, and verdicts on Poisson's ratio."""
    captures = f"{len(rows)} capture{'s' * (len(rows) > 1)}"
    if rows["youngs_modulus_pa"].isna().all():
        return f"E* {_spread(rows['reduced_modulus_pa'] / 1000, 1)} kPa; {captures}"
    E = f"E {_spread(rows['youngs_modulus_pa'] / 1000, 1)} kPa"
    nu = f"nu {_spread(rows['poisson_ratio'], 2)}"
    return f"{E}, {nu} {_verdicts(rows['poisson_ratio_verdict'])}; {captures}"


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
    print("\n".join(closing_lines(Path(sys.argv[1]))))
