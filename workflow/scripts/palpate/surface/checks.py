"""What must hold before a capture is aligned and tracked, and whether an alignment fits."""

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.surface.alignment import Alignment
from palpate.surface.options import AlignmentLimits
from palpate.surface.pose import RestingPrior, to_camera, to_object
from palpate.surface.template import Template
from palpate.units import MILLIMETRES, PERCENT

# A plane through so many neighbours gives a normal, and so many points a pose.
FEWEST_POINTS = 30
# Triangles thinner than this, height over longest edge, have no normal in single precision.
FLATTEST = 1e-5


def require_fit(
    alignment: Alignment,
    template: Template,
    cloud_m: NDArray,
    resting: RestingPrior,
    tip_m: NDArray,
    limits: AlignmentLimits,
    *,
    largest_distance_m: float,
    indenter_radius_m: float,
) -> None:
    """Refuse an alignment that its data contradict.

    Parameters
    ----------
    alignment : Alignment
    template : Template
    cloud_m : (n, 3) array
        First frame's cloud, camera frame [m].
    resting : RestingPrior
        Table, support and declared point.
    tip_m : (3,) array
        Centre of the sphere when the force begins, camera frame [m].
    limits : AlignmentLimits
    largest_distance_m : float
        dr of Eq. 4.24.
    indenter_radius_m : float

    Raises
    ------
    ValueError
        With what was measured and its limit, for the first of the limits that does not hold.
    """
    pose = alignment.camera_from_object
    closest = ClosestPoints(template.vertices_m, template.faces)
    near = (closest.distance(to_object(pose, cloud_m)) < largest_distance_m).mean()
    if near < limits.least_near:
        expected = f"at least {limits.least_near:.0%} of its points within"
        where = f"{largest_distance_m * MILLIMETRES:g} mm of the template"
        why = "template, its unit, the point, transforms or optics?"
        raise ValueError(f"cloud: expected {expected} {where}, found {near:.0%} ({why})")
    _at_most("residual", alignment.residual.rms_m, limits.largest_rms_m, "rms from the template")
    _require_resting(pose, template, resting, limits)
    touch = np.linalg.norm(alignment.contact_point_m - resting.point_m)
    _at_most("points", touch, limits.largest_touch_m, "from the declared point to the contact")
    gap = closest.signed_distance(to_object(pose, tip_m[None]))[0] - indenter_radius_m
    part = PERCENT * abs(gap) / float(np.linalg.norm(tip_m))
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


def require_template(template: Template) -> None:
    """Refuse a template with vertices that are nowhere or triangles without a normal.

    Raises
    ------
    ValueError
    """
    if not np.isfinite(template.vertices_m).all():
        raise ValueError("template: expected finite vertices, found some that are not")
    corners = template.vertices_m[template.faces]
    edges = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    flat = area <= FLATTEST * (edges**2).sum(axis=2).max(axis=1)
    if flat.any():
        raise ValueError(f"template: expected triangles of some area, found {flat.sum()} of none")


def require_cloud(points_m: NDArray, *, frame: int) -> None:
    """Refuse a frame's cloud of too few points, or of some that are nowhere.

    Raises
    ------
    ValueError
    """
    if len(points_m) < FEWEST_POINTS:
        expected = f"expected at least {FEWEST_POINTS} points"
        raise ValueError(f"frame {frame}: cloud: {expected}, found {len(points_m)}")
    if not np.isfinite(points_m).all():
        raise ValueError(f"frame {frame}: cloud: expected finite points, found some that are not")


def require_contact(
    alignment: Alignment, template: Template, tips_m: NDArray, *, largest_gap_m: float
) -> None:
    """Refuse tips that never come near the aligned template, or a contact in no frame.

    Parameters
    ----------
    alignment : Alignment
    template : Template
    tips_m : (f, 3) array
        Centre of the sphere in each frame, camera frame [m].
    largest_gap_m : float
        From its centre to the template.

    Raises
    ------
    ValueError
    """
    if not 0 <= alignment.contact_frame < len(tips_m):
        last, found = len(tips_m) - 1, alignment.contact_frame
        raise ValueError(f"contact_frame: expected 0 to {last}, found {found}")
    closest = ClosestPoints(template.vertices_m, template.faces)
    away = float(closest.distance(alignment.contact_point_m[None])[0])
    if away > largest_gap_m:
        expected = f"within {largest_gap_m * MILLIMETRES:.1f} mm of the template"
        raise ValueError(f"contact_point_m: expected {expected}, found {away * MILLIMETRES:.1f} mm")
    nearest = closest.distance(to_object(alignment.camera_from_object, tips_m)).min()
    if nearest > largest_gap_m:
        expected = f"within {largest_gap_m * MILLIMETRES:.1f} mm of the template in some frame"
        raise ValueError(f"tip: expected {expected}, found {nearest * MILLIMETRES:.1f} mm")
