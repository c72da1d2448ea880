"""What other methods find of an object, and why they differ."""

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from palpate.modulus import LABELS, NARROW_E, NARROW_NU, Modulus
from palpate.report import texts
from palpate.report.style import sensor_name
from palpate.report.tables import AT_BOUND_NOTE, bound_mark

# What methods are compared by.
STAR = "reduced_modulus_pa"
COMPARED = [STAR, "effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio"]
# Methods by name; what is to be said of those whose names begin so.
METHODS, PRESUMED = texts("methods").values()
IDENTIFIED_RULE = (
    f"A modulus is identified if its interval reaches no further than by a factor of {NARROW_E}"
    f" from end to end, nu if its interval is no wider than {NARROW_NU} and clear of the ends of"
    " its range. In the figure of the moduli other symbols are hollow."
)


def others(summary: pd.DataFrame) -> dict:
    """All estimates of a summary.csv: ``why`` they differ, ``rows`` of a table, and ``notes``."""
    rows = summary.to_dict("records")
    notes = [IDENTIFIED_RULE] + [AT_BOUND_NOTE] * any(bound_mark(one) for one in rows)
    return {"why": _why(rows), "rows": [_estimate(one) for one in rows], "notes": notes}


def _why(rows: Sequence[Mapping]) -> str:
    """How far others are from what is recommended here, and why."""
    advised = [one for one in rows if one["recommended"]]
    rest = [one for one in rows if not one["recommended"]]
    methods = {one["method"] for one in rest}
    told = [
        each["why"] for each in PRESUMED if any(m.startswith(tuple(each["of"])) for m in methods)
    ]
    if not told:
        return ""
    apart = [100 * (part - 1) for one in rest for part in _parts_of(one, advised)]
    ends = dict.fromkeys(f"{end:+.0f}" for end in (min(apart), max(apart))) if apart else ()
    here = f": here by {' to '.join(ends)} % in E*" if ends else ""
    first = f"They use less than the recommended estimate does and differ from it{here}."
    return " ".join([first, *told, "The recommended estimate allows for all of these."])


def _parts_of(one: Mapping, advised: Sequence[Mapping]) -> Iterator[float]:
    """E* over the recommended one of the same device; nothing where a bound ended the search."""
    of = [each for each in advised if each["sensor"] == one["sensor"]]
    same = [each for each in of if each["capture"] == one["capture"]]
    for each in (same or of)[:1]:
        part = one[STAR] / each[STAR]
        if not (pd.isna(part) or bound_mark(one)):
            yield part


def _estimate(one: Mapping) -> dict[str, str]:
    """Row of the table of all estimates: values, intervals, whether a bound ended the search."""
    method = METHODS.get(one["method"], one["method"].replace("_", " "))
    cells = {"method": method + " (recommended)" * bool(one["recommended"])}
    cells["of"] = f"{sensor_name(one['sensor'])} {one['capture']}"
    for quantity in COMPARED:
        modulus = Modulus.of_row(one, quantity)
        cells[LABELS[quantity]] = modulus.text() + bound_mark(one) if modulus else ""
    verdicts = {"E is": "youngs_modulus_verdict", "nu is": "poisson_ratio_verdict"}
    return cells | {of: "" if pd.isna(one[name]) else one[name] for of, name in verdicts.items()}
