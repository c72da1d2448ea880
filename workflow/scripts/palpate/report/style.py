"""One look for all figures, and files that are the same bytes for the same inputs."""

from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.report import TEMPLATES

# Okabe and Ito's palette, told apart by colour-blind readers.
BLUE, ORANGE, GREEN, GREY, BLACK = "#0072B2", "#D55E00", "#009E73", "#9A9A9A", "#1A1A1A"
SENSOR_NAMES = {"bumblebee": "Bumblebee2", "kinect": "Kinect"}
ERROR_NAMES = {"force_displacement": "force and displacement", "displacement": "displacement"}
COLUMN_IN, PAGE_IN = 3.5, 7.2
SMALL = 6.5
ARROW = {"arrowstyle": "-|>", "color": BLACK, "lw": 0.8, "shrinkA": 0, "shrinkB": 0}


def journal() -> AbstractContextManager[None]:
    """Draw in the project's style inside the block."""
    return plt.rc_context(fname=TEMPLATES / "journal.mplstyle")


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


def capture_name(capture: Mapping) -> str:
    """A capture as a reader finds it."""
    return f"{sensor_name(capture['sensor'])} {capture['capture']}"


def save(figure: Figure, png: str | Path, svg: str | Path) -> None:
    """Save a figure as PNG and SVG without dates, and close it."""
    figure.savefig(png, format="png", metadata={"Software": None})
    figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)


def panel_letter(axes: Axes, letter: str) -> None:
    """Put a panel's letter at its upper left, outside the axes."""
    axes.text(-0.02, 1.04, letter, transform=axes.transAxes, ha="right", va="bottom", weight="bold")
