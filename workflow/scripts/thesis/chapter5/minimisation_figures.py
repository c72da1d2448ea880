"""Course of the error minimisation: Figures 5.8, 5.9, 5.14 and 5.17."""

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from palpate.json_fields import read_all
from palpate.report.panels import named
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

from thesis.diagrams import provenances

LETTERS = "abcdefghijklmnopqrstuvwxyz"


def minimisation(inputs: Any, params: Any) -> Figure:
    """Lame parameters and error against iteration, a column per sensor.

    Figures 5.8, 5.9, 5.14 and 5.17: whole, or the first ``params.iterations``.
    """
    captures, minima = params.captures, read_all(inputs.results)
    count = len(minima)
    size = (max(COLUMN_IN, PAGE_IN * count / 2), 4.5)
    figure, axes = plt.subplots(3, count, figsize=size, sharex=True, squeeze=False)
    for column, capture, minimum, first in zip(axes.T, captures, minima, range(count), strict=True):
        _trace_panels(column, minimum["trace"][: params.iterations])
        place = f"{capture['object'].replace('_', ' ')}, point {capture['point']}"
        title = f"{sensor_name(capture['sensor'])}: {place}{bound_mark(minimum)}"
        for panel, letter, text in zip(
            column, LETTERS[first::count], (title, "", ""), strict=False
        ):
            named(panel, letter, text)
    for panel, label in zip(axes[:, 0], ("λ (kPa)", "μ (kPa)", "Error (mm)"), strict=True):
        panel.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.text(0.01, 0.008, f"error of {ERROR_NAMES[params.error]}", fontsize=7.5, va="bottom")
    label_provenance(figure, provenances(params))
    return figure


def _trace_panels(column: Sequence[Axes], trace: Sequence[Mapping]) -> None:
    iteration = [step["iteration"] for step in trace]
    series = (
        ("lame_lambda_pa", KILOPASCALS, BLUE),
        ("lame_mu_pa", KILOPASCALS, BLUE),
        ("error_m", MILLIMETRES, ORANGE),
    )
    for panel, (name, scale, colour) in zip(column, series, strict=True):
        values = [step[name] * scale for step in trace]
        panel.plot(iteration, values, color=colour)
        panel.margins(x=0.01, y=0.1)
        if min(values) >= 0:
            panel.set_ylim(bottom=0)
        panel.yaxis.set_major_locator(MaxNLocator(4))
        panel.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    column[-1].set_xlabel("Iteration")
