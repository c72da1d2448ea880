"""What a deformation says of Poisson's ratio: error and modulus along the valley of the error."""

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.study.style import (
    BLUE,
    ERROR_NAMES,
    GREY,
    ORANGE,
    PAGE_IN,
    finished,
    panel_letter,
    sensor_name,
)

KILOPASCALS, PERCENT = 1e-3, 100.0
COLOURS = {"bumblebee": BLUE, "kinect": ORANGE}
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)), (0, (6, 1.5, 1.5, 1.5)))
# Curves end where their error is this much above the least: the rest says nothing more.
HIGHEST_PERCENT = 12.0


def poisson_profiles(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> Figure:
    """Profile of the error over nu and the E that belongs to it, a column per error option.

    Parameters
    ----------
    captures : sequence of mapping
        ``object, sensor, capture, point, provenance``.
    minima : mapping
        minimise-<error>.json by (object, sensor, capture, error).
    """
    errors = sorted({key[3] for key in minima}, reverse=True)
    figure, axes = plt.subplots(
        2, len(errors), figsize=(PAGE_IN, 4.6), sharex=True, sharey="row", squeeze=False
    )
    points = sorted({capture["point"] for capture in captures})
    for column, error, letters in zip(axes.T, errors, ("ac", "bd"), strict=False):
        for capture in captures:
            key = (capture["object"], capture["sensor"], capture["capture"], error)
            look = {
                "color": COLOURS.get(capture["sensor"], GREY),
                "ls": DASHES[points.index(capture["point"]) % len(DASHES)],
                "label": f"{sensor_name(capture['sensor'])}, point {capture['point']}",
            }
            _curves(column, minima[key]["profile"], look)
        column[0].set_title(f"Error of {ERROR_NAMES[error]}")
        column[1].set_xlabel("Poisson's ratio")
        for panel, letter in zip(column, letters, strict=True):
            panel_letter(panel, letter)
    axes[0, 0].set_ylabel("Error above its least (%)")
    axes[0, 0].set_ylim(0, HIGHEST_PERCENT)
    axes[1, 0].set_ylabel("Best E for it (kPa)")
    axes[1, 0].set_ylim(bottom=0)
    axes[0, 0].set_xlim(0, 0.5)
    axes[1, 0].legend(loc="upper right", ncols=2, fontsize=6.5)
    return finished(figure, {capture["provenance"] for capture in captures})


def _curves(column: Sequence[Axes], profile: Mapping, look: Mapping) -> None:
    """Both curves; the interval of nu, where there is one, drawn thick."""
    nu = np.array(profile["poisson_ratios"])
    error = np.array(profile["errors_m"])
    rise = PERCENT * (error / error.min() - 1)
    modulus = np.array(profile["youngs_moduli_pa"]) * KILOPASCALS
    interval = profile["interval"] or ()
    fine = np.linspace(*interval, 60) if interval else nu[:0]
    for panel, values in zip(column, (rise, modulus), strict=True):
        panel.plot(nu, values, lw=0.9, **look)
        panel.plot(fine, np.interp(fine, nu, values), lw=2.4, color=look["color"], alpha=0.55)
    best = int(np.argmin(error))
    column[1].plot(nu[best], modulus[best], "o", ms=3, color=look["color"], clip_on=False)
