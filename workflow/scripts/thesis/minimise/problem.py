"""The inverse problem: solid, node sets and measurement of one deformation (Section 3.3.1)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.capture.tables import columns_of, read_table
from palpate.open3d_core import ClosestPoints
from palpate.solid.load import (
    contact_pressure,
    contact_triangle,
    hertz_contact_radius,
    nodal_force,
    outward_normal,
)
from palpate.solid.mesh import SolidMesh, doubled_normals, quadratic, read_solid, refine_near
from palpate.solid.support import Support
from palpate.surface.tracked import Tracked
from palpate.vision.force import FORCE
from palpate.workflow.job import naming
from palpate.workflow.object_inputs import read_declared

from thesis.minimise.objective import Problem, node_sets
from thesis.minimise.options import Load, Solid
from thesis.tracker.simulation import SimulatedSteps


def read_problem(
    inputs: Any, fit: Mapping, *, tracked: Tracked, probe: Mapping, options: Load, solid: Solid
) -> Problem:
    """Read the inverse problem of the deepest frame of the Hertz fit, for a tracked surface.

    Parameters
    ----------
    inputs : object
        Files by name: ``object``, ``solid`` and ``force``.
    fit : mapping
        hertz.json of the capture.
    tracked : Tracked
    probe : mapping
        The probe's file.
    options : Load
    solid : Solid

    Raises
    ------
    ValueError
        If a file is no such thing, or contact or support are not where the solid is.
    """
    mesh, radius_m = read_solid(inputs.solid), probe["indenter"]["radius_m"]
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)[fit["range"]["last_frame"]]
    with naming(inputs.object, "support", "contact"):
        support, given = read_declared(inputs.object)[1], {"load": options, "fineness": solid}
        return pose_problem(mesh, tracked, force, fit, support, indenter_radius_m=radius_m, **given)


def pose_problem(
    solid: SolidMesh,
    tracked: Tracked,
    force_n: NDArray,
    fit: Mapping,
    support: Support,
    *,
    indenter_radius_m: float,
    load: Load,
    fineness: Solid,
) -> Problem:
    """Pose the inverse problem of the deepest frame.

    The displacement is the difference of the tracked surface between this frame and the first.

    Parameters
    ----------
    solid : SolidMesh
        Kept mesh of the object, elements of four nodes.
    tracked : Tracked
    force_n : (3,) array
        Force on the object in the frame, camera frame [N].
    fit : mapping
        hertz.json: the frame, and the indentation depth in it.
    support : Support
    indenter_radius_m : float
    load : Load
    fineness : Solid

    Raises
    ------
    ValueError
        If contact or support are not where the solid is.
    """
    turn, point = tracked.camera_from_object[:3, :3], tracked.contact_point_m
    frame = fit["range"]["last_frame"]
    press = {"indenter_radius_m": indenter_radius_m, "depth_m": fit["samples"]["depth_m"][frame]}
    near = {"radius_m": fineness.refine_radius_m, "edge_m": fineness.refine_edge_m}
    mesh = refine_near(solid, point, **near)
    mesh = quadratic(mesh) if fineness.element_order == 2 else mesh
    forces = _contact_forces(mesh, point, force_n @ turn, load, press)
    sets = node_sets(mesh, support, contact_nodes=np.flatnonzero(forces.any(axis=1)))
    moved = (tracked.vertices_m[frame] - tracked.vertices_m[0]) @ turn
    displacement = to_solid(tracked.template_m, tracked.faces, moved, mesh)
    left_out = None
    if load.leave_out_radii > 0:
        away = np.linalg.norm(mesh.nodes_m - point, axis=1)
        left_out = np.flatnonzero(away < load.leave_out_radii * hertz_contact_radius(**press))
    return Problem(mesh, sets, displacement, forces, float(np.linalg.norm(force_n)), left_out)


def to_solid(
    template_m: NDArray, faces: NDArray, displacement_m: NDArray, mesh: SolidMesh
) -> NDArray:
    """Displacement of the solid's surface nodes, by barycentric coordinates on the template.

    Parameters
    ----------
    template_m, faces : (n, 3), (m, 3) arrays
        Undeformed template [m], in the solid's frame.
    displacement_m : (n, 3) array
        Its displacement [m].
    mesh : SolidMesh

    Returns
    -------
    (k, 3) array
        Displacement of each node of the solid [m]; NaN at interior nodes.
    """
    surface = mesh.surface_nodes()
    closest = ClosestPoints(template_m, faces)
    _, triangle, weights = closest(mesh.nodes_m[surface])
    result = np.full(mesh.nodes_m.shape, np.nan)
    result[surface] = closest.interpolate(displacement_m, triangle, weights)
    return result


def _contact_forces(
    mesh: SolidMesh, point_m: NDArray, force_n: NDArray, load: Load, press: Mapping[str, float]
) -> NDArray:
    """Nodal forces (n, 3) [N] of the contact at a point of the surface."""
    triangle = contact_triangle(mesh, point_m, largest_distance_m=press["indenter_radius_m"])
    if load.force_rule != "hertz_patch":
        rules = {"rule": load.force_rule, "turn_to_normal": load.turn_force}
        return nodal_force(mesh, triangle, force_n, **rules, **press)
    inward, radius_m = -outward_normal(mesh, triangle), hertz_contact_radius(**press)
    turned = np.linalg.norm(force_n) * inward if load.turn_force else force_n
    return contact_pressure(mesh, point_m, inward, turned, contact_radius_m=radius_m)


def pose_simulation(
    steps: SimulatedSteps, support: Support, *, tracked: Tracked | None = None
) -> Problem:
    """Pose the inverse problem of the last simulated frame.

    The loads are the simulation's; the surface's displacement is the simulation's too, or the
    tracker's. Interior displacements are left out.

    Parameters
    ----------
    steps : SimulatedSteps
    support : Support
        What holds the block.
    tracked : Tracked, optional
        Its vertices are the solid's surface nodes.

    Raises
    ------
    ValueError
        If the tracked surface is not the solid's.
    """
    nodes = steps.mesh.surface_nodes()
    if tracked is None:
        moved = steps.displacement_m[-1, nodes]
    else:
        if len(tracked.template_m) != len(nodes):
            count = len(tracked.template_m)
            raise ValueError(f"tracked: expected {len(nodes)} vertices, found {count}")
        moved = tracked.vertices_m[-1] - tracked.vertices_m[0]
    displacement = np.full(steps.mesh.nodes_m.shape, np.nan)
    displacement[nodes] = moved
    sets = node_sets(steps.mesh, support, contact_nodes=steps.triangle)
    force = steps.force_n[-1]
    total = float(np.linalg.norm(force.sum(axis=0)))
    return Problem(steps.mesh, sets, displacement, force, total)


def pressed_area_modulus(problem: Problem, triangle: NDArray) -> float:
    """E* from a load on a triangle, for want of a sphere whose Hertz fit would give it [Pa].

    Takes a half space under uniform pressure on a circle of the triangle's area, whose mean
    displacement is 16 p a / (3 pi E*) (Johnson, Contact Mechanics, 1985, Section 3.4).

    Parameters
    ----------
    problem : Problem
    triangle : (3,) int array
        Loaded nodes.
    """
    (normal,) = doubled_normals(problem.mesh.nodes_m, triangle[None])
    area = np.linalg.norm(normal) / 2
    moved = problem.displacement_m[triangle].mean(axis=0)
    depth = abs(moved @ normal) / (2 * area)
    pressure = problem.total_force_n / area
    return float(16 * pressure * np.sqrt(area / np.pi) / (3 * np.pi * depth))
