"""Track one capture: aligned template, added points, every frame."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.surface.alignment import Alignment
from palpate.surface.augment import indenter_points, undeformed_points
from palpate.surface.distance import ClosestPoints
from palpate.surface.pose import to_camera
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.track import Frame, Tracked, TrackerOptions, track_frames


def track_capture(
    template: Template,
    clouds: Sequence[tuple[NDArray, NDArray]],
    tips_m: NDArray,
    alignment: Alignment,
    *,
    indenter_radius_m: float,
    refine_radius_m: float,
    refine_edge_m: float,
    added_points: bool,
    options: TrackerOptions,
) -> Tracked:
    """Track the aligned template through all frames.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    alignment : Alignment
        Of the template with the first frame.
    indenter_radius_m : float
    refine_radius_m, refine_edge_m : float
        Refinement of the template around the contact [m].
    added_points : bool
        Whether the study's added points take part.
    options : TrackerOptions

    Returns
    -------
    Tracked
    """
    pose, contact = alignment.camera_from_object, alignment.contact_point_m
    fine = refine_template(template, contact, radius_m=refine_radius_m, edge_m=refine_edge_m)
    rest = to_camera(pose, fine.vertices_m)
    if added_points:
        frames = _with_added_points(
            fine, rest, clouds, tips_m, indenter_radius_m, to_camera(pose, contact), refine_radius_m
        )
    else:
        frames = [Frame(cloud, direction, len(cloud)) for cloud, direction in clouds]
    vertices, observed, residual = track_frames(fine, rest, frames, options)
    return Tracked(
        template_m=fine.vertices_m,
        faces=fine.faces,
        rest_m=rest,
        vertices_m=vertices,
        observed=observed,
        camera_from_object=pose,
        residual_m=residual,
        contact_point_m=contact,
        contact_frame=alignment.contact_frame,
    )


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
