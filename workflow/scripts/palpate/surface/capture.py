"""Track one capture: aligned template, added points, every frame."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.surface.augment import indenter_points, undeformed_points
from palpate.surface.distance import ClosestPoints
from palpate.surface.elastic_capture import track_by_elasticity
from palpate.surface.pose import to_camera
from palpate.surface.recorded import Recorded
from palpate.surface.template import Template, refine_template, vertex_normals
from palpate.surface.track import Frame, Tracked, TrackerOptions, track_frames


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


TRACKERS = {"study": track_by_study, "elastic": track_by_elasticity}


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
