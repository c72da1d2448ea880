"""Figure of direct estimates: force over indentation, and motion over distance."""

from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.estimate.direct.estimate import DirectEstimate
from palpate.estimate.direct.result import CaptureFit
from palpate.report.style import GREY, ORANGE, PAGE_IN, journal
from palpate.units import MILLIMETRES

ROW_IN = 2.6


def figure_of_estimates(estimates: Sequence[tuple[str, DirectEstimate]]) -> Figure:
    """What captures show beside what the estimate makes of it, a row for each estimate.

    Parameters
    ----------
    estimates : sequence of (str, DirectEstimate)
        With their titles.
    """
    count = len(estimates)
    with journal():
        figure, axes = plt.subplots(
            count, 2, figsize=(PAGE_IN, ROW_IN * count), squeeze=False, layout="constrained"
        )
        for (title, found), (left, right) in zip(estimates, axes, strict=True):
            found.plot(left)
            left.set_title(title, fontsize=7.5)
            _motion(max(found.captures(), key=lambda one: one.depth_m.max()), right)
            E, nu = (found.moduli[name] for name in ("youngs_modulus_pa", "poisson_ratio"))
            right.set_title(f"E {E}\nnu {nu}", fontsize=6.5, fontweight="normal")
    return figure


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
