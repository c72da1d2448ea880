"""From a tracked capture to the measurement that the objective compares with (Section 3.3.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.solid.load import (
    contact_pressure,
    contact_triangle,
    hertz_contact_radius,
    nodal_force,
    outward_normal,
)
from palpate.solid.mesh import SolidMesh, quadratic, refine_near
from palpate.solid.support import Support
from palpate.surface.tracked import Tracked
from palpate.surface.transfer import to_solid

from thesis.minimise.objective import Measurement, NodeSets, Objective, node_sets
from thesis.minimise.options import Load, Solid


@dataclass(frozen=True)
class Problem:
    """Solid, node sets and measurement of one deformation, object frame.

    Attributes
    ----------
    mesh : SolidMesh
    sets : NodeSets
    measurement : Measurement
    left_out : int array or None
        Surface nodes whose displacement is not compared.
    """

    mesh: SolidMesh
    sets: NodeSets
    measurement: Measurement
    left_out: NDArray | None = None

    def objective(self, option: str) -> Objective:
        """Objective of the problem for an error option."""
        parts = self.mesh, self.sets, self.measurement
        return Objective(*parts, option=option, left_out=self.left_out)


def pose_problem(
    solid: SolidMesh,
    tracked: Tracked,
    force_n: NDArray,
    frame: int,
    depth_m: float,
    support: Support,
    *,
    indenter_radius_m: float,
    load: Load,
    fineness: Solid,
) -> Problem:
    """Pose the inverse problem of one frame.

    The displacement is the difference of the tracked surface between this frame and the first.

    Parameters
    ----------
    solid : SolidMesh
        Kept mesh of the object, elements of four nodes.
    tracked : Tracked
    force_n : (3,) array
        Force on the object in the frame, camera frame [N].
    frame : int
        Deformed frame.
    depth_m : float
        Indentation depth in it [m].
    support : Support
    indenter_radius_m : float
    load : Load
    fineness : Solid

    Raises
    ------
    ValueError
        If contact or support are not where the solid is.
    """
    turn = tracked.camera_from_object[:3, :3]
    mesh = refine_near(
        solid,
        tracked.contact_point_m,
        radius_m=fineness.refine_radius_m,
        edge_m=fineness.refine_edge_m,
    )
    mesh = quadratic(mesh) if fineness.element_order == 2 else mesh
    forces = _contact_forces(
        mesh,
        tracked.contact_point_m,
        force_n @ turn,
        rule=load.force_rule,
        turn_to_normal=load.turn_force,
        indenter_radius_m=indenter_radius_m,
        depth_m=depth_m,
    )
    sets = node_sets(mesh, support, contact_nodes=np.flatnonzero(forces.any(axis=1)))
    moved = (tracked.vertices_m[frame] - tracked.vertices_m[0]) @ turn
    displacement = to_solid(tracked.template_m, tracked.faces, moved, mesh)
    measurement = Measurement(displacement, forces, float(np.linalg.norm(force_n)))
    left_out = None
    if load.leave_out_radii > 0:
        reach = hertz_contact_radius(indenter_radius_m=indenter_radius_m, depth_m=depth_m)
        away = np.linalg.norm(mesh.nodes_m - tracked.contact_point_m, axis=1)
        near = np.flatnonzero(away < load.leave_out_radii * reach)
        left_out = np.intersect1d(mesh.surface_nodes(), near)
    return Problem(mesh, sets, measurement, left_out)


def _contact_forces(
    mesh: SolidMesh,
    point_m: NDArray,
    force_n: NDArray,
    *,
    rule: str,
    turn_to_normal: bool,
    indenter_radius_m: float,
    depth_m: float,
) -> NDArray:
    """Nodal forces (n, 3) [N] of the contact at a point of the surface."""
    triangle = contact_triangle(mesh, point_m, largest_distance_m=indenter_radius_m)
    press = {"indenter_radius_m": indenter_radius_m, "depth_m": depth_m}
    if rule != "hertz_patch":
        options = {"rule": rule, "turn_to_normal": turn_to_normal}
        return nodal_force(mesh, triangle, force_n, **options, **press)
    inward = -outward_normal(mesh, triangle)
    return contact_pressure(
        mesh,
        point_m,
        inward,
        np.linalg.norm(force_n) * inward if turn_to_normal else force_n,
        contact_radius_m=hertz_contact_radius(**press),
    )
