"""Figures 3.1 and 3.2, which are drawn by hand, and meshes seen in space: 3.3, 3.4 and 3.10."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from shutil import copyfile
from typing import Any

import matplotlib.pyplot as plt
import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray
from palpate.json_fields import read_one
from palpate.open3d_core import ClosestPoints
from palpate.report.panels import named
from palpate.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, PAGE_IN, SMALL, label_provenance
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import SolidMesh, doubled_normals, read_solid, refine_near
from palpate.surface.tracked import Tracked, load_tracked
from palpate.units import MILLIMETRES

from thesis.diagrams import DASHED, labelled, tangents
from thesis.minimise.options import Solid
from thesis.panels import coloured, displacement_bar, scale_bar, surface_panel
from thesis.tracker.simulation import SimulatedSteps, read_steps
from thesis.views import View, upward

REACH_MM = 16
PLACE = "#F4F4F4"
EXAGGERATION = 4.0
SIDE = View(-68, 42)
DETAIL_MM = 80


def make_drawn(inputs: Any, params: Any) -> dict[str, Callable[[Path], object]]:
    """The figure's files."""
    return {name: partial(copyfile, inputs[name]) for name in ("png", "svg")}


def figure_3_3(inputs: Any, params: Any) -> Figure:
    """Contact triangle, the triangles around it and the indenter's contact circle (Fig. 3.3).

    Of the template that is tracked and of the solid that is loaded; the contact area is pi R d
    (Eq. 3.27).
    """
    fit, tracked = read_one(inputs.fit), load_tracked(inputs.tracked)
    point_m, radius_m = tracked.contact_point_m, fit["radius_m"]
    depth_m = fit["samples"]["depth_m"][fit["range"]["last_frame"]]
    views = _views(read_solid(inputs.solid), tracked, Solid.read(params.solid), radius_m)
    figure, axes = plt.subplots(1, len(views), figsize=(PAGE_IN, 4.1), squeeze=False)
    circle = min(np.sqrt(radius_m * max(depth_m, 0)), radius_m) * MILLIMETRES
    for panel, (title, *mesh), letter in zip(axes[0], views, "ab", strict=True):
        _contact_panel(panel, *mesh, point_m, circle)
        named(panel, letter, title)
    axes[0, 0].set_ylabel("Width (mm)")
    marks = [
        Patch(fc=ORANGE, ec=BLACK, lw=0.4, label="contact triangle"),
        Patch(fc=GREEN, alpha=0.55, ec=BLACK, lw=0.4, label="contact area: triangles around it"),
        Line2D([], [], color=ORANGE, ls=DASHED, lw=1.2,
               label=f"indenter's contact, radius {circle:.1f} mm at {depth_m * 1e3:.1f} mm depth"),
    ]  # fmt: skip
    figure.tight_layout(rect=(0, 0.1, 1, 1))
    figure.legend(handles=marks, loc="lower center", ncol=3, bbox_to_anchor=(0.5, 0.03))
    return labelled(figure, params)


def _views(
    solid: SolidMesh, tracked: Tracked, fineness: Solid, radius_m: float
) -> list[tuple[str, NDArray, NDArray, NDArray]]:
    """Title, vertices (n, 3) [m], triangles and contact triangle of both meshes."""
    point, template = tracked.contact_point_m, (tracked.template_m, tracked.faces)
    _, nearest, _ = ClosestPoints(*template)(point[None])
    near = {"radius_m": fineness.refine_radius_m, "edge_m": fineness.refine_edge_m}
    mesh = refine_near(solid, point, **near)
    loaded = np.asarray(contact_triangle(mesh, point, largest_distance_m=radius_m))
    return [
        ("Template (tracking)", *template, tracked.faces[nearest[0]]),
        ("Solid (estimate)", mesh.nodes_m, mesh.surface_triangles(), loaded),
    ]


def _contact_panel(
    axes: Axes,
    vertices_m: NDArray,
    triangles: NDArray,
    contact: NDArray,
    point: NDArray,
    circle: float,
) -> None:
    """The surface as seen along the contact triangle's normal."""
    normals = np.cross(*np.diff(vertices_m[triangles], axis=1).swapaxes(0, 1))
    across = tangents(doubled_normals(vertices_m, contact[None])[0])
    flat = (vertices_m - point) @ across.T * MILLIMETRES
    seen = triangles[normals @ np.cross(*across) > 0]
    shared = np.isin(seen, contact).sum(axis=1)
    for chosen, look in (
        (shared == 0, {"fc": PLACE, "ec": GREY, "lw": 0.4}),
        ((shared > 0) & (shared < 3), {"fc": GREEN, "alpha": 0.55, "ec": BLACK, "lw": 0.5}),
        (shared == 3, {"fc": ORANGE, "ec": BLACK, "lw": 0.6}),
    ):
        axes.add_collection(PolyCollection(flat[seen[chosen]], **look))
    axes.add_patch(Circle((0, 0), circle, fill=False, ec=ORANGE, ls=DASHED, lw=1.2, zorder=5))
    axes.plot(0, 0, "+", color=BLACK, ms=6, mew=0.9, zorder=6)
    axes.set(xlim=(-REACH_MM, REACH_MM), ylim=(-REACH_MM, REACH_MM), xlabel="Length (mm)")
    axes.set_aspect("equal")


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
    scale_bar(axes, 100)
    return top


def _detail(axes: Axes, steps: SimulatedSteps, tracked: NDArray, computed: NDArray) -> None:
    """The loaded nodes from above, with their tracked and computed displacement."""
    nodes, triangles = steps.mesh.nodes_m * MILLIMETRES, steps.mesh.surface_triangles()
    upper = triangles[upward(nodes, triangles)]
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
