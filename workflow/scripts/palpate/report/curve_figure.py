"""Figure of bare curves with their Hertz fits."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from palpate.estimate.hertz.curve_fit import HertzFit
from palpate.report.style import BLACK, GREY, PAGE_IN, journal
from palpate.units import readable

ROW_IN = 2.3


def figure_of_curves(fits: Sequence[tuple[str, HertzFit]]) -> Figure:
    """Force over indentation with the law, and what it leaves, a row for each curve.

    Parameters
    ----------
    fits : sequence of (str, HertzFit)
        With the curves' files.
    """
    with journal():
        figure, axes = plt.subplots(
            len(fits), 2, figsize=(PAGE_IN, ROW_IN * len(fits)), squeeze=False
        )
        for (name, fit), (left, right) in zip(fits, axes, strict=True):
            fit.plot(left)
            left.set_title(Path(name).name, fontsize=7.5)
            _residuals(fit, right)
            right.set_xlim(left.get_xlim())
        figure.tight_layout()
    return figure


def _residuals(fit: HertzFit, axes) -> None:
    way, length = readable(fit.press_m, "m")
    scale, unit = readable(float(np.abs(fit.residual_n).max()), "N")
    axes.plot(way * (fit.depth_m - fit.contact_m), scale * fit.residual_n, ".", ms=3, color=GREY)
    axes.axhline(0, lw=0.6, color=BLACK)
    axes.set(xlabel=f"indentation ({length})", ylabel=f"force less law ({unit})")
    axes.set_title(fit.quality, fontsize=7.5)
