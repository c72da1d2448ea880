"""Tables of the study, each number of ours beside the published one."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

CAPTURE = ["object", "sensor", "capture", "point"]
SIMULATED_NOTE = "Rows marked simulated come from the virtual lab, not from recordings."
PUBLISHED_NOTE = "Columns published_* are the study's printed values."


def minimum_table(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> pd.DataFrame:
    """Minima of all captures and error options, one row each.

    Parameters
    ----------
    captures : sequence of mapping
    minima : mapping
        minimise-<error>.json by (object, sensor, capture, error).

    Returns
    -------
    DataFrame
    """
    described = {(c["object"], c["sensor"], c["capture"]): c for c in captures}
    rows = []
    for (name, sensor, capture, error), minimum in minima.items():
        known = described[name, sensor, capture]
        rows.append(
            {column: known[column] for column in CAPTURE}
            | {
                "error": error,
                "youngs_modulus_pa": minimum["youngs_modulus_pa"],
                "poisson_ratio": minimum["poisson_ratio"],
                "reduced_modulus_pa": minimum["reduced_modulus_pa"],
                "hertz_reduced_modulus_pa": minimum["hertz_reduced_modulus_pa"],
                "at_bound": minimum["at_bound"],
                "provenance": known["provenance"],
            }
        )
    return pd.DataFrame(rows)


def table_5_3(minima: pd.DataFrame, published: pd.DataFrame, *, block: str) -> pd.DataFrame:
    """E, nu and E* of the block's points per error option, beside Table 5.3."""
    ours = minima[(minima["object"] == block) & (minima["capture"] == minima["point"])].copy()
    ours["point"] = ours["point"].astype(int)
    keys = ["sensor", "point", "error"]
    values = [
        "youngs_modulus_pa",
        "poisson_ratio",
        "reduced_modulus_pa",
        "hertz_reduced_modulus_pa",
    ]
    printed = published.rename(columns={name: f"published_{name}" for name in values})
    merged = ours.merge(printed, on=keys, how="left")
    columns = [*keys, *values, "at_bound", *(f"published_{name}" for name in values), "provenance"]
    return merged.sort_values(["sensor", "error", "point"])[columns].reset_index(drop=True)


def summary(hertz: pd.DataFrame, minima: pd.DataFrame) -> pd.DataFrame:
    """One row for each object, sensor, capture and method."""
    study = hertz[[*CAPTURE, "reduced_modulus_pa", "provenance"]].assign(method="hertz")
    others = [
        hertz[[*CAPTURE, "provenance"]].assign(
            method=f"hertz_{name}",
            reduced_modulus_pa=hertz[f"{name}_reduced_modulus_pa"],
            reduced_modulus_low_pa=hertz[f"{name}_low_pa"],
            reduced_modulus_high_pa=hertz[f"{name}_high_pa"],
        )
        for name in ("free_contact", "recommended")
    ]
    # A run may minimise nothing.
    searched = minima.assign(method="minimise_" + minima["error"]) if len(minima) else minima
    columns = [
        *CAPTURE,
        "method",
        "youngs_modulus_pa",
        "poisson_ratio",
        "reduced_modulus_pa",
        "reduced_modulus_low_pa",
        "reduced_modulus_high_pa",
        "at_bound",
        "provenance",
    ]
    tables = (study, *others, searched)
    rows = [table.reindex(columns=columns).astype(object) for table in tables]
    whole = pd.concat(rows, ignore_index=True)
    return whole.sort_values([*CAPTURE, "method"]).reset_index(drop=True)


def rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Numbers as people read them: moduli to 1 Pa, ratios to four places."""
    result = table.copy()
    for name in result.columns:
        if name.endswith("_pa"):
            values = pd.to_numeric(result[name])
            result[name] = values.round().astype("Int64")
        elif name.endswith("poisson_ratio"):
            result[name] = pd.to_numeric(result[name]).round(4)
    return result


def to_markdown(table: pd.DataFrame, *, title: str, notes: Sequence[str]) -> str:
    """Write a table in Markdown, with its title and what must be said of its rows."""
    lines = [f"# {title}", "", *(f"{note}" for note in notes), ""]
    lines.append("| " + " | ".join(table.columns) + " |")
    lines.append("|" + "---|" * len(table.columns))
    for row in table.itertuples(index=False):
        lines.append("| " + " | ".join(_cell(value) for value in row) + " |")
    return "\n".join(lines) + "\n"


def write(
    table: pd.DataFrame,
    csv: str | Path,
    md: str | Path,
    *,
    title: str,
    more_notes: Sequence[str] = (),
) -> None:
    """Write a table as CSV and Markdown, with the notes that its columns and rows call for."""
    notes = list(more_notes)
    if (table["provenance"] == "simulated").any():
        notes.append(SIMULATED_NOTE)
    if any(name.startswith("published_") for name in table.columns):
        notes.append(PUBLISHED_NOTE)
    table.to_csv(csv, index=False, lineterminator="\n")
    Path(md).write_text(to_markdown(table, title=title, notes=notes), encoding="utf-8")


def _cell(value: object) -> str:
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
