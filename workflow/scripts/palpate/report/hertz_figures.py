"""Hertz model beside the recorded force and depth of each capture."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import t as student

from palpate.estimate.hertz.curve_fit import HertzFit
from palpate.estimate.hertz.laws import parabola_force
from palpate.json_fields import read_all
from palpate.modulus import CONFIDENCE
from palpate.report import style
from palpate.units import KILOPASCALS, MILLIMETRES, MILLINEWTONS, readable

SHOWN_BEFORE_M = 0.002
CURVE_IN = 2.3


def make_hertz_fits(inputs: Any, params: Any) -> Figure:
    """Hertz model fitted to each capture, with range and residuals."""
    captures, fits = params.captures, read_all(inputs.fits)
    count = len(fits)
    size = max(style.COLUMN_IN, style.PAGE_IN * count / 2), 4.1
    look = {"height_ratios": (3, 1), "sharex": True, "sharey": "row", "squeeze": False}
    figure, axes = plt.subplots(2, count, figsize=size, **look)
    titles = [f"{style.sensor_name(one['sensor'])}, point {one['point']}" for one in captures]
    if len(set(titles)) < count:
        titles = [f"{style.sensor_name(one['sensor'])}, {one['capture']}" for one in captures]
    for (above, below), title, fit in zip(axes.T, titles, fits, strict=True):
        _fit_panel(above, fit)
        _residual_panel(below, fit)
        above.set_title(title)
    axes[0, 0].set_ylabel("Force (N)")
    axes[1, 0].set_ylabel("Residual (mN)")
    figure.align_ylabels(axes[:, 0])
    return style.finished(figure, {capture["provenance"] for capture in captures})


def figure_of_curves(fits: Sequence[tuple[str, HertzFit]]) -> Figure:
    """Force over indentation with the law, and what it leaves, a row for each curve's file."""
    with style.journal():
        size = (style.PAGE_IN, CURVE_IN * len(fits))
        figure, axes = plt.subplots(len(fits), 2, figsize=size, squeeze=False)
        for (name, fit), (left, right) in zip(fits, axes, strict=True):
            fit.plot(left)
            left.set_title(Path(name).name, fontsize=7.5)
            _curve_residuals(fit, right)
            right.set_xlim(left.get_xlim())
        figure.tight_layout()
    return figure


def curve_band(fit: Mapping, depth_m: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Curve of the fit with a free contact point, and its mean's 95 % band (low, high), (n,) [N].

    Linear propagation of both parameters' errors, with their correlation, for independent residuals
    of equal variance. Of a capture's hertz.json, at depths (n,) [m].
    """
    free, (measured, _, used) = fit["free_contact"], samples_of(fit)
    curve, slopes = _free_curve(fit, depth_m)
    _, fitted = _free_curve(fit, measured[: used.stop])
    freedom = len(fitted) - fitted.shape[1]
    variance = free["rms_n"] ** 2 * len(fitted) / freedom
    covariance = np.linalg.pinv(fitted.T @ fitted) * variance
    std = np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes))
    width = student.ppf((1 + CONFIDENCE) / 2, freedom) * std
    return curve, curve - width, curve + width


def samples_of(fit: Mapping) -> tuple[NDArray, NDArray, slice]:
    """Depth [m] and force [N] of a hertz.json, and the samples that the fit uses."""
    used = slice(fit["range"]["first_frame"], fit["range"]["last_frame"] + 1)
    return np.array(fit["samples"]["depth_m"]), np.array(fit["samples"]["force_n"]), used


def recorded(axes: Axes, fit: Mapping, size: float) -> None:
    """Draw the samples of a hertz.json, those that the fit uses filled."""
    depth, force, used = samples_of(fit)
    x, other = depth * MILLIMETRES, np.ones(len(depth), bool)
    other[used] = False
    look = {"mfc": "none", "mec": style.GREY, "mew": 0.7, "label": "recorded"}
    axes.plot(x[other], force[other], "o", ms=size, **look)
    look = {"mew": 0, "color": style.ORANGE, "label": "range of the fit"}
    axes.plot(x[used], force[used], "o", ms=size, **look)


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
    depth, force, used = samples_of(fit)
    free = fit["free_contact"]
    grid = np.linspace(-SHOWN_BEFORE_M, depth[used].max(), 300)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(grid, fit["radius_m"])
    other, low, high = curve_band(fit, grid)
    x = grid * MILLIMETRES
    axes.fill_between(x, low, high, color=style.GREEN, alpha=0.25, lw=0, label="95 % band")
    ends = " to ".join(f"{end * KILOPASCALS:.1f}" for end in free["reduced_modulus_interval_pa"])
    label = f"contact point free, E* {kilopascals(free)} ({ends}) kPa"
    axes.plot(x, other, color=style.GREEN, label=label)
    label = f"Hertz (Eq. 5.1), E* {kilopascals(fit['study'])} kPa"
    axes.plot(x, model, color=style.BLUE, ls=(0, (5, 2)), label=label)
    recorded(axes, fit, 3.4)
    place = free["contact_depth_m"] * MILLIMETRES
    label = f"contact point {place:.2f} mm".replace("-", "\N{MINUS SIGN}")
    axes.plot(place, 0, "|", ms=11, mew=1.6, color=style.BLACK, label=label)
    axes.legend(loc="upper left", fontsize=style.SMALL, handlelength=1.8)
    axes.set_xlim(left=-SHOWN_BEFORE_M * MILLIMETRES)
    axes.set_ylim(top=1.3 * force.max())


def _residual_panel(axes: Axes, fit: Mapping) -> None:
    depth, force, used = samples_of(fit)
    model = fit["study"]["reduced_modulus_pa"] * parabola_force(depth, fit["radius_m"])
    free, _ = _free_curve(fit, depth)
    for values, marker, colour in ((model, "s", style.BLUE), (free, "o", style.GREEN)):
        residual = (force - values)[used] * MILLINEWTONS
        look = {"ms": 3, "color": colour, "lw": 0.7, "mew": 0}
        axes.plot(depth[used] * MILLIMETRES, residual, marker=marker, **look)
    axes.axhline(0, color=style.BLACK, lw=0.6)
    rms, rms_free = (fit[name]["rms_n"] * MILLINEWTONS for name in ("study", "free_contact"))
    text = f"rms {rms:.0f} mN; contact point free {rms_free:.0f} mN"
    axes.set_title(text, fontsize=style.SMALL, weight="normal", pad=2)
    axes.set_xlabel("Indentation depth (mm)")


def kilopascals(fit: Mapping) -> str:
    """Reduced modulus of a fit as text [kPa]."""
    return f"{fit['reduced_modulus_pa'] * KILOPASCALS:.1f}"


def _curve_residuals(fit: HertzFit, axes: Axes) -> None:
    way, length = readable(fit.press_m, "m")
    scale, unit = readable(float(np.abs(fit.residual_n).max()), "N")
    depth, left = way * (fit.depth_m - fit.contact_m), scale * fit.residual_n
    axes.plot(depth, left, ".", ms=3, color=style.GREY)
    axes.axhline(0, lw=0.6, color=style.BLACK)
    axes.set(xlabel=f"indentation ({length})", ylabel=f"force less law ({unit})")
    axes.set_title(fit.quality, fontsize=7.5)
