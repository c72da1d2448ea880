"""Tables of the study, each number of ours beside the published one."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from palpate.markdown import rows_of
from palpate.modulus import INTERVAL, LABELS, NOT_JUDGED, columns

CAPTURE = ["object", "sensor", "capture", "point"]
JUDGED = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa")
# Of these a summary says how well what was compared could tell them.
INFORMED = ("effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio")
# Of the direct estimate: depth of the effective modulus, the law, captures and frames in it,
# residuals over what was stated, information limit.
DIAGNOSTICS = (
    "effective_depth_m",
    "force_law",
    "force_law_std",
    "motion_law",
    "motion_law_std",
    "captures",
    "frames",
    "motion_scale",
    "motion_sharing",
    "depth_scale",
    *(f"{n.removesuffix('_pa')}_{kind}" for n in INFORMED for kind in ("bound", "efficiency")),
)
# From here on numbers stand without an exponent.
LARGE = 1e4
SIMULATED_NOTE = "Rows marked simulated come from the virtual lab, not from recordings."
AT_BOUND = " (at a bound)"
AT_BOUND_NOTE = (
    "At a bound: the search ran to an end of the range that it may use (minimise in config.yaml);"
    " its numbers are that end's, not the object's."
)
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
        low, high = minimum["profile"]["interval"] or (None, None)
        derived = minimum["least_squares"]["length"]
        rows.append(
            {column: known[column] for column in CAPTURE}
            | {
                "error": error,
                "youngs_modulus_pa": minimum["youngs_modulus_pa"],
                "poisson_ratio": minimum["poisson_ratio"],
                "reduced_modulus_pa": minimum["reduced_modulus_pa"],
                "hertz_reduced_modulus_pa": minimum["hertz_reduced_modulus_pa"],
                "at_bound": minimum["at_bound"],
                "youngs_modulus_std_pa": derived["youngs_modulus_std_pa"],
                "poisson_ratio_std": derived["poisson_ratio_std"],
                "poisson_ratio_low": low,
                "poisson_ratio_high": high,
                "poisson_ratio_verdict": minimum["profile"]["verdict"],
                "poisson_ratio_reason": derived["unknown"],
                "provenance": known["provenance"],
            }
        )
    return pd.DataFrame(rows)


def least_squares_table(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> pd.DataFrame:
    """Least squares of the same gaps, one row for each capture and error option."""
    names = ["youngs_modulus_pa", "youngs_modulus_std_pa", "poisson_ratio", "poisson_ratio_std"]
    described = {(c["object"], c["sensor"], c["capture"]): c for c in captures}
    rows = []
    for (name, sensor, capture, error), minimum in minima.items():
        known, found = described[name, sensor, capture], minimum["least_squares"]["square"]
        rows.append(
            {column: known[column] for column in [*CAPTURE, "provenance"]}
            | {key: found[key] for key in [*names, "reduced_modulus_pa", "at_bound"]}
            | {"error": error}
        )
    return pd.DataFrame(rows)


def summary(
    hertz: pd.DataFrame,
    minima: pd.DataFrame,
    squares: pd.DataFrame,
    direct: pd.DataFrame,
    curves: pd.DataFrame,
) -> pd.DataFrame:
    """One row for each object, sensor, capture and method, and for all captures together.

    Intervals are at 95 %. A modulus without one has the verdict ``not judged``.

    Parameters
    ----------
    hertz, minima, squares, direct, curves : DataFrame
        Of `hertz_tables.hertz_table`, `minimum_table`, `least_squares_table`,
        `direct_tables.direct_rows` and `curve_rows`; a run may have none of any.
    """
    searched = [
        table.assign(method=f"{method}_" + table["error"]) if len(table) else table
        for method, table in (("minimise", minima), ("least_squares", squares))
    ]
    wanted = [
        *CAPTURE,
        "method",
        "recommended",
        *(column for name in LABELS for column in columns(name)),
        "youngs_modulus_std_pa",
        "poisson_ratio_std",
        "poisson_ratio_reason",
        "at_bound",
        *DIAGNOSTICS,
        "doubts",
        "provenance",
    ]
    tables = (*_of_hertz(hertz), *searched, direct, curves)
    rows = [table.reindex(columns=wanted).astype(object) for table in tables]
    whole = pd.concat(rows, ignore_index=True)
    whole["recommended"] = whole["recommended"].fillna(False).astype(bool)
    for name in JUDGED:
        _judge(whole, name)
    return whole.sort_values([*CAPTURE, "method"]).reset_index(drop=True)


def _of_hertz(hertz: pd.DataFrame) -> list[pd.DataFrame]:
    """Rows of the study's fit, and of the two others."""
    if not len(hertz):
        return []
    study = hertz[[*CAPTURE, "reduced_modulus_pa", "provenance"]].assign(method="hertz")
    return [study] + [
        hertz[[*CAPTURE, "provenance"]].assign(
            method=f"hertz_{name}",
            reduced_modulus_pa=hertz[f"{name}_reduced_modulus_pa"],
            reduced_modulus_low_pa=hertz[f"{name}_low_pa"],
            reduced_modulus_high_pa=hertz[f"{name}_high_pa"],
            reduced_modulus_verdict=hertz.get(f"{name}_verdict"),
        )
        for name in ("free_contact", "recommended")
    ]


def _judge(whole: pd.DataFrame, name: str) -> None:
    """Say of a modulus without a verdict whether it has an interval, in place."""
    _, low, _, verdict = columns(name)
    open_question = whole[name].notna() & whole[verdict].isna()
    whole.loc[open_question, verdict] = np.where(
        whole.loc[open_question, low].notna(), INTERVAL, NOT_JUDGED
    )


def rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Numbers as people read them: moduli to 1 Pa, ratios to four places."""
    result = table.copy()
    for name in result.columns:
        if name.endswith("_pa"):
            values = pd.to_numeric(result[name])
            result[name] = values.round().astype("Int64")
        elif "poisson_ratio" in name and not name.endswith(("verdict", "reason")):
            result[name] = pd.to_numeric(result[name]).round(4)
    return result


def to_markdown(table: pd.DataFrame, *, title: str, notes: Sequence[str]) -> str:
    """Write a table in Markdown, with its title and what must be said of its rows.

    Moduli of a search that ended at a bound say so.
    """
    if any(bound_mark(row) for row in table.to_dict("records")):
        notes = [*notes, AT_BOUND_NOTE]
    lines = [f"# {title}", "", *(f"{note}" for note in notes), ""]
    cells = (
        [
            _cell(value) + bound_mark(row) * (name in (*JUDGED, "value"))
            for name, value in row.items()
        ]
        for row in table.to_dict("records")
    )
    lines += rows_of(list(table.columns), cells)
    return "\n".join(lines) + "\n"


def markdown(table: pd.DataFrame, *, title: str, more_notes: Sequence[str] = ()) -> str:
    """Write a table in Markdown, with the notes that its columns and rows call for."""
    notes = list(more_notes)
    if (table["provenance"] == "simulated").any():
        notes.append(SIMULATED_NOTE)
    if any(name.startswith("published_") for name in table.columns):
        notes.append(PUBLISHED_NOTE)
    return to_markdown(table, title=title, notes=notes)


def bound_mark(row: Mapping) -> str:
    """What stands behind the moduli of a row or result: nothing, or that they are a bound's.

    Parameters
    ----------
    row : mapping
        Its ``at_bound``, if it has one, may be read from CSV as text.
    """
    return AT_BOUND if str(row.get("at_bound")) == "True" else ""


def _cell(value: object) -> str:
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.0f}" if LARGE <= abs(value) < np.inf else f"{value:.4g}"
