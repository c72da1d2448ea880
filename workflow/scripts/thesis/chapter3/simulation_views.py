"""Figures 3.4 and 3.10: the simulated block seen in space."""

from typing import Any

import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.report.panels import named
from palpate.report.style import BLACK, BLUE, GREEN, PAGE_IN, SMALL, label_provenance
from palpate.units import MILLIMETRES

from thesis.panels import coloured, displacement_bar, scale_bar, surface_panel
from thesis.tracker.simulation import SimulatedSteps, read_steps
from thesis.views import View

EXAGGERATION = 4.0
SIDE = View(-68, 42)
DETAIL_MM = 80


def figure_3_4(inputs: Any, params: Any) -> Figure:
    """Displacement magnitude on the deformed block under its last load (Fig. 3.4)."""
    steps = read_steps(inputs.steps)
    moved = steps.displacement_m[-1]
    figure = plt.figure(figsize=(PAGE_IN, 3.0))
    axes = figure.add_axes((0.01, 0.1, 0.88, 0.88))
    top = _block(axes, steps, moved, np.linalg.norm(moved, axis=1) * MILLIMETRES)
    displacement_bar(figure, axes, top)
    load = np.linalg.norm(steps.force_n[-1].sum(axis=0))
    text = f"load {load:.1f} N on the outlined triangle; deformation drawn {EXAGGERATION:g} times"
    figure.text(0.02, 0.03, text, fontsize=SMALL)
    label_provenance(figure, {"simulated"})
    return figure


def figure_3_10(inputs: Any, params: Any) -> Figure:
    """Mismatch of tracked and computed displacement at each surface node (Fig. 3.10)."""
    steps, values = read_steps(inputs.steps), meshio.read(inputs.mismatch).point_data
    tracked_m, computed_m = (values[f"{how}_displacement_m"] for how in ("tracked", "computed"))
    surface = steps.mesh.surface_nodes()
    gap = np.zeros(len(tracked_m))
    gap[surface] = np.linalg.norm((computed_m - tracked_m)[surface], axis=1) * MILLIMETRES
    figure = plt.figure(figsize=(PAGE_IN, 2.9))
    axes = figure.add_axes((0.02, 0.24, 0.6, 0.64))
    top = _block(axes, steps, tracked_m, gap)
    named(axes, "a", f"Mismatch; tracked deformation drawn {EXAGGERATION:g} times")
    displacement_bar(figure, axes, top, place=(0.2, 0.18, 0.36, 0.025), label="Mismatch (mm)")
    detail = figure.add_axes((0.68, 0.28, 0.28, 0.6))
    _detail(detail, steps, tracked_m, computed_m)
    named(detail, "b", "Sideways, drawn 10 times")
    label_provenance(figure, {"simulated"})
    return figure


def _block(axes: Axes, steps: SimulatedSteps, moved_m: NDArray, values: NDArray) -> float:
    """Deformed block, coloured by values at the nodes up to their largest, which is returned."""
    nodes, top = steps.mesh.nodes_m + EXAGGERATION * moved_m, float(values.max())
    # Corners of its own for each facet: edges stay sharp.
    corners = steps.mesh.surface_triangles().ravel()
    facets, frame = np.arange(len(corners)).reshape(-1, 3), SIDE.frame(nodes)
    look = {"colours": coloured(values, top)[corners], "edges": True, "width_px": 1400}
    surface_panel(axes, nodes[corners], facets, SIDE, frame, **look)
    loop = SIDE.project(nodes[steps.triangle[[0, 1, 2, 0]]])
    axes.plot(*loop[:, :2].T, color=GREEN, lw=1.4, zorder=4)
    scale_bar(axes, 100, frame)
    return top


def _detail(axes: Axes, steps: SimulatedSteps, tracked: NDArray, computed: NDArray) -> None:
    """The loaded nodes from above, with their tracked and computed displacement."""
    nodes, triangles = steps.mesh.nodes_m * MILLIMETRES, steps.mesh.surface_triangles()
    upper = triangles[_upward(nodes, triangles)]
    centre = nodes[steps.triangle].mean(axis=0)
    axes.triplot(nodes[:, 0], nodes[:, 1], upper, color="0.8", lw=0.5)
    loop = nodes[steps.triangle[[0, 1, 2, 0]]]
    axes.plot(loop[:, 0], loop[:, 1], color=GREEN, lw=1.4)
    shown = np.unique(upper)
    shown = shown[np.linalg.norm(nodes[shown, :2] - centre[:2], axis=1) < DETAIL_MM]
    for moved, colour in ((computed, BLACK), (tracked, BLUE)):
        axes.quiver(
            *nodes[shown, :2].T,
            *(moved[shown, :2] * MILLIMETRES).T,
            color=colour,
            width=0.009 if colour == BLACK else 0.006,
            angles="xy",
            scale_units="xy",
            scale=0.1,
            zorder=3,
        )
    axes.set_xlim(centre[0] - 50, centre[0] + 50)
    axes.set_ylim(centre[1] - 60, centre[1] + 60)
    axes.set_aspect("equal")
    axes.set(xlabel="Length (mm)", ylabel="Width (mm)")
    for name, colour in (("computed", BLACK), ("tracked", BLUE)):
        axes.plot([], [], color=colour, label=name)
    axes.legend(loc="upper center", bbox_to_anchor=(0.4, -0.22), ncols=2)


def _upward(nodes: NDArray, triangles: NDArray) -> NDArray:
    """Which triangles face up, within 60 degrees."""
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals[:, 2] > 0.5 * np.linalg.norm(normals, axis=1)
