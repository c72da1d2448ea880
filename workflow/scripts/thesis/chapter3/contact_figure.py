"""Figure 3.3: where the force acts on the meshes."""

from typing import Any

import matplotlib.pyplot as plt
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
from palpate.report.style import BLACK, GREEN, GREY, ORANGE, PAGE_IN, label_provenance
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import SolidMesh, read_solid, refine_near
from palpate.surface.tracked import Tracked, load_tracked
from palpate.units import MILLIMETRES

from thesis.diagrams import DASHED, provenances, tangents
from thesis.minimise.options import Solid

REACH_MM = 16
PLACE = "#F4F4F4"


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
        _panel(panel, *mesh, point_m, circle)
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
    label_provenance(figure, provenances(params))
    return figure


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


def _panel(
    axes: Axes,
    vertices_m: NDArray,
    triangles: NDArray,
    contact: NDArray,
    point: NDArray,
    circle: float,
) -> None:
    """The surface as seen along the contact triangle's normal."""
    normals = np.cross(*np.diff(vertices_m[triangles], axis=1).swapaxes(0, 1))
    a, b, c = vertices_m[contact]
    across = tangents(np.cross(b - a, c - a))
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
