"""Course of the error minimisation: Figures 5.8, 5.9, 5.14 and 5.17."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from palpate.json_fields import read_all
from palpate.report.style import (
    BLUE,
    COLUMN_IN,
    ERROR_NAMES,
    ORANGE,
    PAGE_IN,
    label_provenance,
    sensor_name,
)
from palpate.report.tables import bound_mark
from palpate.units import KILOPASCALS, MILLIMETRES


def make_minimisation(inputs: Any, params: Any) -> Figure:
    """Course of each capture's minimisation: whole, or its first iterations."""
    minima, shown = read_all(inputs.results), {"iterations": params.iterations}
    return figure_5_8(params.captures, minima, error=params.error, **shown)


def figure_5_8(
    captures: Sequence[Mapping],
    minima: Sequence[Mapping],
    *,
    error: str,
    iterations: int | None = None,
) -> Figure:
    """Lame parameters and error against iteration, a column per sensor.

    Parameters
    ----------
    captures : sequence of mapping
    minima : sequence of mapping
        minimise-<error>.json of each capture.
    error : str
        Error option.
    iterations : int, optional
        Show no more than so many of the first iterations.

    Returns
    -------
    Figure
        Figures 5.8, 5.9, 5.14 and 5.17.
    """
    count = len(minima)
    size = (max(COLUMN_IN, PAGE_IN * count / 2), 4.6)
    figure, axes = plt.subplots(3, count, figsize=size, sharex=True, squeeze=False)
    for column, capture, minimum in zip(axes.T, captures, minima, strict=True):
        _trace_panels(column, minimum["trace"][:iterations])
        place = f"{capture['object'].replace('_', ' ')}, point {capture['point']}"
        column[0].set_title(f"{sensor_name(capture['sensor'])}: {place}{bound_mark(minimum)}")
    for panel, label in zip(axes[:, 0], ("λ (kPa)", "μ (kPa)", "Error (mm)"), strict=True):
        panel.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.025, 1, 0.965))
    figure.suptitle(f"Error of {ERROR_NAMES[error]}", x=0.01, ha="left", fontsize=8.5)
    label_provenance(figure, {capture["provenance"] for capture in captures})
    return figure


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
