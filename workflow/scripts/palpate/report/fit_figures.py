"""Figures of the commands: what was recorded beside what was fitted, a row for each file."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.estimate.direct.estimate import DirectEstimate
from palpate.estimate.direct.result import CaptureFit
from palpate.estimate.hertz.curve_fit import HertzFit
from palpate.report.style import BLACK, GREY, ORANGE, PAGE_IN, journal
from palpate.units import MILLIMETRES, readable

CURVE_IN, CAPTURE_IN = 2.3, 2.6


def figure_of_curves(fits: Sequence[tuple[str, HertzFit]]) -> Figure:
    """Force over indentation with the law, and what it leaves, a row for each curve's file."""
    with journal():
        size = (PAGE_IN, CURVE_IN * len(fits))
        figure, axes = plt.subplots(len(fits), 2, figsize=size, squeeze=False)
        for (name, fit), (left, right) in zip(fits, axes, strict=True):
            fit.plot(left)
            left.set_title(Path(name).name, fontsize=7.5)
            _residuals(fit, right)
            right.set_xlim(left.get_xlim())
        figure.tight_layout()
    return figure


def figure_of_estimates(estimates: Sequence[tuple[str, DirectEstimate]]) -> Figure:
    """What captures show beside what the estimate makes of it, a row for each title."""
    count = len(estimates)
    with journal():
        look = {"figsize": (PAGE_IN, CAPTURE_IN * count), "layout": "constrained"}
        figure, axes = plt.subplots(count, 2, squeeze=False, **look)
        for (title, found), (left, right) in zip(estimates, axes, strict=True):
            found.plot(left)
            left.set_title(title, fontsize=7.5)
            _motion(max(found.captures(), key=lambda one: one.depth_m.max()), right)
            E, nu = (found.moduli[name] for name in ("youngs_modulus_pa", "poisson_ratio"))
            right.set_title(f"E {E}\nnu {nu}", fontsize=6.5, fontweight="normal")
    return figure


def _residuals(fit: HertzFit, axes: Axes) -> None:
    way, length = readable(fit.press_m, "m")
    scale, unit = readable(float(np.abs(fit.residual_n).max()), "N")
    axes.plot(way * (fit.depth_m - fit.contact_m), scale * fit.residual_n, ".", ms=3, color=GREY)
    axes.axhline(0, lw=0.6, color=BLACK)
    axes.set(xlabel=f"indentation ({length})", ylabel=f"force less law ({unit})")
    axes.set_title(fit.quality, fontsize=7.5)


def _motion(one: CaptureFit, axes: Axes) -> None:
    """Motion of the surface along its normals in the deepest frame, seen and fitted."""
    frame, distance = int(np.argmax(one.depth_m)), MILLIMETRES * one.distance_m
    for values, colour, label in (
        (one.moved_m, GREY, "seen, deepest frame"),
        (one.fitted_moved_m, ORANGE, "fitted"),
    ):
        axes.plot(distance, MILLIMETRES * values[frame], ".", ms=3, color=colour, label=label)
    axes.set(xlabel="distance from the contact (mm)", ylabel="motion along the normal (mm)")
    axes.legend()
