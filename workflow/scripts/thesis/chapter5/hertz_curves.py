"""Repeated indentations of a point and the fits at all points: Figures 5.3, A.1 and A.2."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.estimate.hertz.laws import parabola_force
from palpate.json_fields import read_all
from palpate.report import style
from palpate.report.hertz_figures import SHOWN_BEFORE_M, kilopascals, recorded, samples_of
from palpate.units import KILOPASCALS, MILLIMETRES

from thesis.chapter5.hertz_points import ROWS_OF_BLOCK
from thesis.diagrams import entitle, provenances

# Section 5.1: the study's recordings are shifted to meet at this force.
ALIGNED_AT_N = 0.3


def _aligned_depth(fit: Mapping) -> NDArray:
    """Depth of all samples from where the indentation first passes 0.3 N, (n,) [m]."""
    depth, force, used = samples_of(fit)
    over = np.flatnonzero(force[: used.stop] >= ALIGNED_AT_N)
    if not len(over) or over[0] == 0:
        found = f"{force[0]:.3g} to {force.max():.3g} N"
        expected = f"an indentation that passes {ALIGNED_AT_N:g} N"
        raise ValueError(f"force: expected {expected}, found {found}")
    k = slice(over[0] - 1, over[0] + 1)
    return depth - np.interp(ALIGNED_AT_N, force[k], depth[k])


def figure_5_3(inputs: Any, params: Any) -> Figure:
    """Repeated recordings at one point, aligned at 0.3 N, and their moduli (Fig. 5.3)."""
    captures, fits = params.captures, read_all(inputs.fits)
    published = pd.read_csv(inputs.published)
    figure, (curves, moduli) = plt.subplots(
        1, 2, figsize=(style.PAGE_IN, 3.0), width_ratios=(1.7, 1)
    )
    _attempts_panel(curves, fits)
    ours = np.array([fit["study"]["reduced_modulus_pa"] for fit in fits])
    _spread_panel(moduli, ours, published["reduced_modulus_pa"].to_numpy(float))
    first = captures[0]
    title = f"{style.sensor_name(first['sensor'])}, point {first['point']}, {len(fits)} recordings"
    curves.set_title(title)
    figure = style.finished(figure, provenances(params))
    entitle(curves, title, "a")
    entitle(moduli, "Reduced modulus", "b")
    return figure


def figure_a(inputs: Any, params: Any) -> Figure:
    """Hertz fits at all points of the block by one sensor (Fig. A.1 and A.2)."""
    captures, fits = params.captures, read_all(inputs.fits)
    by_point = {int(c["point"]): fit for c, fit in zip(captures, fits, strict=True)}
    columns = -(-max(by_point) // ROWS_OF_BLOCK)
    figure, axes = plt.subplots(
        ROWS_OF_BLOCK,
        columns,
        figsize=(style.PAGE_IN, 4.0),
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    for k, panel in enumerate(axes.T.ravel(), start=1):
        _small_panel(panel, k, by_point.get(k))
    longest = max(samples_of(fit)[0].max() for fit in fits) * MILLIMETRES
    axes[0, 0].set_xlim(-SHOWN_BEFORE_M * MILLIMETRES, longest * 1.06)
    figure.supxlabel("Indentation depth (mm)", fontsize=8, y=0.035)
    figure.supylabel("Force (N)", fontsize=8, x=0.012)
    handles = next(panel.get_lines() for panel in axes.flat if panel.get_lines())
    figure.legend(handles=handles, loc="upper right", ncols=3, borderaxespad=0.2)
    figure.text(0.012, 0.975, style.sensor_name(captures[0]["sensor"]), weight="bold", va="center")
    figure = style.finished(figure, provenances(params))
    figure.subplots_adjust(left=0.075, bottom=0.13, top=0.93, wspace=0.1, hspace=0.14)
    return figure


def _attempts_panel(axes: Axes, fits: Sequence[Mapping]) -> None:
    for k, fit in enumerate(fits):
        depth, force, used = _aligned_depth(fit) * MILLIMETRES, *samples_of(fit)[1:]
        label = "recorded" if k == 0 else None
        axes.plot(
            depth[: used.stop], force[: used.stop], "-", color=style.GREEN, lw=0.8, label=label
        )
        axes.plot(depth[used], force[used], ".", color=style.GREEN, ms=2.5)
    mean = float(np.mean([fit["study"]["reduced_modulus_pa"] for fit in fits]))
    radius = fits[0]["radius_m"]
    start = (0.75 * ALIGNED_AT_N / (mean * np.sqrt(radius))) ** (2 / 3)
    grid = np.linspace(0, axes.dataLim.xmax / MILLIMETRES + start, 200)
    label = f"Hertz (Eq. 5.1), mean E* {mean * KILOPASCALS:.1f} kPa"
    x = (grid - start) * MILLIMETRES
    axes.plot(x, mean * parabola_force(grid, radius), color=style.BLUE, ls=(0, (5, 2)), label=label)
    axes.plot(0, ALIGNED_AT_N, "+", color=style.BLACK, ms=9, mew=1.2, label=f"{ALIGNED_AT_N} N")
    axes.legend(loc="upper left")
    axes.set_xlim(-3.0, x[-1])
    axes.set(xlabel=f"Depth from where the force is {ALIGNED_AT_N} N (mm)", ylabel="Force (N)")


def _spread_panel(axes: Axes, ours: NDArray, printed: NDArray) -> None:
    """Moduli of the attempts in their order, with mean and standard deviation."""
    for place, values, colour in ((0, ours, style.GREEN), (1, printed, style.GREY)):
        values = values * KILOPASCALS
        mean, std = values.mean(), values.std(ddof=1)
        spread = place + np.linspace(-0.3, 0.3, len(values))
        axes.fill_between([place - 0.38, place + 0.38], mean - std, mean + std, color=colour,
                          alpha=0.22, lw=0)  # fmt: skip
        axes.plot([place - 0.38, place + 0.38], [mean, mean], color=colour)
        axes.plot(spread, values, "o", ms=3.4, color=colour, mec=style.BLACK, mew=0.4)
        text = f"{mean:.1f} ± {std:.1f}\n({100 * std / mean:.1f} %)"
        axes.text(place, 0.02, text, ha="center", transform=axes.get_xaxis_transform())
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.22 * (high - low), high)
    axes.set_xticks([0, 1], ["ours", "published\n(Table 5.1)"])
    axes.set(xlim=(-0.5, 1.5), ylabel="E* (kPa), mean ± sd")


def _small_panel(axes: Axes, point: int, fit: Mapping | None) -> None:
    axes.text(0.05, 0.95, f"{point}", transform=axes.transAxes, va="top", weight="bold")
    axes.tick_params(labelsize=style.SMALL)
    if fit is None:
        text = {
            "transform": axes.transAxes,
            "ha": "center",
            "color": style.GREY,
            "fontsize": style.SMALL,
        }
        axes.text(0.5, 0.5, "no recording", **text)
        return
    depth, _, used = samples_of(fit)
    grid = np.linspace(0, depth[used].max(), 150)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(grid, fit["radius_m"])
    axes.plot(grid * MILLIMETRES, model, color=style.BLUE, lw=1.1, label="Hertz (Eq. 5.1)")
    recorded(axes, fit, 2.8)
    text = f"{kilopascals(fit['study'])} kPa"
    axes.text(0.05, 0.78, text, transform=axes.transAxes, va="top", fontsize=style.SMALL)
