"""From a tracked capture to the measurement that the objective compares with (Section 3.3.1)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.objective import Measurement
from palpate.solid.boundary import NodeSets, node_sets
from palpate.solid.fill import refine_near
from palpate.solid.load import contact_triangle, nodal_force
from palpate.solid.mesh import SolidMesh
from palpate.surface.track import Tracked
from palpate.surface.transfer import to_solid


@dataclass(frozen=True)
class Problem:
    """Solid, node sets and measurement of one deformation, object frame."""

    mesh: SolidMesh
    sets: NodeSets
    measurement: Measurement


def pose_problem(
    solid: SolidMesh,
    tracked: Tracked,
    force_n: NDArray,
    frame: int,
    depth_m: float,
    support: Mapping,
    *,
    indenter_radius_m: float,
    refine_radius_m: float,
    refine_edge_m: float,
    force_rule: str,
    turn_force: bool,
) -> Problem:
    """Pose the inverse problem of one frame.

    The displacement is the difference of the tracked surface between this frame and the first.

    Parameters
    ----------
    solid : SolidMesh
        Kept mesh of the object.
    tracked : Tracked
    force_n : (3,) array
        Force on the object in the frame, camera frame [N].
    frame : int
        Deformed frame.
    depth_m : float
        Indentation depth in it [m].
    support : mapping
        ``support`` block of object.yaml.
    indenter_radius_m : float
    refine_radius_m, refine_edge_m : float
        Local refinement of the solid at the contact [m].
    force_rule, turn_force
        Options of `palpate.solid.load.nodal_force`.
    """
    turn = tracked.camera_from_object[:3, :3]
    point = tracked.contact_point_m
    mesh = refine_near(solid, point, radius_m=refine_radius_m, edge_m=refine_edge_m)
    moved = (tracked.vertices_m[frame] - tracked.vertices_m[0]) @ turn
    triangle = contact_triangle(mesh, point, largest_distance_m=indenter_radius_m)
    sets = node_sets(
        mesh,
        contact_nodes=triangle,
        support_plane_point_m=np.array(support["plane_point_m"], dtype=float),
        support_plane_normal=np.array(support["plane_normal"], dtype=float),
        tolerance_m=support["tolerance_m"],
    )
    forces = nodal_force(
        mesh,
        triangle,
        force_n @ turn,
        rule=force_rule,
        turn_to_normal=turn_force,
        indenter_radius_m=indenter_radius_m,
        depth_m=depth_m,
    )
    displacement = to_solid(tracked.template_m, tracked.faces, moved, mesh)
    return Problem(mesh, sets, Measurement(displacement, forces, float(np.linalg.norm(force_n))))
