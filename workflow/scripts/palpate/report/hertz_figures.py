"""Curves of the Hertz model: Figures 5.2, 5.3, A.1 and A.2."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import t as student

from palpate.estimate.hertz.laws import parabola_force
from palpate.json_fields import read_all
from palpate.modulus import CONFIDENCE
from palpate.report.hertz_tables import ROWS_OF_BLOCK
from palpate.report.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    SMALL,
    entitle,
    finished,
    sensor_name,
)
from palpate.units import KILOPASCALS, MILLIMETRES, MILLINEWTONS

# Section 5.1: the study's recordings are shifted to meet at this force.
ALIGNED_AT_N = 0.3
SHOWN_BEFORE_M = 0.002


def make_hertz_fits(inputs: Any, params: Any) -> Figure:
    """Hertz model fitted to each capture."""
    return figure_5_2(params.captures, read_all(inputs.fits))


def curve_band(fit: Mapping, depth_m: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Curve of the fit with a free contact point, and the 95 % band of its mean.

    Linear propagation of both parameters' errors, with their correlation, for independent
    residuals of equal variance.

    Parameters
    ----------
    fit : mapping
        hertz.json of a capture.
    depth_m : (n,) array
        Depths to show [m].

    Returns
    -------
    force_n, low_n, high_n : (n,) arrays
    """
    free, (measured, _, used) = fit["free_contact"], _samples(fit)
    curve, slopes = _free_curve(fit, depth_m)
    _, fitted = _free_curve(fit, measured[: used.stop])
    freedom = len(fitted) - fitted.shape[1]
    variance = free["rms_n"] ** 2 * len(fitted) / freedom
    covariance = np.linalg.pinv(fitted.T @ fitted) * variance
    std = np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
    width = student.ppf((1 + CONFIDENCE) / 2, freedom) * std
    return curve, curve - width, curve + width


def aligned_depth(fit: Mapping, *, force_n: float = ALIGNED_AT_N) -> NDArray:
    """Depth of all samples from where the press first passes a force (Fig. 5.3).

    Parameters
    ----------
    fit : mapping
        hertz.json of a capture.
    force_n : float
        Force at which the depth is to be zero [N].

    Returns
    -------
    (n,) array
        Depth [m].

    Raises
    ------
    ValueError
        If the press does not pass the force.
    """
    depth, force, used = _samples(fit)
    over = np.flatnonzero(force[: used.stop] >= force_n)
    if not len(over) or over[0] == 0:
        found = f"{force[0]:.3g} to {force.max():.3g} N"
        raise ValueError(f"force: expected a press that passes {force_n:g} N, found {found}")
    k = slice(over[0] - 1, over[0] + 1)
    return depth - np.interp(force_n, force[k], depth[k])


def figure_5_2(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> Figure:
    """Hertz model fitted to one point per sensor, with range and residuals (Fig. 5.2).

    Parameters
    ----------
    captures : sequence of mapping
        ``sensor, point, provenance`` of each capture.
    fits : sequence of mapping
        hertz.json of each.
    """
    count = len(fits)
    figure, axes = plt.subplots(
        2,
        count,
        figsize=(max(COLUMN_IN, PAGE_IN * count / 2), 4.1),
        height_ratios=(3, 1),
        sharex=True,
        sharey="row",
        squeeze=False,
    )
    titles = [f"{sensor_name(one['sensor'])}, point {one['point']}" for one in captures]
    if len(set(titles)) < count:
        titles = [f"{sensor_name(one['sensor'])}, {one['capture']}" for one in captures]
    for column, title, fit in zip(axes.T, titles, fits, strict=True):
        _fit_panel(column[0], fit)
        _residual_panel(column[1], fit)
        column[0].set_title(title)
    axes[0, 0].set_ylabel("Force (N)")
    axes[1, 0].set_ylabel("Residual (mN)")
    figure.align_ylabels(axes[:, 0])
    return finished(figure, {capture["provenance"] for capture in captures})


def figure_5_3(
    captures: Sequence[Mapping], fits: Sequence[Mapping], published: pd.DataFrame
) -> Figure:
    """Repeated recordings at one point, aligned at 0.3 N, and their moduli (Fig. 5.3).

    Parameters
    ----------
    captures : sequence of mapping
    fits : sequence of mapping
        hertz.json of each attempt.
    published : DataFrame
        config/published/table_5_1.csv.
    """
    figure, (curves, moduli) = plt.subplots(1, 2, figsize=(PAGE_IN, 3.0), width_ratios=(1.7, 1))
    _attempts_panel(curves, fits)
    ours = np.array([fit["study"]["reduced_modulus_pa"] for fit in fits])
    _spread_panel(moduli, ours, published["reduced_modulus_pa"].to_numpy(float))
    first = captures[0]
    title = f"{sensor_name(first['sensor'])}, point {first['point']}, {len(fits)} recordings"
    curves.set_title(title)
    figure = finished(figure, {capture["provenance"] for capture in captures})
    entitle(curves, title, "a")
    entitle(moduli, "Reduced modulus", "b")
    return figure


def figure_a(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> Figure:
    """Hertz fits at all points of the block by one sensor (Fig. A.1 and A.2).

    Parameters
    ----------
    captures : sequence of mapping
        One capture for each point, all of one sensor.
    fits : sequence of mapping
        hertz.json of each.
    """
    by_point = {int(c["point"]): fit for c, fit in zip(captures, fits, strict=True)}
    columns = -(-max(by_point) // ROWS_OF_BLOCK)
    figure, axes = plt.subplots(
        ROWS_OF_BLOCK, columns, figsize=(PAGE_IN, 4.0), sharex=True, sharey=True, squeeze=False
    )
    for k, panel in enumerate(axes.T.ravel(), start=1):
        _small_panel(panel, k, by_point.get(k))
    longest = max(_samples(fit)[0].max() for fit in fits) * MILLIMETRES
    axes[0, 0].set_xlim(-SHOWN_BEFORE_M * MILLIMETRES, longest * 1.06)
    figure.supxlabel("Indentation depth (mm)", fontsize=8, y=0.035)
    figure.supylabel("Force (N)", fontsize=8, x=0.012)
    handles = next(panel.get_lines() for panel in axes.flat if panel.get_lines())
    figure.legend(handles=handles, loc="upper right", ncols=3, borderaxespad=0.2)
    figure.text(0.012, 0.975, sensor_name(captures[0]["sensor"]), weight="bold", va="center")
    figure = finished(figure, {capture["provenance"] for capture in captures})
    figure.subplots_adjust(left=0.075, bottom=0.13, top=0.93, wspace=0.1, hspace=0.14)
    return figure


def _samples(fit: Mapping) -> tuple[NDArray, NDArray, slice]:
    """Depth [m], force [N], and the samples that the fit uses."""
    first, last = fit["range"]["first_frame"], fit["range"]["last_frame"]
    samples = fit["samples"]
    return np.array(samples["depth_m"]), np.array(samples["force_n"]), slice(first, last + 1)


def _free_curve(fit: Mapping, depth_m: NDArray) -> tuple[NDArray, NDArray]:
    """Force of Eq. 5.1 and its slopes in log E* and in the contact's depth."""
    free, radius = fit["free_contact"], fit["radius_m"]
    E_star, baseline = free["reduced_modulus_pa"], free.get("baseline_n", 0.0)
    shifted = np.maximum(depth_m - free["contact_depth_m"], 0)
    force = E_star * parabola_force(shifted, radius)
    slopes = [force, -2 * E_star * np.sqrt(radius * shifted)]
    if baseline:
        slopes.append(np.ones_like(force))
    return force + baseline, np.column_stack(slopes)


def _fit_panel(axes: Axes, fit: Mapping) -> None:
    depth, force, used = _samples(fit)
    free = fit["free_contact"]
    grid = np.linspace(-SHOWN_BEFORE_M, depth[used].max(), 300)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(grid, fit["radius_m"])
    other, low, high = curve_band(fit, grid)
    x = grid * MILLIMETRES
    axes.fill_between(x, low, high, color=GREEN, alpha=0.25, lw=0, label="95 % band")
    axes.plot(x, other, color=GREEN, label=f"contact point free, {_range(free)}")
    label = f"Hertz (Eq. 5.1), E* {_kpa(fit['study'])} kPa"
    axes.plot(x, model, color=BLUE, ls=(0, (5, 2)), label=label)
    _recorded(axes, fit, 3.4)
    place = free["contact_depth_m"] * MILLIMETRES
    axes.plot(
        place, 0, "|", ms=11, mew=1.6, color=BLACK, label=f"contact point {_signed(place)} mm"
    )
    axes.legend(loc="upper left", fontsize=SMALL, handlelength=1.8)
    axes.set_xlim(left=-SHOWN_BEFORE_M * MILLIMETRES)
    axes.set_ylim(top=1.3 * force.max())


def _recorded(axes: Axes, fit: Mapping, size: float) -> None:
    depth, force, used = _samples(fit)
    x, other = depth * MILLIMETRES, np.ones(len(depth), bool)
    other[used] = False
    look = {"mfc": "none", "mec": GREY, "mew": 0.7, "label": "recorded"}
    axes.plot(x[other], force[other], "o", ms=size, **look)
    axes.plot(x[used], force[used], "o", ms=size, mew=0, color=ORANGE, label="range of the fit")


def _residual_panel(axes: Axes, fit: Mapping) -> None:
    depth, force, used = _samples(fit)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(depth, fit["radius_m"])
    free, _ = _free_curve(fit, depth)
    for values, marker, colour in ((model, "s", BLUE), (free, "o", GREEN)):
        residual = (force - values)[used] * MILLINEWTONS
        look = {"ms": 3, "color": colour, "lw": 0.7, "mew": 0}
        axes.plot(depth[used] * MILLIMETRES, residual, marker=marker, **look)
    axes.axhline(0, color=BLACK, lw=0.6)
    rms = [fit[name]["rms_n"] * MILLINEWTONS for name in ("study", "free_contact")]
    text = f"rms {rms[0]:.0f} mN; contact point free {rms[1]:.0f} mN"
    axes.set_title(text, fontsize=SMALL, weight="normal", pad=2)
    axes.set_xlabel("Indentation depth (mm)")


def _attempts_panel(axes: Axes, fits: Sequence[Mapping]) -> None:
    for k, fit in enumerate(fits):
        depth, force, used = aligned_depth(fit) * MILLIMETRES, *_samples(fit)[1:]
        label = "recorded" if k == 0 else None
        axes.plot(depth[: used.stop], force[: used.stop], "-", color=GREEN, lw=0.8, label=label)
        axes.plot(depth[used], force[used], ".", color=GREEN, ms=2.5)
    mean = float(np.mean([fit["study"]["reduced_modulus_pa"] for fit in fits]))
    radius = fits[0]["radius_m"]
    start = (0.75 * ALIGNED_AT_N / (mean * np.sqrt(radius))) ** (2 / 3)
    grid = np.linspace(0, axes.dataLim.xmax / MILLIMETRES + start, 200)
    label = f"Hertz (Eq. 5.1), mean E* {mean * KILOPASCALS:.1f} kPa"
    x = (grid - start) * MILLIMETRES
    axes.plot(x, mean * parabola_force(grid, radius), color=BLUE, ls=(0, (5, 2)), label=label)
    axes.plot(0, ALIGNED_AT_N, "+", color=BLACK, ms=9, mew=1.2, label=f"{ALIGNED_AT_N} N")
    axes.legend(loc="upper left")
    axes.set_xlim(-3.0, x[-1])
    axes.set(xlabel=f"Depth from where the force is {ALIGNED_AT_N} N (mm)", ylabel="Force (N)")


def _spread_panel(axes: Axes, ours: NDArray, printed: NDArray) -> None:
    """Moduli of the attempts in their order, with mean and standard deviation."""
    for place, values, colour in ((0, ours, GREEN), (1, printed, GREY)):
        values = values * KILOPASCALS
        mean, std = values.mean(), values.std(ddof=1)
        spread = place + np.linspace(-0.3, 0.3, len(values))
        axes.fill_between([place - 0.38, place + 0.38], mean - std, mean + std, color=colour,
                          alpha=0.22, lw=0)  # fmt: skip
        axes.plot([place - 0.38, place + 0.38], [mean, mean], color=colour)
        axes.plot(spread, values, "o", ms=3.4, color=colour, mec=BLACK, mew=0.4)
        text = f"{mean:.1f} ± {std:.1f}\n({100 * std / mean:.1f} %)"
        axes.text(place, 0.02, text, ha="center", transform=axes.get_xaxis_transform())
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.22 * (high - low), high)
    axes.set_xticks([0, 1], ["ours", "published\n(Table 5.1)"])
    axes.set(xlim=(-0.5, 1.5), ylabel="E* (kPa), mean ± sd")


def _small_panel(axes: Axes, point: int, fit: Mapping | None) -> None:
    axes.text(0.05, 0.95, f"{point}", transform=axes.transAxes, va="top", weight="bold")
    axes.tick_params(labelsize=SMALL)
    if fit is None:
        text = {"transform": axes.transAxes, "ha": "center", "color": GREY, "fontsize": SMALL}
        axes.text(0.5, 0.5, "no recording", **text)
        return
    depth, _, used = _samples(fit)
    grid = np.linspace(0, depth[used].max(), 150)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(grid, fit["radius_m"])
    axes.plot(grid * MILLIMETRES, model, color=BLUE, lw=1.1, label="Hertz (Eq. 5.1)")
    _recorded(axes, fit, 2.8)
    text = f"{_kpa(fit['study'])} kPa"
    axes.text(0.05, 0.78, text, transform=axes.transAxes, va="top", fontsize=SMALL)


def _kpa(fit: Mapping) -> str:
    return f"{fit['reduced_modulus_pa'] * KILOPASCALS:.1f}"


def _signed(value: float) -> str:
    return f"{value:.2f}".replace("-", "\N{MINUS SIGN}")


def _range(free: Mapping) -> str:
    low, high = (value * KILOPASCALS for value in free["reduced_modulus_interval_pa"])
    return f"E* {_kpa(free)} ({low:.1f} to {high:.1f}) kPa"
