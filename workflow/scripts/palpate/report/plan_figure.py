"""Intervals that a plan forecasts, for a protocol and for others that differ in one thing."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from palpate.modulus import LABELS
from palpate.report import style
from palpate.units import PERCENT

if TYPE_CHECKING:
    from palpate.plan import Forecast

# Colour and marker of what is drawn in per cent.
MODULI = {
    "effective_reduced_modulus_pa": (style.BLUE, "o"),
    "reduced_modulus_pa": (style.GREEN, "s"),
    "youngs_modulus_pa": (style.ORANGE, "D"),
}
ROW_IN, HEAD_IN = 0.24, 1.0


def plan_figure(rows: Mapping[str, "Forecast"]) -> Figure:
    """Half-widths of the intervals (95 %) by protocol: moduli on the left, nu on the right."""
    with style.journal():
        at = np.arange(len(rows))[::-1]
        size = style.PAGE_IN, HEAD_IN + ROW_IN * len(rows)
        look = {"sharey": True, "width_ratios": (3, 2), "layout": "constrained"}
        figure, (left, right) = plt.subplots(1, 2, figsize=size, **look)
        for name, (colour, marker) in MODULI.items():
            widths = [PERCENT * one.half_width[name] for one in rows.values()]
            left.plot(widths, at, marker, color=colour, ms=4.5, label=LABELS[name])
        nu = [one.half_width["poisson_ratio"] for one in rows.values()]
        right.plot(nu, at, "o", color=style.BLACK, ms=4.5)
        left.set(xlabel="half-width of the 95 % interval (%)", xlim=(0, None), title="(a) Moduli")
        right.set(
            xlabel="half-width of the 95 % interval", xlim=(0, None), title="(b) Poisson's ratio"
        )
        left.set_yticks(at, list(rows))
        for axes in (left, right):
            axes.axhline(len(rows) - 1.5, color=style.GREY, lw=0.7)
            axes.grid(axis="both", color=style.GREY, lw=0.3, alpha=0.6)
            axes.tick_params(axis="y", length=0)
        figure.legend(loc="outside lower center", ncols=len(MODULI))
        return figure
