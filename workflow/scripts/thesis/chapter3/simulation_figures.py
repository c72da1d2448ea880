"""Figures 3.5, 3.6, 3.7 and 3.9: what the methods do on the simulated block."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from palpate.json_fields import read_one
from palpate.report.style import BLACK, BLUE, GREEN, ORANGE, PAGE_IN, finished
from palpate.report.tables import bound_mark
from palpate.units import KILOPASCALS, MILLIMETRES

from thesis.diagrams import entitle

PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#56B4E9", "#E69F00")
MARKS = ("o", "s", "^", "D", "v", "P")
METHODS = {
    "linear_method": "linear method",
    "minimise_displacement": "minimised: displacement",
    "minimise_force_displacement": "minimised: force and displacement",
}
HEIGHT_IN, LEGEND_IN = 2.6, 0.22
PUBLISHED = "published"
# Of a search that starts far off, the panels show the range of the later iterations.
LATER = 0.15


def _known_values(inputs: Any, params: Any) -> list[tuple[str, float, float]]:
    """Label, lambda and mu [Pa] of the true values, where known, and of the study's result."""
    truth, published = read_one(inputs.truth), pd.read_csv(inputs.published)
    found = {} if truth is None else {(truth["lambda_pa"], truth["mu_pa"]): "true"}
    rows = published[(published["method"] == params.method) & (published["data"] == params.data)]
    for pair in rows[["lame_lambda_pa", "lame_mu_pa"]].itertuples(index=False, name=None):
        found[pair] = "true and published" if pair in found else PUBLISHED
    return [(label, *pair) for pair, label in found.items()]


def linear_traces(inputs: Any, params: Any) -> Figure:
    """Lambda, mu and residual of the linear method, first start (Fig. 3.5 and 3.7)."""
    result, lines = read_one(inputs.result), _known_values(inputs, params)
    figure, axes = _three("Residual (N)")
    trace = result["estimates"][0]["trace"]
    _draw(axes, trace, "residual_n", 1, color=BLUE, label="found")
    if trace[-1]["residual_n"] < 1e-3 * trace[0]["residual_n"]:
        axes[2].set_yscale("log")
    else:
        axes[2].set_ylim(bottom=0)
    _known(axes, lines)
    return _titled(figure, axes, misfit="Residual")


def linear_starts(inputs: Any, params: Any) -> Figure:
    """The same from every start (Fig. 3.6)."""
    result, lines = read_one(inputs.result), _known_values(inputs, params)
    figure, axes = _three("Residual (N)", legend_in=LEGEND_IN)
    for k, estimate in enumerate(result["estimates"]):
        lam, mu = (f"{value * KILOPASCALS:g}" for value in estimate["start_pa"])
        look = {"color": PALETTE[k % len(PALETTE)], "marker": MARKS[k % len(MARKS)], "ms": 3.5}
        label = f"λ {lam}, μ {mu} kPa"
        _draw(axes, estimate["trace"], "residual_n", 1, label=label, markevery=[0], **look)
    for panel in axes:
        positive = all((line.get_ydata() > 0).all() for line in panel.get_lines())
        panel.set_yscale("log") if positive else panel.set_yscale("symlog", linthresh=10)
    handles, labels = axes[0].get_legend_handles_labels()
    _known(axes, lines)
    _titled(figure, axes, misfit="Residual", legend_in=LEGEND_IN)
    figure.legend(handles, labels, title="start", loc="lower center", ncol=5, fontsize=6.8,
                  title_fontsize=7, bbox_to_anchor=(0.45, 0.0), columnspacing=1.2)  # fmt: skip
    return figure


def minimisation_trace(inputs: Any, params: Any) -> Figure:
    """Lambda, mu and error of the error minimisation against iteration (Fig. 3.9)."""
    result, lines = read_one(inputs.result), _known_values(inputs, params)
    figure, axes = _three("Error (mm)")
    _draw(axes, result["trace"], "error_m", MILLIMETRES, color=BLUE, label="found")
    axes[2].set_ylim(bottom=0)
    _known(axes, lines, mark=bound_mark(result))
    for panel in axes[:2]:
        _show_later(panel)
    return _titled(figure, axes, misfit="Error")


def noise_figure(table: pd.DataFrame) -> Figure:
    """Lame parameters of `noise_table` against noise, by method, median and quartiles."""
    figure, axes = plt.subplots(1, 2, figsize=(PAGE_IN, HEIGHT_IN + 0.2))
    for panel, name, symbol in zip(axes, ("lame_lambda_pa", "lame_mu_pa"), "λμ", strict=True):
        for k, (method, rows) in enumerate(table.groupby("method", sort=True)):
            noise = rows["noise_std_m"].to_numpy(float) * MILLIMETRES
            middle, low, high = (
                rows[f"{part}_{name}"].to_numpy(float) * KILOPASCALS
                for part in ("median", "low", "high")
            )
            look = {"color": PALETTE[k], "marker": MARKS[k], "ms": 3.5}
            panel.plot(noise, middle, label=METHODS[method], **look)
            panel.fill_between(noise, low, high, color=PALETTE[k], alpha=0.2, lw=0)
        true = table[f"true_{name}"].iloc[0]
        if np.isfinite(true):
            panel.axhline(true * KILOPASCALS, color=BLACK, lw=0.7, label="true")
        panel.set_xscale("log")
        panel.set_xlabel("Noise per coordinate, standard deviation (mm)")
        panel.set_ylabel(f"{symbol} (kPa)")
    axes[0].legend(loc="lower left")
    return _titled(figure, axes)


def _three(last: str, *, legend_in: float = 0.0) -> tuple[Figure, list[Axes]]:
    figure, axes = plt.subplots(1, 3, figsize=(PAGE_IN, HEIGHT_IN + legend_in))
    for panel, label in zip(axes, ("λ (kPa)", "μ (kPa)", last), strict=True):
        panel.set_ylabel(label)
        panel.set_xlabel("Iteration")
    return figure, list(axes)


def _draw(axes: Sequence[Axes], trace: Sequence[Mapping], last: str, scale: float, **look) -> None:
    iteration = [step["iteration"] for step in trace]
    series = (("lame_lambda_pa", KILOPASCALS), ("lame_mu_pa", KILOPASCALS), (last, scale))
    for panel, (name, factor) in zip(axes, series, strict=True):
        panel.plot(iteration, np.array([step[name] for step in trace]) * factor, **look)
        panel.margins(x=0.02)


def _known(axes: Sequence[Axes], lines: Sequence[tuple], *, mark: str = "") -> None:
    for name, *values in lines:
        dash = (0, (5, 3)) if name == PUBLISHED else "-"
        look = {"color": BLACK, "lw": 0.7, "ls": dash, "zorder": 1}
        for panel, value in zip(axes, values, strict=False):
            label = f"{name} {value * KILOPASCALS:.1f} kPa"
            panel.axhline(value * KILOPASCALS, label=label, **look)
    for panel in axes[:2]:
        drawn = panel.get_lines()
        if drawn[0].get_label() == "found":
            drawn[0].set_label(f"found {drawn[0].get_ydata()[-1]:.1f} kPa{mark}")
            _under(panel, drawn)
        elif lines:
            _under(panel, drawn[-len(lines) :])


def _under(axes: Axes, drawn: Sequence[Line2D]) -> None:
    look = {"fontsize": 6.8, "labelspacing": 0.25, "borderaxespad": 0}
    axes.legend(handles=drawn, loc="upper left", bbox_to_anchor=(0, -0.32), **look)


def _show_later(axes: Axes) -> None:
    """Limit an axis to the later iterations and the known values; say where the trace began."""
    trace, *known = (np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines())
    later = np.concatenate([trace[int(LATER * len(trace)) :], *known])
    pad = 0.45 * np.ptp(later)
    if trace[0] > later.max() + pad:
        axes.set_ylim(later.min() - pad, later.max() + pad)
        text = f"first {trace[0]:.0f} kPa"
        axes.text(0.97, 0.93, text, transform=axes.transAxes, ha="right", fontsize=6.8)


def _titled(figure: Figure, axes: Sequence, *, misfit: str = "", legend_in: float = 0) -> Figure:
    titles = ("Lamé's first parameter", "Shear modulus", misfit)
    finished(figure, {"simulated"})
    for panel, title, letter in zip(axes, titles, "abc", strict=False):
        entitle(panel, title, letter)
    figure.tight_layout(rect=(0, 0.03 + legend_in / figure.get_figheight(), 1, 1))
    return figure
