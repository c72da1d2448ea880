"""Moduli of one object, a line for each capture and one for all of a sensor together."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.json_fields import read_all
from palpate.modulus import IDENTIFIED
from palpate.report.estimate_rows import compared
from palpate.report.style import BLUE, PAGE_IN, finished, sensor_name
from palpate.units import KILOPASCALS

# Of a line, of what is above and below them, and of the whole at most [in].
LINE_IN, AROUND_IN, HIGHEST_IN = 0.24, 0.62, 9.0
GREATEST_NU = 0.5
QUANTITIES = {
    "effective_reduced_modulus_pa": ("effective E* (kPa)", KILOPASCALS),
    "youngs_modulus_pa": ("E (kPa)", KILOPASCALS),
    "poisson_ratio": ("Poisson's ratio", 1.0),
}


class Line(NamedTuple):
    """An estimate and what it is of."""

    label: str
    found: Mapping
    together: bool


def make_own_moduli(inputs: Any, params: Any) -> Figure:
    """Moduli of each capture of an object, and of all captures with each sensor."""
    singles, joints = compared(
        params.captures, read_all(inputs.direct), params.groups, read_all(inputs.joint)
    )
    found = own_moduli(params.captures, singles, [g["sensor"] for g in params.groups], joints)
    return finished(found, {capture["provenance"] for capture in params.captures})


def own_moduli(
    captures: Sequence[Mapping],
    singles: Sequence[Mapping],
    sensors: Sequence[str],
    joints: Sequence[Mapping],
) -> Figure:
    """Moduli with their intervals, beside one another, on lines one below the other.

    Singles are the direct.json of described captures, joints those of all captures with each
    sensor.
    """
    lines = list(_lines(captures, singles, sensors, joints))
    height = min(AROUND_IN + LINE_IN * len(lines), HIGHEST_IN)
    figure, axes = plt.subplots(1, len(QUANTITIES), figsize=(PAGE_IN, height), sharey=True)
    for panel, (quantity, (label, scale)) in zip(axes, QUANTITIES.items(), strict=True):
        for place, line in enumerate(lines):
            _draw(panel, place, line, quantity, scale)
        panel.set_xlabel(label)
        panel.set_xlim(0, GREATEST_NU if quantity == "poisson_ratio" else None)
        panel.tick_params(axis="y", length=0)
    axes[0].set_yticks(range(len(lines)), [line.label for line in lines])
    axes[0].set_ylim(len(lines) - 0.4, -0.6)
    return figure


def _lines(captures, singles, sensors, joints) -> Iterator[Line]:
    """Captures of each sensor and then all of them; one alone is all of them."""
    for sensor, joint in zip(sensors, joints, strict=True):
        name = sensor_name(sensor)
        mine = [
            Line(f"{name} {capture['capture']}", single, False)
            for capture, single in zip(captures, singles, strict=True)
            if capture["sensor"] == sensor
        ]
        if len(mine) > 1:
            yield from mine
        yield Line(f"{name}, all {len(mine)}" if len(mine) > 1 else name, joint, True)


def _draw(panel: Axes, place: int, line: Line, quantity: str, scale: float) -> None:
    value, low, high = (scale * line.found[quantity][end] for end in ("value", "low", "high"))
    width = 2.2 if line.together else 0.9
    panel.plot([low, high], [place] * 2, color=BLUE, lw=width, solid_capstyle="butt")
    known = line.found[quantity]["verdict"] == IDENTIFIED
    marker = {"marker": "D", "ms": 5} if line.together else {"marker": "o", "ms": 3.5}
    panel.plot(value, place, color=BLUE, mfc=BLUE if known else "white", mew=0.9, **marker)
