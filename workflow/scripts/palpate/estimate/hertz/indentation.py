"""What of a capture is a press, and what of it is held."""

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.hertz.models import Indentation
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.range import check_contact, hertz_range, indentation_depth
from palpate.estimate.hertz.record import Record, forces_along, held_record
from palpate.estimate.hertz.shape import shape_at
from palpate.solid.support import Support
from palpate.surface.alignment import Alignment, thickness_along
from palpate.surface.template import Template


def indentation_of(
    template: Template,
    support: Support,
    alignment: Alignment,
    tips_m: NDArray,
    forces_n: NDArray,
    time_s: NDArray,
    *,
    radius_m: float,
    tip_std_m: float,
    options: Hertz,
) -> tuple[Indentation, Record | None, dict]:
    """Find the press of a capture, and the same with its hold.

    Parameters
    ----------
    template : Template
    support : Support
    alignment : Alignment
    tips_m, forces_n : (f, 3) arrays
        Centre of the sphere and force on the object, camera frame [m, N].
    time_s : (f,) array
        Of the frames [s].
    radius_m : float
        Of the sphere.
    tip_std_m : float
        Deviation of a tip along the probe's axis [m].
    options : Hertz

    Returns
    -------
    indentation : Indentation
    record : Record or None
    told : dict
        ``range`` and ``samples`` of hertz.json.

    Raises
    ------
    ValueError
        ``force``, ``depth`` or ``direction``: if there is no press, it begins elsewhere than at
        the surface, or the object has no thickness under it.
    """
    magnitude = np.linalg.norm(forces_n, axis=1)
    depth = indentation_depth(template, alignment, tips_m, radius_m=radius_m)
    chosen = hertz_range(magnitude, onset_force_n=options.onset_force_n)
    check_contact(depth, chosen.start)
    std = float(np.hypot(tip_std_m, options.offset_std_m))
    force = forces_along(depth, forces_n, chosen, frame_std_m=tip_std_m)
    used = slice(chosen.stop + 1)
    moved = tips_m[chosen.stop] - tips_m[chosen.start - 1]
    direction = alignment.camera_from_object[:3, :3].T @ moved
    shape = shape_at(
        template,
        support,
        alignment.contact_point_m,
        direction,
        radius_m=radius_m,
        # A zero that is off can leave no depth at all.
        depth_m=max(float(depth[used].max()), std),
    )
    indentation = Indentation(
        depth_m=depth[used],
        force_n=force[used],
        magnitude_n=magnitude[used],
        onset=chosen.start,
        radius_m=radius_m,
        thickness_m=thickness_along(template, alignment.contact_point_m, direction),
        depth_std_m=std,
        shape=shape,
    )
    record = held_record(time_s, depth, forces_n, chosen, frame_std_m=tip_std_m, contact_std_m=std)
    told = {
        "range": {"first_frame": chosen.start, "last_frame": chosen.stop},
        "samples": {"depth_m": depth.tolist(), "force_n": magnitude.tolist()},
    }
    return indentation, record, told
