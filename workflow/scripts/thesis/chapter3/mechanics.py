"""Diagrams of continuum mechanics: Figures 3.1 and 3.2."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon
from numpy.typing import NDArray
from palpate.report.style import ARROW, BLACK, BLUE, COLUMN_IN, GREY, ORANGE, PAGE_IN, SMALL

# Fig. 3.1: place, name, symbol, and what is named by it.
QUANTITIES = {
    "displacement": ((1.5, 2.8), r"$\mathbf{u}$", "m"),
    "strain": ((1.5, 0.6), r"$\mathbf{\epsilon}$", "no unit"),
    "stress": ((6.5, 0.6), r"$\mathbf{\sigma}$", "Pa"),
    "force": ((6.5, 2.8), r"$\mathbf{f}$", "N"),
}
BOX = 1.9, 0.72
# Fig. 3.2: where the reader stands, lengths in edges of the cube.
SIDE_DEG, ABOVE_DEG = 38.0, 26.0
NORMAL, SHEAR, AXIS = 0.66, 0.27, 0.42
AXES = "xyz"
FACE_SHADES = "0.86", "0.93", "0.97"


def figure_3_1() -> Figure:
    """External and internal mechanical quantities and the laws that tie them (Fig. 3.1)."""
    figure = plt.figure(figsize=(PAGE_IN, 3.1))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(-0.6, 8.6), ylim=(-0.1, 3.75))
    axes.set_axis_off()
    for low, name in ((2.25, "external: observed and prescribed"), (-0.05, "internal")):
        axes.add_patch(_box((4.0, low + 0.7), (8.9, 1.4), fc="0.96", ec="none"))
        axes.text(-0.3, low + 1.3, name, ha="left", va="top", color="0.35", fontsize=SMALL)
    for name, (place, symbol, unit) in QUANTITIES.items():
        external = name in ("displacement", "force")
        axes.add_patch(_box(place, BOX, fc="white", ec=BLUE if external else ORANGE, lw=1.4))
        axes.text(place[0], place[1] + 0.15, name, ha="center", va="center", weight="bold")
        axes.text(place[0], place[1] - 0.16, f"{symbol}  ({unit})", ha="center", va="center")
    _law(axes, "displacement", "strain", "kinematic laws", _strain(), (-1, 0))
    _law(axes, "strain", "stress", "constitutive laws", r"$\sigma = C\,\epsilon$  (3.11)", (0, 1))
    _law(axes, "stress", "force", "equilibrium equations", _equilibrium(), (1, 0))
    whole = r"$\mathbf{f} = \mathbf{K}\,\mathbf{u}$  (3.1), $\mathbf{K} = \int_v \mathbf{B}^T"
    whole += r"\mathbf{C}\,\mathbf{B}\,dV$  (3.16)"
    _law(axes, "displacement", "force", "all three together", whole, (0, -1), dashed=True)
    return figure


def figure_3_2() -> Figure:
    """Stress components on the visible faces of an infinitesimal cube (Fig. 3.2)."""
    figure = plt.figure(figsize=(COLUMN_IN, 3.1))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set_aspect("equal")
    view = _view()
    for i in range(3):
        corners = _face(i) @ view
        axes.add_patch(Polygon(corners, fc=FACE_SHADES[i], ec=BLACK, lw=0.9, joinstyle="round"))
    for i in range(3):
        for j in range(3):
            _component(axes, i, j, view)
    _triad(axes, view)
    axes.set(xlim=(-1.5, 1.45), ylim=(-1.3, 1.3))
    return figure


def _strain() -> str:
    fraction = r"\left(\frac{\partial u_i}{\partial x_j} + \frac{\partial u_j}{\partial x_i}\right)"
    return rf"$\epsilon_{{ij}} = \frac{{1}}{{2}}{fraction}$  (3.4)"


def _equilibrium() -> str:
    return r"$f_i = \sum_j\,\frac{\partial \sigma_{ji}}{\partial x_j}$  (3.6)"


def _box(centre: tuple, size: tuple, **look) -> FancyBboxPatch:
    corner = np.array(centre) - np.array(size) / 2
    style = "round,pad=0,rounding_size=0.1"
    return FancyBboxPatch(corner, *size, boxstyle=style, **look)


def _law(
    axes: Axes, start: str, end: str, name: str, law: str, side: tuple, *, dashed: bool = False
) -> None:
    """Arrow between two quantities, with the law's name and its equation at a side of it."""
    a, b = (np.array(QUANTITIES[key][0]) for key in (start, end))
    way = np.sign(b - a) * np.array(BOX) / 2
    look = ARROW | {"arrowstyle": "<|-|>", "lw": 1.2, "ls": (0, (4, 2)) if dashed else "-"}
    axes.annotate("", b - way, a + way, arrowprops=look)
    middle, upright = (a + b) / 2, side[0] != 0
    if upright:
        # Beside the upright arrows, on their inner side there is room.
        place = middle - np.array(side) * 0.14
        across = "left" if side[0] < 0 else "right"
        axes.text(*place, f"{name}\n{law}", ha=across, va="center", linespacing=1.9)
        return
    axes.text(middle[0], middle[1] + 0.09, name, ha="center", va="bottom")
    axes.text(middle[0], middle[1] - 0.1, law, ha="center", va="top")


def _view() -> NDArray:
    """Parallel projection of space on the page, shape (3, 2)."""
    a, e = np.radians([SIDE_DEG, ABOVE_DEG])
    right = [-np.sin(a), np.cos(a), 0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    return np.array([right, up]).T


def _face(i: int) -> NDArray:
    """Corners of the face of the unit cube that looks along an axis, in order, shape (4, 3)."""
    j, k = (i + 1) % 3, (i + 2) % 3
    corners = np.full((4, 3), 0.5)
    corners[:, j] = [-0.5, 0.5, 0.5, -0.5]
    corners[:, k] = [-0.5, -0.5, 0.5, 0.5]
    return corners


def _component(axes: Axes, i: int, j: int, view: NDArray) -> None:
    """Arrow of sigma_ij: stress on the i-th plane along the j-th direction (Eq. 3.5)."""
    unit = np.eye(3)
    length = NORMAL if i == j else SHEAR
    start, end = (unit[i] / 2) @ view, (unit[i] / 2 + length * unit[j]) @ view
    colour = ORANGE if i == j else BLUE
    look = ARROW | {"color": colour, "lw": 1.4, "mutation_scale": 9}
    axes.annotate("", end, start, arrowprops=look)
    axes.plot(*start, "o", ms=2, color=BLACK)
    way = (end - start) / np.linalg.norm(end - start)
    text = rf"$\sigma_{{{AXES[i]}{AXES[j]}}}$"
    look = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": 9}
    # The labels of shear along x and y keep clear of their neighbours and of the edges.
    asides = {(0, 1): (-7, -8), (1, 0): (7, -8), (2, 0): (0, 6), (2, 1): (0, 6)}
    aside = np.array(asides.get((i, j), (0, 0)))
    axes.annotate(text, end, 9 * way + aside, color=colour, **look)


def _triad(axes: Axes, view: NDArray) -> None:
    """Coordinate axes beside the cube."""
    origin = np.array([-1.1, -1.0])
    for k, unit in enumerate(np.eye(3)):
        end = origin + AXIS * unit @ view
        axes.annotate("", end, origin, arrowprops=ARROW | {"color": GREY})
        way = (end - origin) / np.linalg.norm(end - origin)
        look = {"textcoords": "offset points", "ha": "center", "va": "center"}
        axes.annotate(f"${AXES[k]}$", end, 6 * way, **look)
        axes.plot(*end, alpha=0)


def make_figure_3_1(inputs: Any, params: Any) -> Figure:
    """Figure 3.1, from nothing."""
    return figure_3_1()


def make_figure_3_2(inputs: Any, params: Any) -> Figure:
    """Figure 3.2, from nothing."""
    return figure_3_2()
