"""Track one capture: aligned template, added points, every frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.solid.mesh import SolidMesh
from palpate.surface.alignment import Alignment
from palpate.surface.augment import indenter_points, undeformed_points
from palpate.surface.distance import ClosestPoints
from palpate.surface.pose import to_camera
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.track import Frame, Tracked, TrackerOptions, track_frames


@dataclass(frozen=True)
class Recorded:
    """What one capture gives to a tracker.

    Attributes
    ----------
    template : Template
        Undeformed, object frame.
    solid : SolidMesh
        The object's solid mesh, object frame.
    support : mapping
        ``support`` block of object.yaml.
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    forces_n : (f, 3) array
        Force on the object in each frame, camera frame [N].
    indenter_radius_m : float
    alignment : Alignment
        Of the template with the first frame.
    """

    template: Template
    solid: SolidMesh
    support: Mapping
    clouds: Sequence[tuple[NDArray, NDArray]]
    tips_m: NDArray
    forces_n: NDArray
    indenter_radius_m: float
    alignment: Alignment


def track_capture(recorded: Recorded, options: Mapping) -> Tracked:
    """Track the aligned template through all frames.

    Parameters
    ----------
    recorded : Recorded
    options : mapping
        Of the tracker, as config.yaml describes them.

    Returns
    -------
    Tracked
    """
    return TRACKERS[options["kind"]](recorded, options)


def track_by_study(recorded: Recorded, options: Mapping) -> Tracked:
    """Track with the study's tracker (Section 4.3) and its added points."""
    pose, contact = recorded.alignment.camera_from_object, recorded.alignment.contact_point_m
    reach = options["refine_radius_m"]
    fine = refine_template(
        recorded.template, contact, radius_m=reach, edge_m=options["refine_edge_m"]
    )
    rest = to_camera(pose, fine.vertices_m)
    frames = _with_added_points(
        fine,
        rest,
        recorded.clouds,
        recorded.tips_m,
        recorded.indenter_radius_m,
        to_camera(pose, contact),
        reach,
    )
    chosen = {name: options[name] for name in TrackerOptions.__dataclass_fields__}
    vertices, observed, residual = track_frames(fine, rest, frames, TrackerOptions(**chosen))
    return Tracked(
        template_m=fine.vertices_m,
        faces=fine.faces,
        rest_m=rest,
        vertices_m=vertices,
        observed=observed,
        camera_from_object=pose,
        residual_m=residual,
        contact_point_m=contact,
        contact_frame=recorded.alignment.contact_frame,
    )


TRACKERS = {"study": track_by_study}


def _with_added_points(
    fine: Template,
    rest: NDArray,
    clouds: Sequence[tuple[NDArray, NDArray]],
    tips: NDArray,
    radius_m: float,
    contact: NDArray,
    reach_m: float,
) -> list[Frame]:
    directions = vertex_normals(rest, fine.faces)
    still = undeformed_points(rest, directions, clouds[0][0], contact, reach_m=2 * reach_m)
    surface = ClosestPoints(rest, fine.faces)
    depths = radius_m - surface.signed_distance(tips)
    up = directions[np.argmin(np.linalg.norm(rest - contact, axis=1))]
    frames = []
    for (points, normals), tip, depth in zip(clouds, tips, depths, strict=True):
        cap = indenter_points(tip, up, radius_m=radius_m, depth_m=float(depth))
        frames.append(
            Frame(
                np.concatenate([points, cap[0], still[0]]),
                np.concatenate([normals, cap[1], still[1]]),
                len(points),
            )
        )
    return frames
