"""All objects of a run beside one another, and tracked surfaces of those without a page."""

import math
from collections.abc import Mapping, Sequence

import pandas as pd

from palpate.modulus import IDENTIFIED, INTERVAL, Modulus
from palpate.report.own_words import OF_NU, by, cells
from palpate.report.pages import rendered, title_of
from palpate.report.style import ERROR_NAMES
from palpate.report.viewer import plotly
from palpate.units import readable

YOUNG = "youngs_modulus_pa"
# Columns with a modulus, and their heads.
MODULI = {YOUNG: "E", "poisson_ratio": "nu", "effective_reduced_modulus_pa": "Effective E*"}
COMPARED = {YOUNG: "E", "poisson_ratio": "nu", "reduced_modulus_pa": "E*"}
# The axis: labels that have room on it, its steps within a decade, and its size on the screen [px].
MOST_TICKS, STEPS = 5, (1, 2, 5)
WIDTH, HEIGHT, MARGIN = 252, 22, 24
SIMULATED_NOTE = "Simulated: {} of {} estimates are of captures of the virtual lab, not recordings."


def objects_page(
    rows: Sequence[Mapping],
    *,
    pages: Sequence[str] = (),
    views: Sequence[Mapping] = (),
    moduli: Sequence[Sequence[Mapping[str, str]]] = (),
    tracker: str = "",
) -> str:
    """Write the page of all objects, in HTML.

    Parameters
    ----------
    rows : sequence of mapping
        Recommended rows of summary.csv, a line each.
    pages : sequence of str
        Objects that have a page of their own, to which their names lead.
    views, moduli : sequences
        Tracked surfaces, of `viewer.view`, and of each the rows of `moduli_of`.
    tracker : str
        Whose surfaces they are.
    """
    axis = ticks([*filter(None, (Modulus.of_row(row, YOUNG) for row in rows))])
    simulated = sum(row["provenance"] == "simulated" for row in rows)
    labelled = [{"x": _across(tick, axis), "text": _tick(tick)} for tick in axis]
    return rendered(
        "objects.html.j2",
        title="Objects",
        simulated=SIMULATED_NOTE.format(simulated, len(rows)) if simulated else "",
        axis={"width": WIDTH, "height": HEIGHT, "ticks": labelled},
        heads=[*MODULI.values(), "Recorded with"],
        lines=[_line(row, axis, pages) for row in rows],
        others=[name for name in pages if name not in {row["object"] for row in rows}],
        views=views,
        moduli=moduli,
        tracker=tracker,
        plotly=plotly() if views else "",
    )


def moduli_of(
    fit: Mapping, minima: Mapping[str, Mapping], advised: Mapping | None = None
) -> list[dict[str, str]]:
    """Moduli of a capture by method, as text, with what is to be said of nu.

    Of its hertz.json, its minimise-<error>.json by error option, and the recommended row of
    summary.csv of its object and sensor, if there is one.
    """
    star, found = fit["recommended"], []
    if advised is not None:
        verdict = OF_NU.get(advised["poisson_ratio_verdict"], "")
        found.append(_row(f"Recommended, {by(advised)}", advised, verdict))
    ends = star["reduced_modulus_interval_pa"]
    interval = Modulus(star["reduced_modulus_pa"], *ends, INTERVAL, "Pa")
    found.append(_row("Hertz fit (Eq. 5.1)", fit["study"]))
    warnings = "; ".join(star["warnings"])
    found.append(_row("Recommended contact model", interval.cells("reduced_modulus_pa"), warnings))
    for error, minimum in minima.items():
        reason = minimum["least_squares"]["length"]["unknown"]
        verdict = minimum["profile"]["verdict"] + (f" ({reason})" if reason else "")
        found.append(_row(f"Minimisation, {ERROR_NAMES[error]} error", minimum, verdict))
    return found


def overview(rows: pd.DataFrame, pages: Sequence[str]) -> pd.DataFrame:
    """Short table of recommended rows for the report, in reStructuredText.

    Names of objects that have a page of their own lead to it.
    """
    found = []
    for row in rows.to_dict("records"):
        name, place = title_of(row["object"]), f"{row['object']}/report.html"
        told = {"Object": f"`{name} <{place}>`__" if row["object"] in pages else name}
        for column, head in MODULI.items():
            modulus = Modulus.of_row(row, column)
            told[head] = f"{modulus.text()} *{modulus.verdict}*" if modulus else ""
        found.append(told | {"Recorded with": by(row), "Provenance": row["provenance"]})
    return pd.DataFrame(found, columns=["Object", *MODULI.values(), "Recorded with", "Provenance"])


def ticks(found: Sequence[Modulus]) -> list[float]:
    """Round values on a logarithmic axis that holds all moduli and intervals, rising [Pa].

    The first and the last are the axis' ends. Steps of 1, 2 and 5, or decades, or several decades,
    whichever are few enough to be labelled. Nothing for no moduli.
    """
    ends = [end for one in found for end in (one.value, one.low, one.high) if end is not None]
    if not ends:
        return []
    low, high = min(ends), max(ends)
    first, last = math.floor(math.log10(low)), math.floor(math.log10(high)) + 1
    fine = [step * 10.0**power for power in range(first, last + 1) for step in STEPS]
    start = max(at for at, tick in enumerate(fine) if tick <= low)
    stop = min(at for at, tick in enumerate(fine) if tick >= high and at > start)
    if stop - start < MOST_TICKS:
        return fine[start : stop + 1]
    width = math.ceil((last - first) / (MOST_TICKS - 1))
    return [10.0**power for power in range(first, last + width, width)]


def _row(method: str, found: Mapping, verdict: str = "") -> dict[str, str]:
    """Row of the table of moduli; whether a bound ended the search for them."""
    told = {"Method": method}
    for name, head in COMPARED.items():
        one = cells(Modulus.of_row(found, name), found)
        interval = f" ({one['interval']})" if one and one["interval"] else ""
        told[head] = one["value"] + interval if one else ""
    return told | {"Verdict on nu, warnings": verdict}


def _line(row: Mapping, axis: Sequence[float], pages: Sequence[str]) -> dict:
    """An estimate of the table of all objects."""
    name, young = row["object"], Modulus.of_row(row, YOUNG)
    return {
        "title": title_of(name),
        "link": f"{name}/report.html" if name in pages else "",
        "bar": _bar(young, axis) if young else None,
        "moduli": [cells(Modulus.of_row(row, column)) for column in MODULI],
        "by": by(row),
    }


def _bar(modulus: Modulus, axis: Sequence[float]) -> dict:
    """Interval and value on the axis [px]; a value that is not identified is hollow."""
    ends = {"low": modulus.low, "high": modulus.high} if modulus.high is not None else {}
    bar = {key: _across(one, axis) for key, one in (ends | {"value": modulus.value}).items()}
    return {"low": None} | bar | {"hollow": modulus.verdict != IDENTIFIED}


def _tick(value: float) -> str:
    scale, unit = readable(value, "Pa")
    return f"{scale * value:.3g} {unit}"


def _across(value: float, axis: Sequence[float]) -> float:
    """Place of a modulus on the axis [px]."""
    share = math.log(value / axis[0]) / math.log(axis[-1] / axis[0])
    return round(MARGIN + share * (WIDTH - 2 * MARGIN), 1)
