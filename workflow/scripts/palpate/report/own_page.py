"""Page of one object: its moduli, how well they are known, and from what."""

from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.modulus import LABELS, NARROW_E, NARROW_NU, VERDICTS, Modulus, verdicts_in
from palpate.report import own_words as words
from palpate.report import texts
from palpate.report.budget_bars import bars, largest
from palpate.report.data_package import links_of
from palpate.report.held import Held, checks_of, press_of, recording, rows
from palpate.report.material import PROGRAMMES, names_of
from palpate.report.own_figures import HERTZ, MAPPED, OWN_FIGURES, TEXTS
from palpate.report.pages import rendered, title_of
from palpate.report.point_maps import PointMap
from palpate.report.press_pictures import Glimpse
from palpate.report.style import sensor_name
from palpate.report.tables import AT_BOUND_NOTE, bound_mark
from palpate.report.viewer import plotly

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


def own_page(
    name: str,
    summary: pd.DataFrame,
    held: Sequence[Held],
    *,
    pictures: Mapping[str, bytes],
    glimpses: Sequence[Glimpse],
    joints: Mapping[str, Mapping],
    settings: Sequence[Mapping[str, str]],
    checksums: Sequence[Mapping[str, str]],
    files: Mapping[str, str],
    views: Sequence[Mapping] = (),
    narrowed: Mapping[str, Sequence[Mapping[str, str]]] | None = None,
    maps: Sequence[PointMap] = (),
) -> str:
    """Write an object's page.

    Parameters
    ----------
    name : str
        The object.
    summary : DataFrame
        Its summary.csv.
    held : sequence of Held
        Its captures.
    pictures : mapping
        PNG by the name of a figure in `OWN_FIGURES`.
    glimpses : sequence of Glimpse
        Frames as the camera saw them; the first is the deepest of a capture.
    joints : mapping
        direct.json of all captures together, by sensor.
    settings, checksums : sequences of mapping
        Rows of what the estimates were made with.
    files : mapping
        Files and options whole, as text by name.
    views : sequence of mapping, optional
        Of `viewer.view`.
    narrowed : mapping, optional
        Rows of what would narrow the intervals, by sensor (`palpate.plan.narrowed`).
    maps : sequence of PointMap, optional
        Stiffness over the object by sensor; their picture is that of the name `MAPPED`.

    Returns
    -------
    str
        HTML, all pictures and scripts within it.

    Raises
    ------
    ValueError
        If the summary recommends nothing.
    """
    recommended = summary[summary["recommended"]]
    if recommended.empty:
        raise ValueError("recommended: expected a row for each sensor, found none")
    checked = [(one.capture, checks_of(one)) for one in held]
    figures = {
        one.name: (pictures[one.name], one.caption) for one in OWN_FIGURES if one.name in pictures
    }
    hertz = figures.pop(HERTZ, None)
    given = {found[name]["verdict"] for found in joints.values() for name in words.FURTHER}
    given |= set(verdicts_in(recommended))
    estimates = names_of(recommended)
    return rendered(
        "own_page.html.j2",
        title=title_of(name),
        simulated=(summary["provenance"] == "simulated").any(),
        estimates=list(_estimates(recommended.to_dict("records"), joints, held)),
        verdicts=[(one, told) for one, told in VERDICTS.items() if one in given],
        recording=recording(checked),
        passed=all(check.passed for _, checks in checked for check in checks),
        glimpses=glimpses,
        limits={sensor_name(sensor): bars(one["budget"]) for sensor, one in joints.items()},
        narrowed={sensor_name(sensor): rows for sensor, rows in (narrowed or {}).items()},
        maps=maps,
        pictured=(pictures[MAPPED], TEXTS[MAPPED]["caption"]) if MAPPED in pictures else None,
        views=views,
        plotly=plotly() if views else "",
        figures=list(figures.values()),
        checks=rows(checked),
        captures=[press_of(one) for one in held],
        others=_others(summary) | {"figures": [hertz] if hertz else []},
        links=links_of(joints),
        programmes=list(PROGRAMMES),
        exported=[f"{name} --sensor {one}" for one in estimates] if estimates[1:] else [name],
        settings=settings,
        checksums=checksums,
        files=files,
    )


def _estimates(advised, joints, held) -> Iterator[dict]:
    """Each recommended row: its numbers, sentences, warnings and moduli."""
    for row in advised:
        mine = [one for one in held if one.capture["sensor"] == row["sensor"]]
        direct = joints[row["sensor"]] if row["method"] == "direct_joint" else None
        told = list(words.verdict(row))
        if direct is not None:
            told += [words.range_of(mine), largest(direct["budget"])]
        yield {
            "by": words.by(row),
            # A curve beside captures takes Poisson's ratio for granted.
            "beside": row["sensor"] == CURVE and bool(held),
            "numbers": list(words.headlines(row)),
            "sentences": told,
            "warnings": [] if pd.isna(row.get("warnings")) else row["warnings"].split("; "),
            "moduli": list(words.moduli(row, direct, words.compared_s(mine))),
            "conditions": "" if direct is None else words.conditions(direct, mine),
        }


def _others(summary: pd.DataFrame) -> dict:
    """All estimates of a summary.csv: ``why`` they differ, ``rows`` of a table, and ``notes``."""
    found = summary.to_dict("records")
    notes = [IDENTIFIED_RULE] + [AT_BOUND_NOTE] * any(bound_mark(one) for one in found)
    return {"why": _why(found), "rows": [_row_of(one) for one in found], "notes": notes}


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


def _row_of(one: Mapping) -> dict[str, str]:
    """Row of the table of all estimates: values, intervals, whether a bound ended the search."""
    method = METHODS.get(one["method"], one["method"].replace("_", " "))
    cells = {"method": method + " (recommended)" * bool(one["recommended"])}
    cells["of"] = f"{sensor_name(one['sensor'])} {one['capture']}"
    for quantity in COMPARED:
        modulus = Modulus.of_row(one, quantity)
        cells[LABELS[quantity]] = modulus.text() + bound_mark(one) if modulus else ""
    verdicts = {"E is": "youngs_modulus_verdict", "nu is": "poisson_ratio_verdict"}
    return cells | {of: "" if pd.isna(one[name]) else one[name] for of, name in verdicts.items()}
