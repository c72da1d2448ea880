"""Where the undeformed template stands in front of the camera, and where it was touched."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.capture.files import write_json
from palpate.json_fields import numbers_of, read_fields
from palpate.open3d_core import ClosestPoints
from palpate.solid.support import Support
from palpate.surface.options import Aligning, AlignmentLimits
from palpate.surface.pose import RestingPrior, align_rigidly, initial_pose, to_camera, to_object
from palpate.surface.template import Template
from palpate.units import MILLIMETRES, PERCENT

# A ray along the press starts a little outside the surface [m].
OUTSIDE_M = 1e-4
# The tip's way from the touch to the peak of the force has a direction from here on [m].
SHORTEST_WAY_M = 1e-3
# Each leaves of the way to the first touch less than half, up to 60 degrees off the normal.
TOUCHING_STEPS = 40


@dataclass(frozen=True)
class Alignment:
    """Rigid alignment of the template with a capture's first frame; alignment.json.

    Attributes
    ----------
    camera_from_object : (4, 4) array
    contact_point_m : (3,) array
        Point of the undeformed surface that was touched, object frame [m].
    contact_frame : int
        First frame in contact.
    rms_m : float
        Root mean square distance of the first frame's cloud from the template [m].
    """

    camera_from_object: NDArray
    contact_point_m: NDArray
    contact_frame: int
    rms_m: float


def align_first(
    template: Template,
    cloud: tuple[NDArray, NDArray],
    resting: RestingPrior,
    contact_frame: int,
    options: Aligning,
) -> Alignment:
    """Align the template with the first frame (Eq. 4.24), and reject what the data contradict.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    cloud : (points (n, 3) [m], normals (n, 3))
        Of the first frame, camera frame.
    resting : RestingPrior
        Table, support and touched point.
    contact_frame : int
        First frame in contact.
    options : Aligning

    Raises
    ------
    ValueError
        If too little of the cloud lies near the template, or a limit does not hold.
    """
    first = initial_pose(template, cloud[0], resting)
    pose = align_rigidly(template, *cloud, first, options, resting=resting)
    closest = ClosestPoints(template.vertices_m, template.faces)
    contact = closest(to_object(pose, resting.tip_m[None]))[0][0]
    distance = closest.signed_distance(to_object(pose, cloud[0]))
    found = Alignment(pose, contact, contact_frame, float(np.sqrt(np.mean(distance**2))))
    _require_fit(found, template, distance, resting, options)
    return found


def first_touch(
    template: Template, point_m: NDArray, direction: NDArray, radius_m: float
) -> NDArray:
    """Centre of a sphere that comes along a line through a point and just touches, (3,) [m]."""
    closest = ClosestPoints(template.vertices_m, template.faces)
    nearest_m = ((template.vertices_m - point_m) @ direction).min()
    centre = point_m + (nearest_m - radius_m) * direction
    for _ in range(TOUCHING_STEPS):
        centre = centre + (closest.signed_distance(centre[None])[0] - radius_m) * direction
    return centre


def resting_prior(
    template: Template,
    support: Support,
    point: Mapping,
    plane: NDArray,
    tips_m: NDArray,
    onset: int,
    peak: int,
    *,
    indenter_radius_m: float,
) -> RestingPrior:
    """What object.yaml, the table and the first touch say of the object's place.

    Parameters
    ----------
    template : Template
    support : Support
    point : mapping
        Declared ``position_m`` and, where the press is not straight down, ``direction``.
    plane : (4,) array
        Table, camera frame.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    onset, peak : int
        First frame with force, and that with the most.
    indenter_radius_m : float
    """
    way = tips_m[peak] - tips_m[onset]
    direction = np.array(point.get("direction", -support.up), dtype=float)
    direction /= np.linalg.norm(direction)
    position = np.array(point["position_m"], dtype=float)
    return RestingPrior(
        plane,
        support,
        point_m=position,
        centre_m=first_touch(template, position, direction, indenter_radius_m),
        tip_m=tips_m[onset],
        radius_m=indenter_radius_m,
        direction=direction,
        way=way / max(float(np.linalg.norm(way)), SHORTEST_WAY_M),
    )


def thickness_along(template: Template, point_m: NDArray, direction: NDArray) -> float:
    """Length of a ray through the template, from a point of its surface to where it leaves [m].

    Parameters
    ----------
    template : Template
    point_m : (3,) array
        Point of the surface, object frame [m].
    direction : (3,) array
        Into the object, of any length.

    Raises
    ------
    ValueError
        If the ray does not pass through the object.
    """
    mesh = trimesh.Trimesh(template.vertices_m, template.faces, process=False)
    step = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    hits, _, _ = mesh.ray.intersects_location([point_m - OUTSIDE_M * step], [step])
    along = np.sort((hits - point_m) @ step) if len(hits) else np.zeros(0)
    inside = along[along > OUTSIDE_M]
    if not len(inside):
        raise ValueError("direction: expected a ray through the template, found one that misses it")
    return float(inside[0])


def save_alignment(path: str | Path, alignment: Alignment) -> None:
    """Write alignment.json."""
    content = {
        "camera_from_object": alignment.camera_from_object.tolist(),
        "contact_point_m": alignment.contact_point_m.tolist(),
        "contact_frame": alignment.contact_frame,
        "residual": {"rms_m": alignment.rms_m},
    }
    write_json(path, content)


def load_alignment(path: str | Path) -> Alignment:
    """Read alignment.json.

    Raises
    ------
    ValueError
        If it is no JSON, or lacks a field or a field's numbers.
    """
    content = read_fields(path)
    pose = numbers_of(path, content, "camera_from_object", (4, 4))
    contact = numbers_of(path, content, "contact_point_m", (3,))
    frame = int(numbers_of(path, content, "contact_frame", ()))
    rms_m = float(numbers_of(path, content.get("residual", {}), "rms_m", ()))
    if not np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-6):
        raise ValueError(f"{path}: camera_from_object: expected a rigid transform, found another")
    return Alignment(pose, contact, frame, rms_m)


def _require_fit(
    found: Alignment,
    template: Template,
    distance_m: NDArray,
    resting: RestingPrior,
    options: Aligning,
) -> None:
    """Reject an alignment that its data contradict, by the first limit that does not hold.

    The distances (n,) are those of the cloud's points from the template [m].
    """
    limits, largest_m = options.limits, options.largest_distance_m
    near = (np.abs(distance_m) < largest_m).mean()
    if near < limits.least_near:
        expected = f"at least {limits.least_near:.0%} of its points within"
        where = f"{largest_m * MILLIMETRES:g} mm of the template"
        why = "template, its unit, the point, transforms or optics?"
        raise ValueError(f"cloud: expected {expected} {where}, found {near:.0%} ({why})")
    _at_most("residual", found.rms_m, limits.largest_rms_m, "rms from the template")
    _require_resting(found.camera_from_object, template, resting, limits)
    touch = np.linalg.norm(found.contact_point_m - resting.point_m)
    _at_most("points", touch, limits.largest_touch_m, "from the declared point to the contact")
    tip = to_object(found.camera_from_object, resting.tip_m[None])
    closest = ClosestPoints(template.vertices_m, template.faces)
    gap = closest.signed_distance(tip)[0] - resting.radius_m
    part = PERCENT * abs(gap) / float(np.linalg.norm(resting.tip_m))
    why = " (force_from_tip or marker_from_force by as much, square_m, the optics or depths by"
    why += f" {part:.2g} %, the template or its point?)"
    _at_most("tip", gap, limits.largest_gap_m, "from the template when the force begins", why)


def _require_resting(
    pose: NDArray, template: Template, resting: RestingPrior, limits: AlignmentLimits
) -> None:
    heights = to_camera(pose, template.vertices_m) @ resting.plane[:3] + resting.plane[3]
    largest = limits.largest_height_m
    found = {"its plane": resting.height_m(pose), "the template's lowest point": heights.min()}
    for what, height in found.items():
        if abs(height) > largest:
            expected = f"{what} within {largest * MILLIMETRES:g} mm of the table"
            where = f"{abs(height) * MILLIMETRES:.1f} mm {'below' if height < 0 else 'above'} it"
            raise ValueError(f"support: expected {expected}, found {where}")
    cosine = np.clip(pose[:3, :3] @ resting.support.up @ resting.plane[:3], -1, 1)
    tilt = float(np.rad2deg(np.arccos(cosine)))
    if tilt > limits.largest_tilt_deg:
        expected = f"its plane within {limits.largest_tilt_deg:g} degrees of the table"
        raise ValueError(f"support: expected {expected}, found {tilt:.1f} degrees")


def _at_most(name: str, found_m: float, largest_m: float, what: str, why: str = "") -> None:
    if not found_m <= largest_m:
        expected = f"at most {largest_m * MILLIMETRES:g} mm {what}"
        raise ValueError(f"{name}: expected {expected}, found {found_m * MILLIMETRES:.1f} mm{why}")
