"""E and nu of every method against the lab's true materials, in tables and figures."""

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from palpate.json_fields import read_all, read_by_folder
from palpate.markdown import rows_of
from palpate.modulus import IDENTIFIED, LABELS, Modulus, columns
from palpate.report import outputs, tables
from palpate.report.moduli_figure import SCALES, TRUTH, Line, draw_lines, make_moduli
from palpate.report.panels import photo_panel
from palpate.report.style import PAGE_IN, finished, sensor_name
from palpate.report.surface_figures import read_view, section_panel
from palpate.units import KILOPASCALS
from validation.measured import truth_of

TITLE = "E and nu against the virtual lab's truth"
SHORT_TITLE = "Errors and coverage of the intervals, by object, sensor and method"
NOTES = (
    "true_youngs_modulus_pa is the instantaneous modulus; true_youngs_modulus_1s_pa is what a step"
    " of strain leaves of it after a second, as the material relaxes while it is pressed.",
    "Errors of moduli are relative, those of Poisson's ratio absolute; intervals are at 95 %.",
)
PAGE_NOTES = (
    "Moduli in kPa, with 95 % intervals: ✓ holds the truth, ✗ does not. Instantaneous E is the"
    " instantaneous modulus. Bold is the recommended estimate. All columns are in accuracy.csv.",
    "All captures are simulated: they come from the virtual lab, not from recordings.",
    tables.AT_BOUND_NOTE,
)
# Of the page: what is left of E after 1 s stands in the CSV alone.
QUANTITIES = {name: label for name, label in LABELS.items() if "_1s" not in name}
FIRST = ["object", "sensor", "point", "method", "youngs_modulus_pa", "true_youngs_modulus_pa"]
FIRST += ["poisson_ratio", "true_poisson_ratio"]
KEYS = ["object", "sensor", "method"]
# Of the overview.
SHOWN = ("youngs_modulus_pa", "poisson_ratio")
STATISTICS = {
    "median_error": ("error", "median"),
    "rms_error": ("error", lambda errors: (errors**2).mean() ** 0.5),
    "coverage": ("covered", lambda covered: float(covered.astype(float).mean())),
}


def make_accuracy(inputs: Any, params: Any) -> dict:
    """All rows, and their errors by object, sensor and method."""
    materials = read_by_folder(inputs.materials)
    rows = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    rows = rows[rows["object"].isin(materials)]
    short = outputs.table(coverage_table(rows, materials), title=SHORT_TITLE, more_notes=NOTES)
    whole = tables.rounded(accuracy_table(rows, materials)), _text(rows, materials)
    return dict(zip(("csv", "md", "summary", "summary_md"), (*whole, *short.values()), strict=True))


def make_direct_moduli(inputs: Any, params: Any) -> Figure:
    """Moduli of captures and groups, beside the true ones where there are any."""
    truths = {name: truth_of(one) for name, one in read_by_folder(inputs.materials).items()}
    return make_moduli(inputs, params, truths)


def make_overview(inputs: Any, params: Any) -> Figure:
    """Photograph of a capture, section through the dent, and moduli of its object by sensor."""
    (capture,), (fit,) = params.captures, read_all(inputs.fits)
    files = inputs.tracked[0], inputs.clouds[0], fit, inputs.recorded[0]
    view = read_view(*files, params.sensors[0])
    figure = plt.figure(figsize=(PAGE_IN, 2.3))
    grid = figure.add_gridspec(2, 3, width_ratios=(1.3, 1.5, 1))
    photo, section = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[:, 1])
    photo_panel(photo, view.photo)
    photo.set_title("An indentation", y=1.02)
    section_panel(section, view)
    section.set(title="Section through it", xlabel="From the contact (mm)")
    section.legend(loc="lower center", fontsize=6, handlelength=1.4, ncols=3, columnspacing=1)
    found = zip(params.groups, read_all(inputs.joint), strict=True)
    lines = [Line(sensor_name(group["sensor"]), joint, True) for group, joint in found]
    truth = truth_of(read_by_folder(inputs.materials)[capture["object"]])
    panels = [figure.add_subplot(grid[row, 2]) for row in range(2)]
    for panel, quantity in zip(panels, SHOWN, strict=True):
        draw_lines(panel, lines, quantity)
        panel.axvline(truth[quantity] * SCALES[quantity], **TRUTH)
    panels[0].set_title("Moduli")
    return finished(figure, {capture["provenance"]})


def accuracy_table(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> pd.DataFrame:
    """Put the truth beside estimates of simulated captures.

    Parameters
    ----------
    rows : DataFrame
        Estimates of any method, as a summary has them.
    materials : mapping
        material.json by object.

    Returns
    -------
    DataFrame
        For each modulus ``true_<name>``, the error (relative, of nu absolute) and whether the
        interval covers the truth.
    """
    table = rows.copy()
    truths = [truth_of(materials[name]) for name in rows["object"]]
    truths = pd.DataFrame(truths, rows.index, dtype=float)
    for name in LABELS:
        value, low, high = (pd.to_numeric(rows[column]) for column in columns(name)[:3])
        stem, true = name.removesuffix("_pa"), truths[name]
        scale = true if name.endswith("_pa") else 1.0
        covered = true.between(low, high.fillna(np.inf)).astype("boolean")
        table[f"true_{name}"] = true
        table[f"{stem}_error"] = value / scale - true / scale
        table[f"{stem}_covered"] = covered.mask(low.isna() | true.isna())
    return table[[*FIRST, *(name for name in table.columns if name not in FIRST)]]


def coverage_table(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> pd.DataFrame:
    """Errors and coverage of the intervals by object, sensor and method, and over all.

    Parameters
    ----------
    rows, materials : DataFrame and mapping
        As of `accuracy_table`.
    """
    found = accuracy_table(rows, materials)
    verdict = found["poisson_ratio_verdict"]
    found["identified"] = (verdict == IDENTIFIED).astype(float).where(verdict.notna())
    alike = {"object": "all"}, {"object": "all", "sensor": "all"}
    levels = [found, *(found.assign(**names) for names in alike)]
    every = pd.concat(levels, keys=range(len(levels)), names=["level"])
    wanted = {"runs": ("provenance", "size")}
    for stem in (name.removesuffix("_pa") for name in LABELS):
        for kind, (column, statistic) in STATISTICS.items():
            wanted[f"{stem}_{kind}"] = (f"{stem}_{column}", statistic)
    wanted["poisson_ratio_identified"] = ("identified", "mean")
    wanted["provenance"] = ("provenance", "first")
    return every.groupby(["level", *KEYS]).agg(**wanted).reset_index().drop(columns="level")


def _text(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> str:
    """Estimates beside the truth in Markdown, a table for each object."""
    lines = [f"# {TITLE}", "", *PAGE_NOTES, ""]
    heads = [label + " (kPa)" * name.endswith("_pa") for name, label in QUANTITIES.items()]
    for name, mine in rows.groupby("object", sort=False):
        truth = truth_of(materials[name])
        cells = [["truth", "", *(_number(truth[of], of) for of in QUANTITIES)]]
        best_first = mine.sort_values("recommended", ascending=False, kind="stable")
        for row in best_first.to_dict("records"):
            bold = "**" * bool(row["recommended"])
            method = f"{bold}{row['method'].replace('_', ' ')}{bold}{tables.bound_mark(row)}"
            of = f"{sensor_name(row['sensor'])} {row['capture']}"
            cells.append([method, of, *(_cell(row, quantity, truth) for quantity in QUANTITIES)])
        lines += [f"## {name.replace('_', ' ').capitalize()}", ""]
        lines += [*rows_of(["method", "of", *heads], cells), ""]
    return "\n".join(lines)


def _cell(row: Mapping, quantity: str, truth: Mapping[str, float]) -> str:
    """Value and interval, and whether that holds the truth."""
    one, true = Modulus.of_row(row, quantity), truth[quantity]
    if one is None:
        return ""
    text = _number(one.value, quantity)
    if one.low is None:
        return text
    low, high = _number(one.low, quantity), _number(one.high, quantity)
    holds = one.low <= true and (one.high is None or true <= one.high)
    mark = "" if pd.isna(true) else " ✓" if holds else " ✗"
    return f"{text} ({low} {f'to {high}' if high else 'or more'}){mark}"


def _number(value: float | None, quantity: str) -> str:
    """Kilopascals, or Poisson's ratio; nothing for what is not known."""
    if value is None or pd.isna(value):
        return ""
    return f"{KILOPASCALS * value:.1f}" if quantity.endswith("_pa") else f"{value:.2f}"
