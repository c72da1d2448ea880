"""What other methods find of an object, and why they differ: a page's part that is closed."""

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from palpate.modulus import LABELS, NARROW_E, NARROW_NU, Modulus
from palpate.report.own_words import WORDS
from palpate.report.style import sensor_name
from palpate.report.table_page import figure, rendered, table
from palpate.report.tables import AT_BOUND_NOTE, bound_mark

# What methods are compared by.
STAR = "reduced_modulus_pa"
COMPARED = [STAR, "effective_reduced_modulus_pa", "youngs_modulus_pa", "poisson_ratio"]
METHODS = {
    "direct_joint": "direct, all captures together",
    "direct": "direct",
    "curve_table": "curve without a camera, indentation table",
    "curve_hertz": "curve without a camera, Hertz",
    "hertz": "Hertz's law, depth as recorded",
    "hertz_free_contact": "Hertz's law, place of the touch fitted",
    "hertz_recommended": "contact law chosen by depth and shape",
}
HERTZ = "hertz_fit"
HERTZ_CAPTION = (
    "Force against depth in each capture, with Hertz's law for a ball on a flat thick solid, F ="
    " 4/3 E* R^(1/2) d^(3/2) (Eq. 5.1 in the figure; R: radius of the ball, d: depth). Points that"
    " leave the curve in a bow say that the object is not like that: the recommended estimate"
    " allows for it, this fit does not."
)
# What is to be said of methods by how their names begin, of which a page has those that are there.
PRESUMED = {
    ("hertz", "curve_hertz"): "Hertz's law takes the object for a flat, endless block and a shallow"
    " dent: a thin, round or bent object, a deep press and a surface that was touched earlier or"
    " later than believed all go into its modulus.",
    ("direct",): "A single capture has more noise than all together.",
    ("minimise", "least_squares"): "Error minimisation follows the surface alone over a wide range"
    " of moduli, and may end at a bound.",
}
KNOWN_RULE = (
    f"Known is a modulus whose interval reaches no further than by a factor of {NARROW_E} from end"
    f" to end, and nu where it is no wider than {NARROW_NU} and clear of the ends of its range. In"
    " the figure of the moduli a symbol is hollow where that is not so."
)


def others(summary: pd.DataFrame, pictures: Mapping[str, bytes]) -> Iterator[str]:
    """All estimates of a summary.csv, closed."""
    rows = summary.to_dict("records")
    lines = [*_why(rows), *table([_estimate(one) for one in rows]), "", KNOWN_RULE]
    if any(bound_mark(one) for one in rows):
        lines += ["", AT_BOUND_NOTE]
    yield '<section class="screen"><h2>Other methods</h2><details>'
    yield "<summary>All estimates, and why they differ</summary>"
    yield rendered("\n".join(lines))
    if HERTZ in pictures:
        yield figure(pictures[HERTZ], "image/png", HERTZ_CAPTION)
    yield "</details></section>"


def _why(rows: Sequence[Mapping]) -> list[str]:
    """How far others are from what is recommended here, and why."""
    advised = [one for one in rows if one["recommended"]]
    rest = [one for one in rows if not one["recommended"]]
    methods = [one["method"] for one in rest]
    told = [
        words
        for begins, words in PRESUMED.items()
        if any(method.startswith(begins) for method in methods)
    ]
    if not told:
        return []
    apart = [100 * (part - 1) for one in rest for part in _parts_of(one, advised)]
    ends = dict.fromkeys(f"{end:+.0f}" for end in (min(apart), max(apart))) if apart else ()
    here = f": here by {' to '.join(ends)} % in E*" if ends else ""
    first = f"They rest on less than the recommended estimate and differ from it{here}."
    return [" ".join([first, *told, "The recommended estimate allows for all of these."]), ""]


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
        cells[LABELS[quantity]] = modulus.told() + bound_mark(one) if modulus else ""
    # Without a verdict it is NaN, which has no words either.
    cells["E is"] = WORDS.get(one["youngs_modulus_verdict"], "")
    cells["nu is"] = WORDS.get(one["poisson_ratio_verdict"], "")
    return cells
