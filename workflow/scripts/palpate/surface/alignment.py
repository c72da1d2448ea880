"""Where the undeformed template stands in front of the camera, and where it was touched."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.capture.files import write_json
from palpate.json_fields import numbers_of, read_fields
from palpate.open3d_core import ClosestPoints
from palpate.solid.support import Support
from palpate.surface.pose import RestingPrior, align_rigidly, initial_pose, to_camera, to_object
from palpate.surface.template import Template

# The cloud within this of the contact tells how well the surface lies there [m].
NEIGHBOURHOOD_M = 0.040
# A ray along the press starts a little outside the surface [m].
OUTSIDE_M = 1e-4
# The tip's way from the touch to the peak of the force has a direction from here on [m].
SHORTEST_WAY_M = 1e-3
# Each leaves of the way to the first touch less than half, up to 60 degrees off the normal.
TOUCHING_STEPS = 40


@dataclass(frozen=True)
class AlignmentResidual:
    """Distances of the first frame's cloud from the aligned template.

    Attributes
    ----------
    rms_m, median_m : float
        Of all points, unsigned [m].
    contact_mean_m, contact_rms_m : float
        Of the points within 40 mm of the contact, positive outside the template [m].
    contact_points : int
        How many those are; without any, mean and root mean square are those of all points.
    """

    rms_m: float
    median_m: float
    contact_mean_m: float
    contact_rms_m: float
    contact_points: int


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
    residual : AlignmentResidual
    """

    camera_from_object: NDArray
    contact_point_m: NDArray
    contact_frame: int
    residual: AlignmentResidual


def align_capture(
    template: Template,
    cloud: tuple[NDArray, NDArray],
    resting: RestingPrior,
    tips_m: NDArray,
    contact_frame: int,
    *,
    largest_distance_m: float,
    largest_normal_deg: float,
) -> Alignment:
    """Find the first pose, minimise Eq. 4.24, and find the touched point.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    cloud : (points (n, 3) [m], normals (n, 3))
        Of the first frame, camera frame.
    resting : RestingPrior
        Table, support and touched point.
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    contact_frame : int
        First frame in contact.
    largest_distance_m, largest_normal_deg : float
        dr and the angle threshold of Eq. 4.24.

    Returns
    -------
    Alignment

    Raises
    ------
    ValueError
        If too little of the cloud lies near the template.
    """
    points, normals = cloud
    pose = align_rigidly(
        template,
        points,
        normals,
        initial_pose(template, points, resting),
        largest_distance_m=largest_distance_m,
        largest_normal_deg=largest_normal_deg,
        resting=resting,
    )
    closest = ClosestPoints(template.vertices_m, template.faces)
    contact = closest(to_object(pose, tips_m[contact_frame : contact_frame + 1]))[0][0]
    residual = _residual(closest, to_object(pose, points), contact)
    return Alignment(pose, contact, contact_frame, residual)


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
    """Write alignment.json, with the contact point in the camera frame beside it."""
    pose, contact = alignment.camera_from_object, alignment.contact_point_m
    content = {
        "camera_from_object": pose.tolist(),
        "contact_point_m": contact.tolist(),
        "camera_contact_point_m": to_camera(pose, contact).tolist(),
        "contact_frame": alignment.contact_frame,
        "residual": asdict(alignment.residual),
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
    residual = content.get("residual")
    if not isinstance(residual, dict):
        raise ValueError(f"{path}: residual: expected fields, found {residual}")
    names = AlignmentResidual.__dataclass_fields__
    values = {name: float(numbers_of(path, residual, name, ())) for name in names}
    values["contact_points"] = int(values["contact_points"])
    if not np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-6):
        raise ValueError(f"{path}: camera_from_object: expected a rigid transform, found another")
    return Alignment(pose, contact, frame, AlignmentResidual(**values))


def _residual(closest: ClosestPoints, cloud: NDArray, contact: NDArray) -> AlignmentResidual:
    signed = closest.signed_distance(cloud)
    near = np.linalg.norm(cloud - contact, axis=1) < NEIGHBOURHOOD_M
    local = signed[near] if near.any() else signed
    return AlignmentResidual(
        rms_m=float(np.sqrt(np.mean(signed**2))),
        median_m=float(np.median(np.abs(signed))),
        contact_mean_m=float(local.mean()),
        contact_rms_m=float(np.sqrt(np.mean(local**2))),
        contact_points=int(near.sum()),
    )
