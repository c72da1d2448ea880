"""A body deformed by a force as measured and by one along the surface's normal (Fig. 5.12)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.json_fields import read_all
from palpate.report.panels import (
    coloured,
    displacement_bar,
    named,
    panels,
    scale_bar,
    surface_panel,
    wire,
)
from palpate.report.style import SMALL, label_provenance, sensor_name
from palpate.report.views import MILLIMETRES, Surface, View
from palpate.solid.load import contact_triangle, outward_normal
from palpate.solid.mesh import SolidMesh
from palpate.surface.tracked import Recorded, Tracked, load_tracked
from scipy.spatial.transform import Rotation

from thesis.chapter5.tracking_inputs import recordings_of
from thesis.minimise.objective import Objective, Problem
from thesis.minimise.options import Load, Solid
from thesis.minimise.problem import pose_problem

# Table 5.4, Bumblebee, both terms of the error.
STUDY_E_PA, STUDY_NU = 130160.0, 0.2942
TILT_DEG, TIMES = 5.0, 1.0
MEASURED, TURNED = "as measured", "turned to the triangle's normal"
LEANING = f"tilted by {TILT_DEG:g}° (not measured)"


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
        Turn of the whole body about horizontal axes, that of a rigid motion fitted to all nodes.
    sideways_m : float
        Horizontal part of the mean displacement of the surface [m].
    """

    surface: Surface
    angle_deg: float
    tilt_deg: float
    sideways_m: float


def make_figure_5_12(inputs: Any, params: Any) -> Figure:
    """The ball of the first sensor's capture under the force as measured, turned and tilted."""
    recorded, fit = recordings_of(inputs, params.probes)[0], read_all(inputs.fits)[0]
    tracked, load = load_tracked(inputs.tracked[0]), Load(force_rule=params.force_rule)
    problems = problems_of(recorded, tracked, fit, load, Solid.read(params.solid))
    normal = _normal_at(problems[TURNED].mesh, recorded, tracked)
    known = {"normal": normal, "E": STUDY_E_PA, "nu": STUDY_NU}
    contact = tracked.contact_point_m
    cases = [(name, press(problem, contact, **known)) for name, problem in problems.items()]
    view = _across(problems[LEANING].force_n.sum(axis=0))
    note = _note(recorded.forces_n[fit["range"]["last_frame"]])
    return figure_5_12(params.captures[0], cases, view, times=TIMES, note=note)


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
    leaning = turn @ tilted(measured @ turn, -(measured @ turn), TILT_DEG)
    return {
        MEASURED: posed(measured, load=load.changed(turn_force=False)),
        TURNED: posed(measured, load=load.changed(turn_force=True)),
        LEANING: posed(leaning, load=load.changed(turn_force=False)),
    }


def press(problem: Problem, contact_m: NDArray, *, E: float, nu: float, normal: NDArray) -> Pressed:
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

    It leans to the side to which the given force leans; to x where that has none.
    """
    inward = -np.asarray(normal) / np.linalg.norm(normal)
    aside = force_n - (force_n @ inward) * inward
    if np.linalg.norm(aside) < 1e-9 * np.linalg.norm(force_n):
        aside = np.array([1.0, 0, 0]) - inward[0] * inward
    aside /= np.linalg.norm(aside)
    angle = np.deg2rad(angle_deg)
    return np.linalg.norm(force_n) * (np.cos(angle) * inward + np.sin(angle) * aside)


def figure_5_12(
    capture: Mapping,
    cases: Sequence[tuple[str, Pressed]],
    view: View,
    *,
    times: float,
    note: str,
) -> Figure:
    """Deformed body over the wire frame of the undeformed one, by direction of the force.

    Parameters
    ----------
    capture : mapping
    cases : sequence of (title, Pressed)
    view : View
    times : float
        How many times the deformation is drawn.
    note : str
        Force, moduli and what is not measured.
    """
    figure, axes = panels(1, len(cases), 2.75, right=0.89, bottom_in=0.7)
    top = max(float(pressed.surface.displacement_mm().max()) for _, pressed in cases)
    drawn = [_drawn(pressed.surface, times) for _, pressed in cases]
    frame = view.frame(*drawn, cases[0][1].surface.rest_m)
    for panel, letter, (title, pressed), vertices in zip(
        axes[0], "abc", cases, drawn, strict=False
    ):
        surface = pressed.surface
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
    scale = "deformation as computed" if times == 1 else f"deformation drawn {times:g} times"
    text = f"{sensor_name(capture['sensor'])}; {note}; {scale}"
    figure.text(0.02, 0.02, text, fontsize=SMALL)
    label_provenance(figure, {capture["provenance"]})
    return figure


def _normal_at(mesh: SolidMesh, recorded: Recorded, tracked: Tracked) -> NDArray:
    """Outward normal of the contact triangle, object frame."""
    reach, point = recorded.indenter_radius_m, tracked.contact_point_m
    return outward_normal(mesh, contact_triangle(mesh, point, largest_distance_m=reach))


def _across(lean: NDArray) -> View:
    """View across the way that a force leans."""
    return View(float(np.rad2deg(np.arctan2(lean[1], lean[0])) - 90), 8)


def _note(force_n: NDArray) -> str:
    return (
        f"force {np.linalg.norm(force_n):.1f} N, E {STUDY_E_PA / 1e3:.0f} kPa and nu"
        f" {STUDY_NU:.2f} of the study"
    )


def _drawn(surface: Surface, times: float) -> NDArray:
    return surface.rest_m + times * (surface.deformed_m - surface.rest_m)
