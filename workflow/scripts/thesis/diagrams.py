"""What explanatory figures are drawn of: space on the page, axes, dimensions, matrices, names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.patheffects import Normal, Stroke
from numpy.typing import NDArray
from palpate.report import style
from palpate.report.panels import named

from thesis.panels import surface_panel
from thesis.views import View

# One size of type for all that stands in a picture [pt].
TEXT_PT = 7.5
POINTS_PER_INCH, LETTER_DEPTH_PT = 72, 1.8
NOTE = {"fontsize": TEXT_PT, "color": "0.35"}
HALO = [Stroke(linewidth=2.6, foreground="white"), Normal()]
BOTH_WAYS = style.ARROW | {"arrowstyle": "<|-|>,head_width=0.14,head_length=0.28", "lw": 0.7}
AXIS_COLOURS = (style.ORANGE, style.GREEN, style.BLUE)
LEGEND_IN = 0.28
DOT_DASH, DASHED = (0, (6, 3, 1, 3)), (0, (4, 2))
# From a camera's axes (right, down, ahead) to axes with z up, x ahead.
FROM_CAMERA = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])


@dataclass(frozen=True)
class Sketch:
    """A panel that shows space by parallel projection; its unit is a thousandth of the places'.

    Attributes
    ----------
    axes : Axes
    view : View
        Direction of the viewer, in axes with z up.
    upright : (3, 3) array
        Rotation from the axes of the places to axes with z up.
    """

    axes: Axes
    view: View
    upright: NDArray = field(default_factory=lambda: np.eye(3))

    def flat(self, places: Sequence) -> NDArray:
        """Places on the page, (n, 2) of (n, 3) or (2,) of (3,)."""
        shown = self.view.project(np.asarray(places, float).reshape(-1, 3) @ self.upright.T)
        return shown[:, :2].reshape(*np.shape(places)[:-1], 2)

    def line(self, *places: Sequence, **look) -> None:
        """Line through places."""
        self.axes.plot(*self.flat(places).T, **{"color": style.BLACK, "lw": 0.8} | look)

    def area(self, corners: Sequence, colour: str, *, alpha: float = 0.13, **look) -> None:
        """Filled polygon with its outline."""
        flat = self.flat(corners)
        self.axes.add_patch(Polygon(flat, fc=colour, alpha=alpha, ec="none", zorder=2))
        look = {"ec": colour, "lw": 0.9, "zorder": 2} | look
        self.axes.add_patch(Polygon(flat, fc="none", **look))

    def dot(self, place: Sequence, **look) -> None:
        """Mark a place."""
        self.axes.plot(
            *self.flat(place), "o", **{"color": style.BLACK, "ms": 4.5, "zorder": 5} | look
        )

    def arrow(self, start: Sequence, stop: Sequence, **look) -> None:
        """Arrow between places."""
        ends = self.flat([start, stop])
        self.axes.annotate("", ends[1], ends[0], arrowprops=style.ARROW | look, zorder=4)
        self.axes.update_datalim(ends)

    def name(self, place: Sequence, text: str, side: Sequence, points: float = 6, **look) -> None:
        """Text beside a place."""
        write(self.axes, self.flat(place), text, side, points, **look)

    def triad(
        self,
        transform: NDArray,
        length: float,
        *,
        names: Sequence[str] = ("$x$", "$y$", "$z$"),
        colours: Sequence[str] = AXIS_COLOURS,
    ) -> None:
        """Axes of a frame, as many as it has names.

        Parameters
        ----------
        transform : (4, 4) array
            From the frame to that of the places.
        length : float
        """
        origin = transform[:3, 3]
        for direction, name, colour in zip(transform[:3, :3].T, names, colours, strict=False):
            end = origin + length * direction
            self.arrow(origin, end, color=colour, lw=1.2)
            away = self.flat(end) - self.flat(origin)
            self.name(end, name, away, 6, color=colour)

    def surface(
        self, mesh: trimesh.Trimesh, *, frame: NDArray | None = None, width_px: int = 900
    ) -> NDArray:
        """Put the shaded picture of a coloured mesh into the panel.

        Parameters
        ----------
        mesh : Trimesh
            With a colour of each vertex.
        frame : (4,) array, optional
            Left, right, bottom and top of the panel; by default what holds the mesh.
        width_px : int, optional

        Returns
        -------
        (4,) array
            The frame.
        """
        vertices = mesh.vertices @ self.upright.T
        frame = self.view.frame(vertices) if frame is None else frame
        colours = np.asarray(mesh.visual.vertex_colors)[:, :3] / 255
        look = {"width_px": width_px, "colours": colours}
        surface_panel(self.axes, vertices, np.asarray(mesh.faces), self.view, frame, **look)
        return frame


def provenances(params: Any) -> set[str]:
    """Whether a rule's captures, or recordings about sensors, are simulated, recorded or both."""
    if hasattr(params, "provenance"):
        return set(params.provenance.values())
    return {capture["provenance"] for capture in params.captures}


def labelled(figure: Figure, params: Any) -> Figure:
    """A laid-out figure, which says whether a rule's captures are simulated."""
    style.label_provenance(figure, provenances(params))
    return figure


def tangents(normal: NDArray) -> NDArray:
    """Two unit vectors across a vector of any length, the first as near x as can be, (2, 3)."""
    normal = normal / np.linalg.norm(normal)
    axis = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    first = axis - (axis @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def write(
    axes: Axes, place: Sequence, text: str, side: Sequence, points: float = 6, **look
) -> None:
    """Text some points away from a place, legible over what it crosses."""
    look = {"fontsize": TEXT_PT, "path_effects": HALO, "zorder": 6} | look
    offset = points * np.asarray(side, float) / np.linalg.norm(side)
    across = "left" if offset[0] > 3 else "right" if offset[0] < -3 else "center"
    axes.annotate(text, place, offset, textcoords="offset points", ha=across, va="center", **look)


def entitle(axes: Axes, title: str, letter: str) -> None:
    """Title on the line of the panel's letter, which stands by the axes' height."""
    height_in = axes.get_position().height * axes.figure.get_figheight()
    axes.set_title(title, pad=0.04 * height_in * POINTS_PER_INCH + LETTER_DEPTH_PT)
    style.panel_letter(axes, letter)


def dimension(
    axes: Axes, start: Sequence, stop: Sequence, text: str, side: Sequence, **look
) -> None:
    """Dimension line between two places of a panel, its text beside the middle."""
    axes.annotate("", stop, start, arrowprops=BOTH_WAYS | {"color": look.get("color", style.BLACK)})
    write(axes, np.add(start, stop) / 2, text, side, 5 if side[0] else 8, **look)


def leader(
    axes: Axes, place: Sequence, end: Sequence, text: str, *, ha: str = "left", va: str = "center"
) -> None:
    """Name of a part at the end of a thin line from it."""
    at = {"left": 0, "bottom": 0, "center": 0.5, "right": 1, "top": 1}
    line = {"arrowstyle": "-", "lw": 0.7, "shrinkA": 1, "shrinkB": 0, "relpos": (at[ha], at[va])}
    axes.annotate(text, place, end, arrowprops=line, fontsize=TEXT_PT, ha=ha, va=va, zorder=4)
    axes.plot(*place, "o", color=style.BLACK, mec="white", mew=0.6, ms=3.4, zorder=5)


def matrix(
    axes: Axes, rows: Sequence[Sequence[str]], ends: tuple[float, float], middle: float
) -> None:
    """Entries, in mathematical type, between two brackets.

    Parameters
    ----------
    axes : Axes
        Of unit width and height.
    rows : sequence of sequence of str
    ends : tuple of float
        Left and right bracket.
    middle : float
        Height of the middle row.
    """
    low, high = ends
    for side, inward in ((low, 0.02), (high, -0.02)):
        x = [side + inward, side, side, side + inward]
        axes.plot(x, middle + 0.13 * np.array([1, 1, -1, -1]), color=style.BLACK, lw=0.8)
    for (i, j), entry in np.ndenumerate(np.array(rows, object)):
        place = low + (high - low) * (j + 0.5) / len(rows[0]), middle + 0.085 * (1 - i)
        axes.text(*place, f"${entry}$", ha="center", va="center", fontsize=TEXT_PT)


def blank(
    figure: Figure, place: tuple[float, float, float, float], title: str = "", letter: str = ""
) -> Axes:
    """Panel in true proportions without a frame.

    Parameters
    ----------
    figure : Figure
    place : tuple of float
        Left, bottom, width and height as parts of the figure.
    title, letter : str, optional
        At its upper left.
    """
    axes = figure.add_axes(place)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_axis_off()
    if letter:
        named(axes, letter, title)
    return axes


def by_sensor_panels(
    tables: Mapping[str, object], height_in: float, *, rows: int = 1, **options
) -> tuple[Figure, NDArray, list]:
    """A column of panels for each sensor, with its letter and name.

    Parameters
    ----------
    tables : mapping
        By sensor.
    height_in : float
    rows : int, optional
    **options
        Of `matplotlib.pyplot.subplots`.

    Returns
    -------
    Figure, array of Axes (rows, sensors), list
        The list has the items of ``tables`` in the order of the columns.
    """
    size = (max(style.COLUMN_IN, style.PAGE_IN * len(tables) / 2), height_in)
    figure, axes = plt.subplots(rows, len(tables), figsize=size, squeeze=False, **options)
    items = sorted(tables.items())
    for panel, (name, _), letter in zip(axes[0], items, "abcdef", strict=False):
        named(panel, letter, style.sensor_name(name))
    return figure, axes, items


def legend_below(
    figure: Figure, axes: Axes, provenances: set[str], *, lay_out: bool = True
) -> Figure:
    """Put a panel's legend in a line under the figure, beside its provenance.

    Parameters
    ----------
    figure : Figure
    axes : Axes
        Whose entries it has.
    provenances : set of str
    lay_out : bool, optional
        Lay the panels out above it; else there is room already.
    """
    if lay_out:
        figure.tight_layout(rect=(0, LEGEND_IN / figure.get_figheight(), 1, 1))
    marks, names = axes.get_legend_handles_labels()
    place = {"loc": "lower left", "bbox_to_anchor": (0.005, 0.0), "ncols": len(names)}
    look = {"columnspacing": 1.4, "handletextpad": 0.5, "fontsize": TEXT_PT}
    figure.legend(marks, names, **place, **look)
    style.label_provenance(figure, provenances)
    return figure
