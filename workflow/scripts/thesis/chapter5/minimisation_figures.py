"""Course of the error minimisation, and its valley: Figures 5.8, 5.9, 5.14, 5.17, profiles."""

from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from palpate.json_fields import minima_by_key, read_all
from palpate.report import style
from palpate.report.panels import named
from palpate.report.tables import bound_mark
from palpate.units import KILOPASCALS, MILLIMETRES, PERCENT

from thesis.diagrams import labelled, provenances

COLOURS = {"bumblebee": style.BLUE, "kinect": style.ORANGE}
# Curves end where their error is this much above the least: the rest says nothing more.
HIGHEST_PERCENT = 12.0


def minimisation(inputs: Any, params: Any) -> Figure:
    """Lame parameters and error against iteration, a column per sensor.

    Figures 5.8, 5.9, 5.14 and 5.17: whole, or the first ``params.iterations``.
    """
    captures, minima = params.captures, read_all(inputs.results)
    count = len(minima)
    size = (max(style.COLUMN_IN, style.PAGE_IN * count / 2), 4.5)
    figure, axes = plt.subplots(3, count, figsize=size, sharex=True, squeeze=False)
    for column, capture, minimum, first in zip(axes.T, captures, minima, range(count), strict=True):
        _trace_panels(column, minimum["trace"][: params.iterations])
        place = f"{capture['object'].replace('_', ' ')}, point {capture['point']}"
        title = f"{style.sensor_name(capture['sensor'])}: {place}{bound_mark(minimum)}"
        for panel, letter, text in zip(
            column, ascii_lowercase[first::count], (title, "", ""), strict=False
        ):
            named(panel, letter, text)
    for panel, label in zip(axes[:, 0], ("λ (kPa)", "μ (kPa)", "Error (mm)"), strict=True):
        panel.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.text(
        0.01, 0.008, f"error of {style.ERROR_NAMES[params.error]}", fontsize=7.5, va="bottom"
    )
    return labelled(figure, params)


def _trace_panels(column: Sequence[Axes], trace: Sequence[Mapping]) -> None:
    iteration = [step["iteration"] for step in trace]
    series = (
        ("lame_lambda_pa", KILOPASCALS, style.BLUE),
        ("lame_mu_pa", KILOPASCALS, style.BLUE),
        ("error_m", MILLIMETRES, style.ORANGE),
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


def poisson_profiles(inputs: Any, params: Any) -> Figure:
    """Profile of the error over nu and the E that belongs to it.

    A column per object, two rows per error option.
    """
    captures = params.captures
    minima = minima_by_key(captures, params.errors, inputs.results)
    errors = sorted({key[3] for key in minima}, reverse=True)
    objects = list(dict.fromkeys(capture["object"] for capture in captures))
    figure, axes = plt.subplots(
        *(2 * len(errors), len(objects)),
        figsize=(min(style.COLUMN_IN * len(objects), style.PAGE_IN), 2.0 * 2 * len(errors)),
        sharex=True,
        squeeze=False,
    )
    for k, name in enumerate(objects):
        mine = [capture for capture in captures if capture["object"] == name]
        for row, error in enumerate(errors):
            pair = axes[2 * row : 2 * row + 2, k]
            _draw_object(pair, mine, [minima[(*_key(c), error)]["profile"] for c in mine])
            pair[0].set_title(
                f"{name.replace('_', ' ')}\n{style.ERROR_NAMES[error]}", weight="normal"
            )
        axes[-1, k].set_xlabel("Poisson's ratio")
        axes[1, k].legend(loc="lower left", fontsize=6.5, handlelength=1.2)
    for panel, letter in zip(axes.flat, ascii_lowercase, strict=False):
        style.panel_letter(panel, letter)
    for row in axes[::2, 0]:
        row.set_ylabel("Error above\nits least (%)")
    for row in axes[1::2, 0]:
        row.set_ylabel("Best E for it (kPa)")
    axes[0, 0].set_xlim(0, 0.5)
    return style.finished(figure, provenances(params))


def _key(capture: Mapping) -> tuple[str, str, str]:
    return capture["object"], capture["sensor"], capture["capture"]


def _draw_object(
    pair: Sequence[Axes], captures: Sequence[Mapping], profiles: Sequence[Mapping]
) -> None:
    """Curves of one object's captures, named by sensor."""
    sensors = [capture["sensor"] for capture in captures]
    for capture, sensor, profile in zip(captures, sensors, profiles, strict=True):
        first = capture is captures[sensors.index(sensor)]
        count = sensors.count(sensor)
        name = f"{style.sensor_name(sensor)}, {count} capture{'s' if count > 1 else ''}"
        look = {"color": COLOURS.get(sensor, style.GREY), "label": name if first else None}
        _curves(pair, profile, look)
    pair[0].set_ylim(0, HIGHEST_PERCENT)
    pair[1].set_ylim(bottom=0)


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
