"""What each change of the error minimisation does to E and nu, against the virtual lab's truth."""

import json
from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from palpate.json_fields import read_all, read_by_folder
from palpate.report import style, tables
from palpate.report.tables import CAPTURE

from thesis.chapter5.minimisation_figures import COLOURS
from thesis.chapter5.minimise_steps import ALONE, TRUE
from thesis.diagrams import DASHED

# The force is that of a material which has relaxed since the indentation began, about so long ago.
INDENTED_S = 1.0
FOUND = ["youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa"]
RATIOS = ["youngs_modulus_ratio", "relaxed_modulus_ratio", "poisson_ratio_error"]
SPREAD = 0.16
RATIO_TICKS = (0.5, 0.8, 1.0, 1.25, 2.0, 4.0)
ROWS = {
    "relaxed_modulus_ratio": "E over the truth\na second after a step",
    "poisson_ratio": "Poisson's ratio",
}


def make_minimise_steps_table(inputs: Any, params: Any) -> dict:
    """All rows as CSV, their medians as Markdown, and the figure of one error option."""
    results, truth = read_all(inputs.results), read_by_folder(inputs.materials)
    whole = steps_table(params.captures, results, truth)
    short, notes = tables.rounded(steps_summary(whole)), [params.note, tables.SIMULATED_NOTE]
    return {
        "csv": tables.rounded(whole),
        "md": tables.to_markdown(short, title=params.heading, notes=notes),
        "figure": steps_figure(whole, params.shown),
    }


def relaxed_modulus(material: Mapping, time_s: float) -> float:
    """Young's modulus a time after a step of strain (Prony series) [Pa].

    Parameters
    ----------
    material : mapping
        material.json: instantaneous ``youngs_modulus_pa`` and, if it relaxes, ``relaxation``.
    time_s : float
    """
    series = material.get("relaxation") or {"fractions": [], "times_s": []}
    fractions, times = (np.array(series[name], dtype=float) for name in ("fractions", "times_s"))
    lost = float(fractions @ (1 - np.exp(-time_s / times)))
    return material["youngs_modulus_pa"] * (1 - lost)


def steps_table(
    captures: Sequence[Mapping],
    results: Sequence[Sequence[Mapping]],
    materials: Mapping[str, Mapping],
) -> pd.DataFrame:
    """E and nu of each capture, error option and step, beside the truth.

    Parameters
    ----------
    captures : sequence of mapping
        ``object, sensor, capture, point, provenance``.
    results : sequence
        minimise_steps.json of each capture.
    materials : mapping
        material.json by object.

    Returns
    -------
    DataFrame
        ``kind`` says whether a step is added to those before it, stands alone, or is added on the
        true surface; ``changes`` which options differ. ``youngs_modulus_ratio`` is E over the
        instantaneous truth and ``relaxed_modulus_ratio`` E over that a second after a step.
    """
    rows = []
    for capture, result in zip(captures, results, strict=True):
        known = {name: capture[name] for name in CAPTURE}
        material = materials[capture["object"]]
        for step in result:
            row = {name: value for name, value in step.items() if name != "changes"}
            row |= {"changes": _named(step["changes"]), **_against(step, material)}
            rows.append(known | row | {"provenance": capture["provenance"]})
    first = [*CAPTURE, "error", "kind", "step", "changes", "surface", *FOUND, "error_m", "at_bound"]
    last = ["poisson_ratio_verdict", "nodes", "left_out_nodes", *RATIOS]
    truth = [f"true_{name}" for name in ("youngs_modulus_pa", "relaxed_modulus_pa", *FOUND[1:])]
    return pd.DataFrame(rows)[[*first, *last, *truth, "provenance"]]


def steps_summary(table: pd.DataFrame) -> pd.DataFrame:
    """Medians over the captures of each object, by error option and step, in their order.

    Returns
    -------
    DataFrame
        Median E over the relaxed truth and its largest deviation from 1, median and largest
        error of nu, by object; ``captures`` of them, and how many of those ended at a bound.
    """
    groups = table.groupby(["object", "error", "kind", "step"], sort=False)
    found = groups.agg(
        captures=("at_bound", "size"),
        captures_at_bound=("at_bound", "sum"),
        youngs_modulus_ratio=("youngs_modulus_ratio", "median"),
        relaxed_modulus_ratio=("relaxed_modulus_ratio", "median"),
        relaxed_modulus_largest_deviation=(
            "relaxed_modulus_ratio",
            lambda ratio: (ratio - 1).abs().max(),
        ),
        poisson_ratio_error=("poisson_ratio_error", "median"),
        poisson_ratio_largest_error=("poisson_ratio_error", lambda error: error.abs().max()),
        provenance=("provenance", "first"),
    ).reset_index()
    return found.sort_values(["object", "error"], kind="stable", ignore_index=True)


def _named(changes: Mapping) -> str:
    """Changed options in one cell."""
    words = {name: v if isinstance(v, str) else json.dumps(v) for name, v in changes.items()}
    return "; ".join(f"{name}={word}" for name, word in words.items()) or "none"


def _against(step: Mapping, material: Mapping) -> dict:
    E, nu = step["youngs_modulus_pa"], step["poisson_ratio"]
    relaxed = relaxed_modulus(material, INDENTED_S)
    return {
        "youngs_modulus_ratio": round(E / material["youngs_modulus_pa"], 4),
        "relaxed_modulus_ratio": round(E / relaxed, 4),
        "poisson_ratio_error": round(nu - material["poisson_ratio"], 4),
        "true_relaxed_modulus_pa": relaxed,
        **{f"true_{name}": material[name] for name in FOUND},
    }


def steps_figure(table: pd.DataFrame, error: str) -> Figure:
    """E over the truth and nu of each capture, by object and step, with one error option."""
    shown = table[table["error"] == error]
    names, size = list(dict.fromkeys(shown["object"])), (style.PAGE_IN, 5.4)
    shared = {"sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = plt.subplots(2, len(names), figsize=size, **shared)
    for k, name in enumerate(names):
        mine = shown[shown["object"] == name]
        for panel, column in zip(axes[:, k], ROWS, strict=True):
            _draw(panel, mine, column)
        axes[0, k].set_title(name.replace("foam_", "").capitalize())
    for panel, letter in zip(axes.flat, ascii_lowercase, strict=False):
        style.panel_letter(panel, letter)
    for row, label in zip(axes[:, 0], ROWS.values(), strict=True):
        row.set_ylabel(label)
    _ratio_axis(axes[0, 0])
    axes[1, 0].set_ylim(0, 0.5)
    figure.tight_layout(rect=(0, 0.09, 1, 1))
    _explain(figure, shown, error)
    style.label_provenance(figure, set(shown["provenance"]))
    return figure


def _draw(panel: Axes, rows: pd.DataFrame, column: str) -> None:
    """Each capture's steps joined, those that stand alone beside them, and the truth."""
    steps = list(dict.fromkeys(rows["step"]))
    keys = list(dict.fromkeys(zip(rows["sensor"], rows["capture"], strict=True)))
    shifts = np.linspace(-SPREAD, SPREAD, len(keys)) if len(keys) > 1 else [0.0]
    for shift, (sensor, capture) in zip(shifts, keys, strict=True):
        mine = rows[(rows["sensor"] == sensor) & (rows["capture"] == capture)]
        look = {"color": COLOURS.get(sensor, style.GREY), "ms": 3.5, "lw": 0.7, "clip_on": False}
        kinds = mine["kind"]
        # Added in turn, each alone, and on the true surface.
        for chosen, line in (
            (~kinds.isin([ALONE, TRUE]), {"marker": "o", "ls": "-"}),
            (kinds == ALONE, {"marker": "x", "ls": ""}),
            (kinds == TRUE, {"marker": "o", "ls": ":", "mfc": "white"}),
        ):
            place = np.array([steps.index(step) for step in mine[chosen]["step"]]) + shift
            panel.plot(place, mine[chosen][column], **line, **look)
    true = 1.0 if column != "poisson_ratio" else rows["true_poisson_ratio"].iloc[0]
    panel.axhline(true, color=style.BLACK, lw=0.8, ls=DASHED)
    labels = [step.replace("_", " ") for step in steps]
    panel.set_xticks(range(len(steps)), labels, rotation=55, ha="right", fontsize=style.SMALL)


def _ratio_axis(panel: Axes) -> None:
    """Logarithmic, so that half and double stand alike, with plain numbers."""
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    low, high = min(low, RATIO_TICKS[1]), max(high, RATIO_TICKS[3])
    ticks = [tick for tick in RATIO_TICKS if low <= tick <= high]
    panel.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    panel.minorticks_off()
    panel.set_ylim(low, high)


def _explain(figure: Figure, rows: pd.DataFrame, error: str) -> None:
    look = {"ms": 3.5, "lw": 0.7}
    lines = {
        f"{style.sensor_name(name)}, added in turn": {
            "color": COLOURS.get(name, style.GREY),
            "marker": "o",
        }
        for name in dict.fromkeys(rows["sensor"])
    }
    lines["alone"] = {"marker": "x", "ls": ""}
    lines["on the true surface"] = {"marker": "o", "ls": ":", "mfc": "white"}
    lines["truth"] = {"lw": 0.8, "ls": DASHED}
    handles = [
        plt.Line2D([], [], **({"color": style.BLACK} | look | line), label=name)
        for name, line in lines.items()
    ]
    title, place = f"error of {style.ERROR_NAMES[error]}", {"bbox_to_anchor": (0.5, 0.02)}
    figure.legend(handles=handles, title=title, loc="lower center", ncols=len(lines), **place)
