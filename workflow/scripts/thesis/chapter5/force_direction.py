"""A body deformed by a force as measured and by one along the surface's normal (Fig. 5.12)."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.json_fields import read_all
from palpate.report.panels import Surface, named
from palpate.report.style import SMALL, sensor_name
from palpate.solid.load import contact_triangle, outward_normal
from palpate.surface.tracked import Recorded, Tracked, load_tracked
from palpate.units import MILLIMETRES
from scipy.spatial.transform import Rotation

from thesis.chapter5.tracking_inputs import recordings_of
from thesis.diagrams import labelled
from thesis.minimise.objective import Objective, Problem
from thesis.minimise.options import Load, Solid
from thesis.minimise.problem import pose_problem
from thesis.panels import coloured, displacement_bar, panels, scale_bar, surface_panel, wire
from thesis.views import View

# Table 5.4, Bumblebee, both terms of the error.
STUDY_E_PA, STUDY_NU = 130160.0, 0.2942
TILT_DEG = 5.0
MEASURED, TURNED = "as measured", "turned to the triangle's normal"
TILTED = f"tilted by {TILT_DEG:g}° (not measured)"


def _problems(
    recorded: Recorded, tracked: Tracked, fit: Mapping, load: Load, fineness: Solid
) -> dict[str, Problem]:
    """The problem of the most pressed frame by direction of the force."""
    frame, turn = fit["range"]["last_frame"], tracked.camera_from_object[:3, :3]
    posed = partial(
        pose_problem,
        recorded.solid,
        tracked,
        fit=fit,
        support=recorded.support,
        indenter_radius_m=recorded.indenter_radius_m,
        fineness=fineness,
    )
    measured = recorded.forces_n[frame]
    tilted_n = turn @ tilted(measured @ turn, -(measured @ turn), TILT_DEG)
    return {
        MEASURED: posed(measured, load=load.changed(turn_force=False)),
        TURNED: posed(measured, load=load.changed(turn_force=True)),
        TILTED: posed(tilted_n, load=load.changed(turn_force=False)),
    }


def _deformed(problem: Problem, contact_m: NDArray, normal: NDArray) -> tuple[Surface, str]:
    """The solid's surface under its nodal forces (Eq. 3.24), its tilt, and its way sideways."""
    moved = Objective(problem, "displacement").displacement(STUDY_E_PA, STUDY_NU)
    nodes, faces = problem.mesh.nodes_m, problem.mesh.surface_triangles()
    force, after = problem.force_n.sum(axis=0), nodes + moved
    cosine = -(force @ normal) / np.linalg.norm(force) / np.linalg.norm(normal)
    turn, _ = Rotation.align_vectors(after - after.mean(axis=0), nodes - nodes.mean(axis=0))
    angle, tilt = np.rad2deg([np.arccos(np.clip(cosine, -1, 1)),
                              np.linalg.norm(turn.as_rotvec()[:2])])  # fmt: skip
    sideways = np.linalg.norm(moved[np.unique(faces)].mean(axis=0)[:2]) * MILLIMETRES
    text = f"{angle:.1f}° from the triangle's normal\n"
    text += f"tilt {tilt:.2f}°, sideways {sideways:.2f} mm"
    return Surface(nodes, after, faces, contact_m), text


def tilted(force_n: NDArray, normal: NDArray, angle_deg: float) -> NDArray:
    """A force as strong, its direction this angle from the inward normal.

    It is tilted to the side to which the given force is; to x where that has none.
    """
    inward = -np.asarray(normal) / np.linalg.norm(normal)
    aside = force_n - (force_n @ inward) * inward
    if np.linalg.norm(aside) < 1e-9 * np.linalg.norm(force_n):
        aside = np.array([1.0, 0, 0]) - inward[0] * inward
    aside /= np.linalg.norm(aside)
    angle = np.deg2rad(angle_deg)
    return np.linalg.norm(force_n) * (np.cos(angle) * inward + np.sin(angle) * aside)


def figure_5_12(inputs: Any, params: Any) -> Figure:
    """Ball under the force as measured, turned and tilted, over its wire frame (Fig. 5.12)."""
    recorded, fit = recordings_of(inputs, params.probes)[0], read_all(inputs.fits)[0]
    tracked, load = load_tracked(inputs.tracked[0]), Load(force_rule=params.force_rule)
    problems = _problems(recorded, tracked, fit, load, Solid.read(params.solid))
    reach, point = recorded.indenter_radius_m, tracked.contact_point_m
    mesh = problems[TURNED].mesh
    normal = outward_normal(mesh, contact_triangle(mesh, point, largest_distance_m=reach))
    cases = [_deformed(problem, point, normal) for problem in problems.values()]
    # Across the direction to which the force is tilted.
    x, y, _ = problems[TILTED].force_n.sum(axis=0)
    view = View(float(np.rad2deg(np.arctan2(y, x)) - 90), 8)
    figure, axes = panels(1, len(cases), 2.75, right=0.89, bottom_in=0.7)
    top = max(float(surface.displacement_mm().max()) for surface, _ in cases)
    frame = view.frame(*(surface.deformed_m for surface, _ in cases), cases[0][0].rest_m)
    parts = zip(axes[0], "abc", problems, cases, strict=True)
    for panel, letter, title, (surface, text) in parts:
        colours = coloured(surface.displacement_mm(), top)
        surface_panel(panel, surface.deformed_m, surface.faces, view, frame, colours=colours)
        wire(panel, surface.rest_m, surface.faces, view)
        scale_bar(panel, 20)
        named(panel, letter, title)
        look = {"ha": "center", "va": "top", "fontsize": SMALL}
        panel.text(0.5, -0.03, text, transform=panel.transAxes, **look)
    displacement_bar(figure, axes, top)
    size = np.linalg.norm(recorded.forces_n[fit["range"]["last_frame"]])
    note = f"{sensor_name(params.captures[0]['sensor'])}; force {size:.1f} N,"
    note += f" E {STUDY_E_PA / 1e3:.0f} kPa and nu {STUDY_NU:.2f} of the study;"
    figure.text(0.02, 0.02, f"{note} deformation as computed", fontsize=SMALL)
    return labelled(figure, params)
