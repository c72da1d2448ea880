"""What must hold before a capture is aligned and tracked."""

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template
from palpate.units import MILLIMETRES

# A plane through so many neighbours gives a normal, and so many points a pose.
FEWEST_POINTS = 30
# Triangles thinner than this, height over longest edge, have no normal in single precision.
FLATTEST = 1e-5


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
