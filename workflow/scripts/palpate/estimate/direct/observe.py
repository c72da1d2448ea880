"""Motion of an object's surface in a capture, from its clouds and the probe's way."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.correspondences import clearance, eyes_of, probe_in_view
from palpate.estimate.direct.motion import SurfaceMotion, frames_at_rest, surface_motion
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.picture_motion import Pictures, with_pictures
from palpate.estimate.hertz.indentation import indentation_depth
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_camera
from palpate.surface.template import Template

# Of a stereo head, so many windows beside the tip hold both tip and surface.
CLEAR_WINDOWS = 1.3


def rest_frames(
    template: Template,
    alignment: Alignment,
    tips_m: NDArray,
    forces_n: NDArray,
    *,
    radius_m: float,
    onset_force_n: float,
) -> NDArray:
    """Frames in which nothing is pressed yet.

    Parameters
    ----------
    template : Template
    alignment : Alignment
    tips_m, forces_n : (f, 3) arrays
        Centre of the sphere and force on the object, camera frame [m, N].
    radius_m : float
        Of the sphere.
    onset_force_n : float
        Smallest force that counts as contact [N].
    """
    depth = indentation_depth(template, alignment, tips_m, radius_m=radius_m)
    force = np.linalg.norm(forces_n, axis=1)
    return frames_at_rest(depth, force, onset_force_n=onset_force_n)


def observed_motion(
    template: Template,
    alignment: Alignment,
    clouds: Sequence[tuple[NDArray, NDArray]],
    probe: tuple[NDArray, NDArray],
    rest: NDArray,
    sensor: Mapping,
    options: Observation,
    *,
    radius_m: float,
    pictures: Pictures | None = None,
) -> SurfaceMotion:
    """Motion of the surface's samples in each frame, against the frames at rest.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    alignment : Alignment
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    probe : (tips (f, 3) [m], axes (f, 3))
        Centre of the sphere and pressing direction in each frame, camera frame.
    rest : int array
        Frames at rest.
    sensor : mapping
        The sensor's file.
    options : Observation
    radius_m : float
        Of the sphere.
    pictures : Pictures, optional
        Of all frames by the reference camera; what moves across its lines of sight is seen in them.

    Raises
    ------
    ValueError
        As `surface_motion` does.
    """
    contact = to_camera(alignment.camera_from_object, alignment.contact_point_m)
    clear = clearance(
        sensor,
        float(np.linalg.norm(contact)),
        radius_m=radius_m,
        windows=CLEAR_WINDOWS,
        otherwise_m=options.clear_m,
    )
    view = probe_in_view(alignment, *probe, eyes_m=eyes_of(sensor))
    chosen = options.changed(clear_m=clear)
    motion = surface_motion(template, alignment, clouds, view, rest, chosen)
    if pictures is None:
        return motion
    view = probe_in_view(alignment, *probe, eyes_m=np.zeros((1, 3)))
    return with_pictures(motion, alignment, pictures, view, chosen)
