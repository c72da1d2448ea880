"""Figures of the Hertz fit and of the minimisation."""

from collections.abc import Mapping, Sequence

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.estimate.hertz import hertz_force
from palpate.study.style import (
    BLACK,
    BLUE,
    COLUMN_IN,
    ERROR_NAMES,
    GREY,
    ORANGE,
    PAGE_IN,
    label_provenance,
    sensor_name,
)

MILLIMETRES, KILOPASCALS = 1e3, 1e-3


def figure_5_2(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> Figure:
    """Hertz model fitted to one point per sensor, with the range used (Fig. 5.2)."""
    count = len(fits)
    size = (max(COLUMN_IN, PAGE_IN * count / 2), 2.75)
    figure, axes = plt.subplots(1, count, figsize=size, sharey=True, squeeze=False)
    for panel, capture, fit in zip(axes[0], captures, fits, strict=True):
        _hertz_panel(panel, fit)
        panel.set_title(f"{sensor_name(capture['sensor'])}, point {capture['point']}")
    axes[0, 0].set_ylabel("Force (N)")
    axes[0, 0].legend(loc="upper left")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def figure_5_8(captures: Sequence[Mapping], minima: Sequence[Mapping], *, error: str) -> Figure:
    """Lame parameters and error against iteration, a column per sensor (Fig. 5.8)."""
    count = len(minima)
    size = (max(COLUMN_IN, PAGE_IN * count / 2), 4.6)
    figure, axes = plt.subplots(3, count, figsize=size, sharex=True, squeeze=False)
    for column, capture, minimum in zip(axes.T, captures, minima, strict=True):
        _trace_panels(column, minimum["trace"])
        column[0].set_title(f"{sensor_name(capture['sensor'])}, point {capture['point']}")
    for panel, label in zip(axes[:, 0], ("λ (kPa)", "μ (kPa)", "Error (mm)"), strict=True):
        panel.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.025, 1, 0.965))
    figure.suptitle(f"Error of {ERROR_NAMES[error]}", x=0.01, ha="left", fontsize=8.5)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


def _hertz_panel(axes: Axes, fit: Mapping) -> None:
    depth = np.array(fit["samples"]["depth_m"]) * MILLIMETRES
    force = np.array(fit["samples"]["force_n"])
    first, last = fit["range"]["first_frame"], fit["range"]["last_frame"]
    used = slice(first, last + 1)
    grid = np.linspace(0, depth[used].max(), 200)
    study, free = fit["study"], fit["free_contact"]
    model = hertz_force(grid / MILLIMETRES, study["reduced_modulus_pa"], fit["radius_m"])
    shifted = grid / MILLIMETRES - free["contact_depth_m"]
    other = hertz_force(shifted, free["reduced_modulus_pa"], fit["radius_m"])
    axes.plot(depth, force, "o", ms=3.2, mfc="none", mec=GREY, mew=0.8, label="recorded")
    axes.plot(depth[used], force[used], "o", ms=3.2, color=ORANGE, label="range of the fit")
    axes.plot(grid, model, color=BLUE, label=f"Hertz, E* {_kpa(study)} kPa")
    label = f"contact point free, E* {_kpa(free)} kPa"
    axes.plot(grid, other, color=BLACK, lw=0.9, ls=(0, (4, 2)), label=label)
    if axes.get_subplotspec().colspan.start:
        axes.legend(handles=axes.get_lines()[2:], loc="upper left")
    axes.set_xlabel("Indentation depth (mm)")
    axes.set_xlim(left=min(-2.0, max(depth.min(), -3.0)))


def _kpa(fit: Mapping) -> str:
    return f"{fit['reduced_modulus_pa'] * KILOPASCALS:.1f}"


def _trace_panels(column: Sequence[Axes], trace: Sequence[Mapping]) -> None:
    iteration = [step["iteration"] for step in trace]
    series = (
        ("lame_lambda_pa", KILOPASCALS, BLUE),
        ("lame_mu_pa", KILOPASCALS, BLUE),
        ("error_m", MILLIMETRES, ORANGE),
    )
    for panel, (name, scale, colour) in zip(column, series, strict=True):
        panel.plot(iteration, [step[name] * scale for step in trace], color=colour)
        panel.margins(x=0.01)
    column[-1].set_xlabel("Iteration")
