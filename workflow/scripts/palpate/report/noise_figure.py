"""Noise floor of a rig: tip and force over time, the surface's error, what is stated beside it."""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.flat_surface import FlatSurface
from palpate.noise import NoiseFloor, Quantity
from palpate.report import style
from palpate.units import MILLIMETRES, MILLINEWTONS

COLOURS = {"x": style.BLUE, "y": style.ORANGE, "z": style.GREEN}


def noise_figure(found: NoiseFloor, *, simulated: bool = False) -> Figure:
    """What `palpate.noise.measure` found; of a plate without a recording at rest its surface."""
    rows = 1 if found.tip is None else 2
    with style.journal():
        figure, axes = plt.subplots(rows, 2, figsize=(style.PAGE_IN, 2.7 * rows), squeeze=False)
        if found.tip is not None:
            _lines(axes[0, 0], found.tip, MILLIMETRES, "Tip at rest, camera's axes", "mm")
            _lines(axes[0, 1], found.force, MILLINEWTONS, "Unloaded force, sensor's axes", "mN")
        _map(axes[-1, 0], found.surface)
        _ratios(axes[-1, 1], [one for one in found.quantities if one.ratio])
        for one, letter in zip(axes.flat, "abcd", strict=False):
            style.panel_letter(one, letter)
        return style.finished(figure, {"simulated"} if simulated else ())


def _lines(axes: Axes, table: pd.DataFrame, scale: float, title: str, unit: str) -> None:
    """x, y and z over time, each above the next by the most that one goes."""
    step = scale * np.ptp(table[list(COLOURS)].to_numpy(float), axis=0).max()
    look = {"lw": 0.3} if len(table) > 300 else {"lw": 0.8, "marker": ".", "ms": 3}
    for shift, (name, colour) in zip((step, 0, -step), COLOURS.items(), strict=True):
        axes.plot(table["time_s"], scale * table[name] + shift, color=colour, **look)
        axes.annotate(name, (1.01, shift), xycoords=("axes fraction", "data"), color=colour)
    axes.set(xlabel="Time (s)", ylabel=f"Off the mean, set apart ({unit})", title=title)


def _map(axes: Axes, seen: FlatSurface) -> None:
    """Error of the farthest displacement, or what the surface at rest is off a plane."""
    shift_m = np.abs(seen.rigid[:, 0])
    far = int(np.nanargmax(shift_m))
    values, label, title = seen.flat_m, "Height over a plane (mm)", "Surface at rest"
    if far >= seen.rest:
        title = f"Plate moved by {MILLIMETRES * shift_m[far]:.1f} mm"
        values, label = seen.left_m[far], "Error of displacement (mm)"
    values, (x, y, _) = MILLIMETRES * values, MILLIMETRES * seen.motion.cell_m.T
    most = np.nanquantile(np.abs(values), 0.98)
    drawn = axes.scatter(x, y, c=values, s=9, lw=0, cmap="RdBu_r", vmin=-most, vmax=most)
    axes.set(aspect="equal", xlabel="Along the surface (mm)", ylabel="Across it (mm)", title=title)
    axes.figure.colorbar(drawn, ax=axes, label=label)


def _ratios(axes: Axes, stated: list[Quantity]) -> None:
    """Measured over stated, the first on top."""
    places, ratios = range(len(stated), 0, -1), [one.ratio for one in stated]
    colours = [style.ORANGE if one.exceeds else style.BLUE for one in stated]
    axes.hlines(places, 1, ratios, colors=colours)
    axes.scatter(ratios, places, c=colours, s=14, zorder=3)
    axes.axvline(1, color=style.BLACK, lw=0.7)
    axes.set_yticks(places, [one.name for one in stated], fontsize=style.SMALL)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    ends = min([0.08, *ratios]) / 1.2, max([2.0, *ratios]) * 1.2
    axes.set(xlim=ends, xlabel="Measured over stated", title="Beside what is stated")
