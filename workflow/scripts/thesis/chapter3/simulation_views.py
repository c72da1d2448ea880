"""Figures 3.4 and 3.10: the simulated block seen in space."""

from typing import Any

import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import NDArray
from palpate.report.style import BLACK, BLUE, ORANGE, PAGE_IN, label_provenance, panel_letter
from palpate.surface.template import unique_edges
from palpate.units import MILLIMETRES

from thesis.tracker.simulation import SimulatedSteps, lattice, read_steps

MAP = "cividis"
EXAGGERATION = 4.0
ELEVATION_DEG, AZIMUTH_DEG = 42, -68
PIECES = 8
LIGHT = np.array([-0.35, -0.5, 0.8])
DETAIL_MM = 80


def figure_3_4(steps: SimulatedSteps) -> Figure:
    """Displacement magnitude on the deformed block under its last load (Fig. 3.4)."""
    moved = steps.displacement_m[-1]
    size = np.linalg.norm(moved, axis=1) * MILLIMETRES
    figure = plt.figure(figsize=(PAGE_IN, 3.0))
    axes = _space(figure, left=-0.02, width=0.9)
    _surface(axes, steps, moved, size, top=float(size.max()))
    _bar(figure, "Displacement (mm)", float(size.max()))
    load = np.linalg.norm(steps.force_n[-1].sum(axis=0))
    text = f"load {load:.1f} N on the outlined triangle; deformation drawn {EXAGGERATION:g} times"
    figure.text(0.02, 0.03, text, fontsize=7.5)
    label_provenance(figure, {"simulated"})
    return figure


def figure_3_10(steps: SimulatedSteps, tracked_m: NDArray, computed_m: NDArray) -> Figure:
    """Mismatch of tracked and computed displacement at each surface node (Fig. 3.10).

    Parameters
    ----------
    steps : SimulatedSteps
    tracked_m, computed_m : (n, 3) arrays
        Displacements of the solid's nodes [m]; inside, the tracked ones are not read.
    """
    surface = steps.mesh.surface_nodes()
    gap = np.zeros(len(tracked_m))
    gap[surface] = np.linalg.norm((computed_m - tracked_m)[surface], axis=1) * MILLIMETRES
    figure = plt.figure(figsize=(PAGE_IN, 2.9))
    axes = _space(figure, left=-0.02, width=0.6)
    _surface(axes, steps, tracked_m, gap, top=float(gap.max()))
    figure.text(0.02, 0.92, "a", weight="bold")
    figure.text(0.045, 0.92, f"Mismatch; tracked deformation drawn {EXAGGERATION:g} times")
    detail = figure.add_axes((0.63, 0.17, 0.23, 0.64))
    _detail(detail, steps, tracked_m, computed_m)
    panel_letter(detail, "b")
    _bar(figure, "Mismatch (mm)", float(gap.max()), left=0.9)
    label_provenance(figure, {"simulated"})
    return figure


def _surface(
    axes: Axes, steps: SimulatedSteps, moved: NDArray, values: NDArray, *, top: float
) -> None:
    """Facets that face the viewer, coloured by values at the nodes and shaded."""
    nodes = (steps.mesh.nodes_m + EXAGGERATION * moved) * MILLIMETRES
    triangles = _facing(nodes, steps.mesh.surface_triangles())
    polygons, colours = _pieces(nodes, triangles, values)
    shade = np.repeat(_shade(nodes, triangles), len(colours) // len(triangles))
    rgba = colormaps[MAP](Normalize(0, top)(colours))
    rgba[:, :3] *= shade[:, None]
    facets = Poly3DCollection(polygons, facecolors=rgba, edgecolors=rgba, lw=0.3, rasterized=True)
    axes.add_collection3d(facets)
    lines = nodes[unique_edges(triangles)]
    axes.add_collection3d(Line3DCollection(lines, colors="white", lw=0.3, alpha=0.55))
    loop = nodes[steps.triangle[[0, 1, 2, 0]]]
    axes.add_collection3d(Line3DCollection([loop], colors=ORANGE, lw=1.2))
    _frame(axes, nodes)


def _pieces(nodes: NDArray, triangles: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """Small triangles of each facet, with the mean value of each."""
    weights = lattice(PIECES)
    number = {tuple(np.rint(w * PIECES).astype(int)): k for k, w in enumerate(weights)}
    small = []
    for i, j, k in number:
        if k > 0:
            small.append(((i, j, k), (i + 1, j, k - 1), (i, j + 1, k - 1)))
        if k > 1:
            small.append(((i + 1, j, k - 1), (i + 1, j + 1, k - 2), (i, j + 1, k - 1)))
    small = np.array([[number[corner] for corner in triple] for triple in small])
    points = np.einsum("kc,mcd->mkd", weights, nodes[triangles])[:, small]
    inner = np.einsum("kc,mc->mk", weights, values[triangles])[:, small].mean(axis=-1)
    return points.reshape(-1, 3, 3), inner.ravel()


def _facing(nodes: NDArray, triangles: NDArray) -> NDArray:
    elevation, azimuth = np.deg2rad([ELEVATION_DEG, AZIMUTH_DEG])
    towards = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
               np.sin(elevation)]  # fmt: skip
    return triangles[_normals(nodes, triangles) @ towards > 0]


def _shade(nodes: NDArray, triangles: NDArray) -> NDArray:
    return 0.6 + 0.4 * np.clip(_normals(nodes, triangles) @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)


def _normals(nodes: NDArray, triangles: NDArray) -> NDArray:
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _space(figure: Figure, *, left: float, width: float) -> Axes:
    """Square axes as wide as asked for, at the figure's mid-height."""
    height = width * figure.get_figwidth() / figure.get_figheight()
    place = (left, 0.48 - height / 2, width, height)
    axes = figure.add_axes(place, projection="3d", computed_zorder=False)
    axes.view_init(ELEVATION_DEG, AZIMUTH_DEG)
    axes.set_proj_type("ortho")
    return axes


def _frame(axes: Axes, nodes: NDArray) -> None:
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(min(low[2], 0), high[2]))
    axes.set_box_aspect(high - low, zoom=0.88)
    axes.set_axis_off()
    scale = np.array([[low[0] + 30, low[1] - 20, 0], [low[0] + 130, low[1] - 20, 0]])
    axes.plot(*scale.T, color=BLACK, lw=1.5, clip_on=False)
    axes.text(*(scale.mean(axis=0) - [0, 22, 0]), "100 mm", fontsize=7.5, ha="center", va="top")


def _detail(axes: Axes, steps: SimulatedSteps, tracked: NDArray, computed: NDArray) -> None:
    """The loaded nodes from above, with their tracked and computed displacement."""
    nodes, triangles = steps.mesh.nodes_m * MILLIMETRES, steps.mesh.surface_triangles()
    upper = triangles[_normals(nodes, triangles)[:, 2] > 0.5]
    centre = nodes[steps.triangle].mean(axis=0)
    axes.triplot(nodes[:, 0], nodes[:, 1], upper, color="0.8", lw=0.5)
    loop = nodes[steps.triangle[[0, 1, 2, 0]]]
    axes.plot(loop[:, 0], loop[:, 1], color=ORANGE, lw=1.0)
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
    axes.text(0, 1.02, "sideways motion, drawn 10 times", transform=axes.transAxes)
    axes.text(0, 1.10, "Computed", transform=axes.transAxes, color=BLACK, weight="bold")
    axes.text(0.48, 1.10, "and tracked", transform=axes.transAxes, color=BLUE, weight="bold")


def _bar(figure: Figure, label: str, top: float, *, left: float = 0.89) -> None:
    place = figure.add_axes((left, 0.2, 0.016, 0.62))
    figure.colorbar(ScalarMappable(Normalize(0, top), MAP), cax=place, label=label)


def make_figure_3_4(inputs: Any, params: Any) -> Figure:
    """Figure 3.4 from the block's steps."""
    return figure_3_4(read_steps(inputs.steps))


def make_figure_3_10(inputs: Any, params: Any) -> Figure:
    """Figure 3.10 from the steps and the mismatch."""
    values = meshio.read(inputs.mismatch).point_data
    found = values["tracked_displacement_m"], values["computed_displacement_m"]
    return figure_3_10(read_steps(inputs.steps), *found)
