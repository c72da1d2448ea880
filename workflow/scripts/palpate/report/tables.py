"""Tables as people read them: rounded, in Markdown, with the notes that they need."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pandas as pd

from palpate.markdown import rows_of

CAPTURE = ["object", "sensor", "capture", "point"]
JUDGED = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa")
# From here on numbers stand without an exponent.
LARGE = 1e4
SIMULATED_NOTE = "Rows marked simulated come from the virtual lab, not from recordings."
AT_BOUND = " (at a bound)"
AT_BOUND_NOTE = (
    "At a bound: the search ran to an end of the range that it may use (minimise: docs/options.md);"
    " its numbers are that end's, not the object's."
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


def significant(values: Iterable[float | None], digits: int) -> list[float | None]:
    """Values to so many digits, without negative zeros; what is missing stays so."""
    return [None if pd.isna(x) else float(f"{x:.{digits}g}") + 0.0 for x in values]


def to_markdown(table: pd.DataFrame, *, title: str, notes: Sequence[str]) -> str:
    """Write a table in Markdown, with its title and what must be said of its rows.

    Moduli of a search that ended at a bound say so.
    """
    rows, marked = table.to_dict("records"), (*JUDGED, "value")
    if any(bound_mark(row) for row in rows):
        notes = [*notes, AT_BOUND_NOTE]
    cells = (
        [_cell(value) + bound_mark(row) * (name in marked) for name, value in row.items()]
        for row in rows
    )
    lines = [f"# {title}", "", *notes, "", *rows_of(list(table.columns), cells), ""]
    return "\n".join(lines)


def markdown(
    table: pd.DataFrame,
    *,
    title: str,
    more_notes: Sequence[str] = (),
    last_notes: Sequence[str] = (),
) -> str:
    """Write a table in Markdown; between its notes whether rows of it are simulated."""
    simulated = [SIMULATED_NOTE] * ("simulated" in table["provenance"].to_numpy())
    return to_markdown(table, title=title, notes=[*more_notes, *simulated, *last_notes])


def bound_mark(row: Mapping) -> str:
    """What stands behind the moduli of a row or result: nothing, or that they are a bound's.

    Its ``at_bound``, if it has one, may be read from CSV as text.
    """
    return AT_BOUND if str(row.get("at_bound")) == "True" else ""


def _cell(value: object) -> str:
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.0f}" if LARGE <= abs(value) < np.inf else f"{value:.4g}"
