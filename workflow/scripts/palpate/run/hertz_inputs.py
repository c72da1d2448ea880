"""What the Hertz fit reads of a capture."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.estimate.hertz.models import Press
from palpate.estimate.hertz.range import (
    HertzRange,
    check_contact,
    hertz_range,
    indentation_depth,
)
from palpate.estimate.hertz.record import Record, held_record
from palpate.run.job import naming
from palpate.surface.alignment import Alignment, load_alignment, thickness_along
from palpate.surface.checks import columns_of
from palpate.surface.template import Template, read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP


def read_press(
    inputs: Any, *, radius_m: float, onset_force_n: float
) -> tuple[Press, Record | None, dict]:
    """Read the press and the same with its hold.

    Parameters
    ----------
    inputs : object
        Files by name: ``object``, ``template``, ``alignment``, ``pose``, ``force``.
    radius_m : float
        Of the sphere.
    onset_force_n : float
        Smallest force that counts as contact [N].

    Returns
    -------
    press : Press
    record : Record or None
    told : dict
        ``range`` and ``samples`` of hertz.json.
    """
    poses = read_table(inputs.pose)
    with naming(inputs.force):
        table = read_table(inputs.force)
        forces, time = columns_of(table, FORCE), columns_of(table, ["time_s"])[:, 0]
        force = np.linalg.norm(forces, axis=1)
    with naming(inputs.pose):
        tips = columns_of(poses, TIP, frames=len(force))
    unit = load_yaml(inputs.object)["template"]["unit"]
    template = read_template(inputs.template, unit=unit)
    alignment = load_alignment(inputs.alignment)
    depth = indentation_depth(template, alignment, tips, radius_m=radius_m)
    with naming(inputs.force):
        chosen = hertz_range(force, onset_force_n=onset_force_n)
    with naming(inputs.pose):
        check_contact(depth, chosen.start)
    own = float(np.nanmedian(poses[ALONG_STD]))
    std = float(np.hypot(own, alignment.residual.contact_mean_m))
    with naming(inputs.template):
        thickness = _thickness(template, alignment, tips, chosen)
    press = Press(
        depth_m=depth[: chosen.stop + 1],
        force_n=force[: chosen.stop + 1],
        onset=chosen.start,
        radius_m=radius_m,
        thickness_m=thickness,
        depth_std_m=std,
    )
    record = held_record(time, depth, forces, chosen, frame_std_m=own, contact_std_m=std)
    return press, record, _told(chosen, depth, force)


def _told(chosen: HertzRange, depth_m: NDArray, force_n: NDArray) -> dict:
    return {
        "range": {"first_frame": chosen.start, "last_frame": chosen.stop},
        "samples": {"depth_m": depth_m.tolist(), "force_n": force_n.tolist()},
    }


def _thickness(
    template: Template, alignment: Alignment, tips_m: NDArray, chosen: HertzRange
) -> float:
    """Thickness of the object along the way of the tip from its touch to its deepest place [m]."""
    moved = tips_m[chosen.stop] - tips_m[chosen.start - 1]
    direction = alignment.camera_from_object[:3, :3].T @ moved
    return thickness_along(template, alignment.contact_point_m, direction)
