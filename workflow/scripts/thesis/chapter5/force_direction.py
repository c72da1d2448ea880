"""A body deformed by a force as measured and by one along the surface's normal (Fig. 5.12)."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.json_fields import read_all
from palpate.report.panels import Surface, named
from palpate.report.style import SMALL, label_provenance, sensor_name
from palpate.solid.load import contact_triangle, outward_normal
from palpate.solid.mesh import SolidMesh
from palpate.surface.tracked import Recorded, Tracked, load_tracked
from palpate.units import MILLIMETRES
from scipy.spatial.transform import Rotation

from thesis.chapter5.tracking_inputs import recordings_of
from thesis.diagrams import provenances
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


@dataclass(frozen=True)
class Pressed:
    """Surface of a solid that a force deforms.

    Attributes
    ----------
    surface : Surface
        As computed.
    angle_deg : float
        Between force and inward normal of the contact.
    tilt_deg : float
        Turn of the whole body about horizontal axes, of a rigid displacement fitted to all nodes.
    sideways_m : float
        Horizontal part of the mean displacement of the surface [m].
    """

    surface: Surface
    angle_deg: float
    tilt_deg: float
    sideways_m: float


def problems_of(
    recorded: Recorded, tracked: Tracked, fit: Mapping, load: Load, fineness: Solid
) -> dict[str, Problem]:
    """The problem of the most pressed frame by direction of the force.

    Parameters
    ----------
    recorded : Recorded
    tracked : Tracked
    fit : mapping
        hertz.json of the capture.
    load : Load
    fineness : Solid
    """
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


def deformed(
    problem: Problem, contact_m: NDArray, *, E: float, nu: float, normal: NDArray
) -> Pressed:
    """Linear elastic deformation of a posed problem under its nodal forces (Eq. 3.24).

    Parameters
    ----------
    problem : Problem
    contact_m : (3,) array
        Touched point, object frame [m].
    E, nu : float
        Young's modulus [Pa] and Poisson's ratio.
    normal : (3,) array
        Outward normal of the contact.
    """
    moved = Objective(problem, "displacement").displacement(E, nu)
    nodes, faces = problem.mesh.nodes_m, problem.mesh.surface_triangles()
    force = problem.force_n.sum(axis=0)
    cosine = -(force @ normal) / np.linalg.norm(force) / np.linalg.norm(normal)
    turn, _ = Rotation.align_vectors(
        nodes + moved - (nodes + moved).mean(axis=0), nodes - nodes.mean(axis=0)
    )
    mean = moved[np.unique(faces)].mean(axis=0)
    return Pressed(
        Surface(nodes, nodes + moved, faces, contact_m),
        float(np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))),
        float(np.rad2deg(np.linalg.norm(turn.as_rotvec()[:2]))),
        float(np.linalg.norm(mean[:2])),
    )


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
    problems = problems_of(recorded, tracked, fit, load, Solid.read(params.solid))
    normal = _normal_at(problems[TURNED].mesh, recorded, tracked)
    known = {"normal": normal, "E": STUDY_E_PA, "nu": STUDY_NU}
    contact = tracked.contact_point_m
    cases = [(name, deformed(problem, contact, **known)) for name, problem in problems.items()]
    view = _across(problems[TILTED].force_n.sum(axis=0))
    figure, axes = panels(1, len(cases), 2.75, right=0.89, bottom_in=0.7)
    top = max(float(pressed.surface.displacement_mm().max()) for _, pressed in cases)
    surfaces = [pressed.surface for _, pressed in cases]
    frame = view.frame(*(one.deformed_m for one in surfaces), surfaces[0].rest_m)
    for panel, letter, (title, pressed) in zip(axes[0], "abc", cases, strict=False):
        surface, vertices = pressed.surface, pressed.surface.deformed_m
        colours = coloured(surface.displacement_mm(), top)
        surface_panel(panel, vertices, surface.faces, view, frame, colours=colours)
        wire(panel, surface.rest_m, surface.faces, view)
        scale_bar(panel, 20, frame)
        named(panel, letter, title)
        text = (
            f"{pressed.angle_deg:.1f}° from the triangle's normal\ntilt {pressed.tilt_deg:.2f}°,"
            f" sideways {pressed.sideways_m * MILLIMETRES:.2f} mm"
        )
        panel.text(0.5, -0.03, text, transform=panel.transAxes, ha="center", va="top",
                   fontsize=SMALL)  # fmt: skip
    displacement_bar(figure, axes, top)
    note = _note(recorded.forces_n[fit["range"]["last_frame"]])
    name = sensor_name(params.captures[0]["sensor"])
    figure.text(0.02, 0.02, f"{name}; {note}; deformation as computed", fontsize=SMALL)
    label_provenance(figure, provenances(params))
    return figure


def _normal_at(mesh: SolidMesh, recorded: Recorded, tracked: Tracked) -> NDArray:
    """Outward normal of the contact triangle, object frame."""
    reach, point = recorded.indenter_radius_m, tracked.contact_point_m
    return outward_normal(mesh, contact_triangle(mesh, point, largest_distance_m=reach))


def _across(force_n: NDArray) -> View:
    """View across the direction to which a force is tilted."""
    return View(float(np.rad2deg(np.arctan2(force_n[1], force_n[0])) - 90), 8)


def _note(force_n: NDArray) -> str:
    return (
        f"force {np.linalg.norm(force_n):.1f} N, E {STUDY_E_PA / 1e3:.0f} kPa and nu"
        f" {STUDY_NU:.2f} of the study"
    )
