"""One look for all figures, and files that are the same bytes for the same inputs."""

from collections.abc import Collection
from contextlib import AbstractContextManager
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

# Okabe and Ito's palette, told apart by colour-blind readers.
BLUE, ORANGE, GREEN, GREY, BLACK = "#0072B2", "#D55E00", "#009E73", "#9A9A9A", "#1A1A1A"
SENSOR_NAMES = {"bumblebee": "Bumblebee2", "kinect": "Kinect"}
ERROR_NAMES = {"force_displacement": "force and displacement", "displacement": "displacement"}
COLUMN_IN, PAGE_IN = 3.5, 7.2
SMALL = 6.5
POINTS_PER_INCH, LETTER_DEPTH_PT = 72, 1.8
ARROW = {"arrowstyle": "-|>", "color": BLACK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}
SETTINGS = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.direction": "out",
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "figure.dpi": 100,
    "savefig.dpi": 300,
    "svg.hashsalt": "palpate",
    "svg.fonttype": "none",
}


def journal() -> AbstractContextManager[None]:
    """Draw in the project's style inside the block."""
    return plt.rc_context(SETTINGS)


def label_provenance(figure: Figure, provenances: Collection[str]) -> None:
    """Say under a figure that its captures are simulated, when any is."""
    if "simulated" in provenances:
        figure.text(
            0.995, 0.004, "simulated captures", ha="right", va="bottom", fontsize=6.5, color=GREY
        )


def finished(figure: Figure, provenances: Collection[str]) -> Figure:
    """Lay a figure out with room for its provenance, and write that."""
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    label_provenance(figure, provenances)
    return figure


def sensor_name(sensor: str) -> str:
    """Name of a sensor as a reader knows it."""
    return SENSOR_NAMES.get(sensor, sensor)


def save(figure: Figure, png: str | Path, svg: str | Path) -> None:
    """Save a figure as PNG and SVG without dates, and close it."""
    figure.savefig(png, format="png", metadata={"Software": None})
    figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)


def panel_letter(axes: Axes, letter: str) -> None:
    """Put a panel's letter at its upper left, outside the axes."""
    axes.text(-0.02, 1.04, letter, transform=axes.transAxes, ha="right", va="bottom", weight="bold")


def beside(
    axes: Axes, place: NDArray, text: str, direction: NDArray, points: float, **look
) -> None:
    """Write a text some points away from a place; it grows away from it."""
    offset = points * np.asarray(direction) / np.linalg.norm(direction)
    across = "left" if offset[0] > 3 else "right" if offset[0] < -3 else "center"
    axes.annotate(text, place, offset, textcoords="offset points", ha=across, va="center", **look)


def entitle(axes: Axes, title: str, letter: str) -> None:
    """Title on the line of the panel's letter, which stands by the axes' height."""
    height_in = axes.get_position().height * axes.figure.get_figheight()
    axes.set_title(title, pad=0.04 * height_in * POINTS_PER_INCH + LETTER_DEPTH_PT)
    panel_letter(axes, letter)
