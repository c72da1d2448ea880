"""Figure 3.8: the moves of the Nelder-Mead simplex, in a real step of a minimisation."""

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from palpate.report.panels import named
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN, finished
from palpate.solid.laws import engineering_from_lame
from palpate.solid.support import Support
from palpate.units import KILOPASCALS, MILLIMETRES
from scipy.optimize import minimize

from thesis.diagrams import DASHED, write
from thesis.minimise.objective import Objective
from thesis.minimise.problem import pose_simulation
from thesis.tracker.simulation import read_steps

LEVELS = 12
# The first triangle, as the study's grid of starts has it: nu 0.25 at the Hertz modulus [Pa].
FIRST_PA = np.array([[14e3, 14e3], [24e3, 14e3], [14e3, 17e3]])
RATIOS = np.geomspace(0.3, 30, 120)
SHEAR_MODULI_PA = np.linspace(4e3, 24e3, 200)
STEPS, SHOWN = 14, 0
NAMES = {"r": "reflection", "e": "expansion", "s_g": "shrink"}
NAMES |= {"c1": "contraction inside", "c2": "contraction outside"}


def _error_field(cost: Objective) -> tuple[NDArray, NDArray, NDArray]:
    """lambda, mu [Pa] and mean mismatch [m] on a grid, one solution for each ratio lambda / mu."""
    measured, found = cost.u[cost.surface], []
    for ratio in RATIOS:
        # Displacement of lambda = ratio, mu = 1 Pa; that of lambda, mu is mu times less.
        unit = cost.displacement(*engineering_from_lame(float(ratio), 1.0))[cost.surface]
        each = (np.linalg.norm(unit / mu - measured, axis=1).mean() for mu in SHEAR_MODULI_PA)
        found.append(list(each))
    lam = np.outer(RATIOS, SHEAR_MODULI_PA)
    return lam, np.broadcast_to(SHEAR_MODULI_PA, lam.shape), np.array(found)


def simplexes(cost: Callable[[NDArray], float], first: NDArray, count: int) -> list[NDArray]:
    """Simplexes of SciPy's Nelder-Mead, before the first step and after each.

    Parameters
    ----------
    cost : callable
    first : (3, 2) array
    count : int
        Steps.

    Returns
    -------
    list of (3, 2) array
        Vertices b, g, w of Algorithm 2 in this order, f(b) <= f(g) <= f(w).
    """
    order = np.argsort([cost(x) for x in first], kind="stable")
    found = [np.array(first)[order]]
    # SciPy counts the simplex it starts from as its first iteration.
    for k in range(1, count + 1):
        options = {"initial_simplex": found[0], "maxiter": k + 1, "xatol": 0, "fatol": 0}
        result = minimize(cost, found[0][0], method="Nelder-Mead", options=options)
        found.append(result.final_simplex[0])
    return found


def moves(simplex: NDArray) -> dict[str, NDArray]:
    """Points that Algorithm 2 may replace the worst vertex by, by their letters there.

    Parameters
    ----------
    simplex : (3, 2) array
        b, g, w.

    Returns
    -------
    dict
        ``m, r, e, c1, c2`` and, of the shrink towards b, ``s_g, s_w``; each (2,).
    """
    b, g, w = np.asarray(simplex, dtype=float)
    m = (b + g) / 2
    r = m + (m - w)
    contracted = {"c1": (m + w) / 2, "c2": (m + r) / 2, "s_g": (b + g) / 2, "s_w": (b + w) / 2}
    return {"m": m, "r": r, "e": r + (r - m)} | contracted


def figure_3_8(inputs: Any, params: Any) -> Figure:
    """Moves in one step down the error of the last load step, and the simplex's path (Fig. 3.8)."""
    support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1e-6)
    cost = Objective(pose_simulation(read_steps(inputs.steps), support), "displacement")

    def of_lame(x: NDArray) -> float:
        return cost(*engineering_from_lame(*x)) if min(x) > 0 else np.inf

    path = simplexes(of_lame, FIRST_PA, STEPS)
    field = _error_field(cost)
    figure, (left, right) = plt.subplots(1, 2, figsize=(PAGE_IN, 3.4))
    taken = _moves_panel(left, path[SHOWN], path[SHOWN + 1])
    for panel in (left, right):
        _contours(panel, field, coarse=panel is right)
        panel.set_xlabel("λ (kPa)")
    left.set_ylabel("μ (kPa)")
    _path_panel(right, path)
    named(left, "a", f"Step {SHOWN + 1}: {taken}")
    named(right, "b", f"First {len(path) - 1} steps")
    return finished(figure, {"simulated"})


def _taken(simplex: NDArray, following: NDArray) -> str:
    """Move that led from one simplex to the next."""
    size = np.ptp(simplex, axis=0)
    for letter, place in moves(simplex).items():
        gap = np.abs((following - place) / size).max(axis=1).min()
        if letter in NAMES and gap < 1e-6:
            return letter
    raise ValueError("simplex: expected a move of Algorithm 2, found another")


def _moves_panel(axes: Axes, simplex: NDArray, following: NDArray) -> str:
    points = {k: v * KILOPASCALS for k, v in moves(simplex).items()}
    corners, letter = simplex * KILOPASCALS, _taken(simplex, following)
    new = corners.copy()
    new[2] = points[letter]
    axes.add_patch(Polygon(corners, fc=BLUE, alpha=0.22, ec="none"))
    axes.add_patch(Polygon(corners, fc="none", ec=BLUE, lw=1.5))
    axes.add_patch(Polygon(new, fc="none", ec=ORANGE, lw=1.3, ls=DASHED))
    axes.plot(*np.array([corners[2], points["e"]]).T, color=BLACK, lw=0.7, ls=":")
    shrunk = np.array([corners[0], points["s_g"], points["s_w"]])
    axes.add_patch(Polygon(shrunk, fc="none", ec=GREEN, lw=1.0, ls=(0, (1, 1))))
    for name, place in zip("bgw", corners, strict=True):
        _letter(axes, name, place, BLUE)
    shown = {"m": "m", "r": "r", "e": "e", "c1": "c_1", "c2": "c_2", "s_w": "s"}
    for name, text in shown.items():
        colour = ORANGE if name == letter else GREEN if name == "s_w" else BLACK
        _letter(axes, text, points[name], colour)
    every = np.array([*corners, *points.values()])
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    axes.set(xlim=(low[0] - 0.14 * size[0], low[0] + 1.16 * size[0]))
    axes.set(ylim=(low[1] - 0.14 * size[1], low[1] + 1.16 * size[1]))
    return NAMES[letter]


def _letter(axes: Axes, text: str, place: NDArray, colour: str) -> None:
    axes.plot(*place, "o", ms=4.5, color=colour, mec="white", mew=0.6, zorder=4)
    write(axes, place, rf"$\mathbf{{{text}}}$", (1, 0.8), 6.5, fontsize=10, color=colour)


def _contours(axes: Axes, field: tuple, *, coarse: bool) -> None:
    units = KILOPASCALS, KILOPASCALS, MILLIMETRES
    x, y, error = (values * unit for values, unit in zip(field, units, strict=True))
    if coarse:
        shown = error <= np.quantile(error, 0.9)
    else:
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        shown = (x > left) & (x < right) & (y > low) & (y < high)
    levels = np.geomspace(error[shown].min(), error[shown].max(), LEVELS)
    lines = axes.contour(x, y, error, levels=levels, colors=GREY, linewidths=0.6, zorder=0.5)
    axes.clabel(lines, levels[1::3], fmt="%.2g mm", fontsize=6.5)


def _path_panel(axes: Axes, path: list[NDArray]) -> None:
    for k, simplex in enumerate(path):
        colour, width = (BLUE, 1.4) if k == SHOWN else (BLACK, 0.6)
        corners = simplex * KILOPASCALS
        axes.add_patch(Polygon(corners, fc="none", ec=colour, lw=width, joinstyle="round"))
    every = np.concatenate(path) * KILOPASCALS
    low, size = every.min(axis=0), np.ptp(every, axis=0)
    axes.set_xlim(low[0] - 0.08 * size[0], low[0] + 1.14 * size[0])
    axes.set_ylim(low[1] - 0.12 * size[1], low[1] + 1.12 * size[1])
