"""Page of one object: how stiff it is, how well that is known, and from what."""

import base64
from collections.abc import Mapping, Sequence

import pandas as pd

from palpate.capture.discover import CURVE
from palpate.modulus import LABELS, VERDICTS, Modulus, verdicts_in
from palpate.report.style import sensor_name
from palpate.report.tables import AT_BOUND_NOTE, SIMULATED_NOTE, bound_mark
from palpate.units import MILLIMETRES

TITLES = LABELS | {"reduced_modulus_pa": "E* = E/(1 - nu^2)"}
METHODS = {
    "direct_joint": "direct, all captures together",
    "direct": "direct",
    "curve_table": "curve without a camera, indentation table",
    "curve_hertz": "curve without a camera, Hertz",
    "hertz": "Hertz fit (Eq. 5.1)",
    "hertz_free_contact": "Hertz fit, contact point free",
    "hertz_recommended": "Hertz, recommended contact model",
}
CAPTIONS = {
    "moduli": "E and nu of each capture and of all together, with 95 % intervals; open symbols:"
    " every verdict but *identified*.",
    "hertz_fit": "Hertz model fitted to force and depth. Where the points leave the curve"
    " systematically, trust the direct estimate more.",
    "surface": "What the camera sees in the deepest frame, the tracked surface, and a section"
    " through the dent. Surface and points should lie on each other away from the probe.",
}
WHICH = (
    "Compare objects by the equivalent E*: of the neo-Hookean solid that answers with the same"
    " force at the depth given. E*, E and nu are those of small strain, for computing with: they"
    " carry the doubt of how the material stiffens. The law of the force is 0 for neo-Hooke's solid"
    " and 1 for Blatz and Ko's."
)
# Sources of a budget that are shown, as they add at least this part of the largest.
LEAST_PART = 0.1
# From here on the motion of the surface differs from the model's by much more than its noise.
LARGE_SCALE = 3.0


def own_page(
    name: str,
    summary: pd.DataFrame,
    presses: Sequence[Mapping],
    pictures: Mapping[str, bytes],
    budgets: Mapping[str, Sequence[Mapping]],
) -> str:
    """Write an object's page.

    Parameters
    ----------
    name : str
        The object.
    summary : DataFrame
        Its summary.csv.
    presses : sequence of mapping
        Of `press_of`, a row of the table of captures each.
    pictures : mapping
        PNG by name, in their order; names as in `CAPTIONS`.
    budgets : mapping
        Rows of the uncertainty budget by sensor.

    Returns
    -------
    str
        Markdown, the pictures within it.

    Raises
    ------
    ValueError
        If the summary recommends nothing.
    """
    advised = summary[summary["recommended"]]
    if not len(advised):
        raise ValueError("recommended: expected a row for each sensor, found none")
    lines = [f"# {name.replace('_', ' ').capitalize()}", ""]
    if (summary["provenance"] == "simulated").any():
        lines += [SIMULATED_NOTE, ""]
    lines += ["## How stiff", "", *_advised(advised), "", WHICH, "", *_meanings(advised)]
    lines += [*_doubts(advised), *_budgets(budgets)]
    lines += _pictures(pictures)
    lines += ["", "## Captures", "", *_table(presses), "", "## All estimates", ""]
    rows = summary.to_dict("records")
    lines += _table([_estimate(row) for row in rows])
    if any(bound_mark(row) for row in rows):
        lines += ["", AT_BOUND_NOTE]
    return "\n".join(lines) + "\n"


def press_of(capture: Mapping, fit: Mapping, direct: Mapping) -> dict[str, str]:
    """What a capture held, as text.

    Parameters
    ----------
    capture : mapping
    fit, direct : mapping
        Its hertz.json and direct.json. The depth is that of the tip as it was recorded, and the
        constant error of it that the direct estimate found.
    """
    force, residual = fit["samples"]["force_n"], direct["residuals"][0]
    offset = direct["nuisances"][0]["offset_m"]
    depth = max(fit["samples"]["depth_m"]) + offset
    return {
        "sensor": sensor_name(capture["sensor"]),
        "capture": str(capture["capture"]),
        "frames": str(len(force)),
        "frames compared": str(direct["frames"][0]),
        "peak force (N)": f"{max(force):.2f}",
        "greatest depth (mm)": f"{depth * MILLIMETRES:.1f}",
        "of it fitted offset (mm)": f"{offset * MILLIMETRES:.1f}",
        "depth over radius": f"{depth / fit['radius_m']:.2f}",
        "places of the surface": str(residual["cells"]),
        "motion's noise over expected": f"{residual['motion_scale']:.1f}",
    }


def _advised(rows: pd.DataFrame) -> list[str]:
    """Recommended row of each sensor, with intervals and verdicts."""
    found = []
    for row in rows.to_dict("records"):
        curve = f" {row['capture']}" if row["sensor"] == CURVE else ""
        cells = {"sensor": sensor_name(row["sensor"]) + curve, "captures": f"{row['captures']:.0f}"}
        cells |= {label: _judged(row, quantity) for quantity, label in TITLES.items()}
        place = f"{row['force_law']:+.2f} ± {row['force_law_std']:.2f}"
        depth = row["equivalent_depth_m"] * MILLIMETRES
        depth = "" if pd.isna(depth) else f"{depth:.1f}"
        found.append(cells | {"equivalent told at (mm)": depth, "law of the force": place})
    return _table(found)


def _judged(row: Mapping, name: str) -> str:
    modulus = Modulus.of_row(row, name)
    return f"{modulus.told()}: {modulus.verdict}" if modulus and modulus.verdict else ""


def _value(row: Mapping, name: str) -> str:
    """Value with its interval; whether a bound ended the search for it."""
    modulus = Modulus.of_row(row, name)
    return modulus.told() + bound_mark(row) if modulus else ""


def _meanings(rows: pd.DataFrame) -> list[str]:
    """What the verdicts in the table say."""
    return [f"- *{verdict}*: {VERDICTS[verdict]}." for verdict in verdicts_in(rows)]


def _doubts(rows: pd.DataFrame) -> list[str]:
    """Lines for sensors whose captures the model explains badly, and what else was told."""
    named = rows[rows["doubts"].notna()] if "doubts" in rows else rows[:0]
    lines = [
        f"- {sensor_name(row['sensor'])}: {doubt}."
        for row in named.to_dict("records")
        for doubt in row["doubts"].split("; ")
    ]
    return lines + [
        f"- {sensor_name(row['sensor'])}: the surface moves unlike the model, by"
        f" {row['motion_scale']:.1f} times what its noise explains. Look at the pictures: the"
        " template, the point or what holds the object may be other than described."
        for row in rows.to_dict("records")
        if row["motion_scale"] > LARGE_SCALE
    ]


def _budgets(budgets: Mapping[str, Sequence[Mapping]]) -> list[str]:
    """What makes the intervals, by sensor: sources and what each adds, the largest first."""
    lines = ["", "## What makes the intervals", ""]
    lines += ["Standard uncertainties that each source of error adds; they add up in squares.", ""]
    for sensor, rows in budgets.items():
        lines += [f"### {sensor_name(sensor)}", "", *_table(_budget_rows(rows)), ""]
    return lines


def _budget_rows(rows: Sequence[Mapping]) -> list[dict[str, str]]:
    heads = {
        "contribution_log_equivalent_reduced_modulus": "of the equivalent (%)",
        "contribution_log_reduced_modulus": "of E* (%)",
        "contribution_log_youngs_modulus": "of E (%)",
        "contribution_poisson_ratio": "of nu",
    }
    most = {name: max(abs(row[name]) for row in rows) for name in heads}
    found = []
    for row in rows:
        if all(abs(row[name]) < LEAST_PART * most[name] for name in heads):
            continue
        cells = {"source": row["source"]}
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        cells |= {"standard uncertainty": f"{row['standard_uncertainty']:.2g}{unit}"}
        for name, head in heads.items():
            cells[head] = f"{100 * row[name]:.1f}" if "%" in head else f"{row[name]:.3f}"
        found.append(cells)
    return found


def _pictures(pictures: Mapping[str, bytes]) -> list[str]:
    lines = []
    for name, content in pictures.items():
        encoded = base64.b64encode(content).decode("ascii")
        lines += ["", f"![{name}](data:image/png;base64,{encoded})", "", CAPTIONS[name]]
    return lines


def _estimate(row: Mapping) -> dict[str, str]:
    """Row of the table of all estimates."""
    cells = {
        "sensor": sensor_name(row["sensor"]),
        "capture": str(row["capture"]),
        "method": METHODS.get(row["method"], row["method"].replace("_", " ")),
    }
    cells |= {label: _value(row, quantity) for quantity, label in TITLES.items()}
    verdict = row["poisson_ratio_verdict"]
    return cells | {"verdict on nu": verdict if isinstance(verdict, str) else ""}


def _table(rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Pipe table of rows with the same keys."""
    head = list(rows[0])
    lines = [head, ["---"] * len(head), *([row[key] for key in head] for row in rows)]
    return ["| " + " | ".join(cells) + " |" for cells in lines]
