"""Where on an object its indentation table lies: under the sphere, not where it was declared."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.solid.indentation import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.pose import to_camera

# The surface moves most within so many of the sphere's radii around the contact, and is to go on
# alike so far; scans and their meshes agree to about the second [m].
REACH_RADII, ALIKE_M = 4.0, 0.0005
# Where it does not, a table so far from the contact still tells its force and motion [m].
NEAREST_M = 0.002
# Beyond this not even the same part of an object is pressed [m].
FARTHEST_M = 0.015


def object_from_table(
    table: IndentationModel, surface: SmoothSurface, centre_m: NDArray
) -> NDArray:
    """Rigid motion that brings a table's first touch to that of a press, (4, 4).

    Along the surface and with its normal, as far as the surface lies on itself then: a flat face
    is pressed alike everywhere that is far from its edges, and a ball all around.

    Parameters
    ----------
    table : IndentationModel
    surface : SmoothSurface
        Undeformed template, object frame.
    centre_m : (3,) array
        Of the sphere when it first touched, object frame [m].

    Returns
    -------
    (4, 4) array
        The unit matrix where the surface does not allow it, and the contact is near enough.

    Raises
    ------
    ValueError
        If the surface does not allow it, and the contact is not.
    """
    start = table.point_m - table.radius_m * table.direction
    way = centre_m - start
    away = float(np.linalg.norm(way - (way @ table.direction) * table.direction))
    moved = _moved(surface, start, centre_m)
    if away <= FARTHEST_M and _lies_on_itself(moved, table, surface):
        return moved
    if away > NEAREST_M:
        point = np.round(surface.nearest(centre_m[None])[0], 4).tolist()
        raise ValueError(
            f"contact: expected within {NEAREST_M * 1e3:g} mm of the declared point, beside which"
            f" the surface is another, found {away * 1e3:.1f} mm away (a point of its own, with"
            f" position_m {point}?)"
        )
    return np.eye(4)


def _moved(surface: SmoothSurface, start_m: NDArray, centre_m: NDArray) -> NDArray:
    """Turn the one place's normal into the other's, and put the one there, (4, 4)."""
    centres = np.stack([start_m, centre_m])
    normals = centres - surface.nearest(centres)
    turn, _ = Rotation.align_vectors(normals[1:], normals[:1])
    found = np.eye(4)
    found[:3, :3] = turn.as_matrix()
    found[:3, 3] = centre_m - found[:3, :3] @ start_m
    return found


def _lies_on_itself(moved: NDArray, table: IndentationModel, surface: SmoothSurface) -> bool:
    rest = table.surface_rest_m
    apart = np.linalg.norm(rest - table.point_m, axis=1)
    near = rest[apart < REACH_RADII * table.radius_m]
    gap = surface.distance(to_camera(moved, near)) - surface.distance(near)
    return bool(gap.max() < ALIKE_M)
