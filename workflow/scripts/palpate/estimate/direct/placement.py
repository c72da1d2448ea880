"""Where on an object its indentation table lies: under the sphere, not where it was declared."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.estimate.direct.support_motion import rocking_axes
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.pose import to_camera

# The surface moves most within so many of the sphere's radii around the contact, and is to go on
# alike so far; scans and their meshes agree to about the second [m].
REACH_RADII, ALIKE_M = 4.0, 0.0005
# Where it does not, a table so far from the contact still tells its force and motion [m].
NEAREST_M = 0.002
# Gauss and Newton's steps of the turn.
TURNS = 6
# Beyond this not even the same part of an object is pressed [m].
FARTHEST_M = 0.015


def object_from_table(
    table: IndentationModel, surface: SmoothSurface, centre_m: NDArray
) -> NDArray:
    """Rigid motion that brings a table's first touch to that of a press, (4, 4).

    Along the surface and turned with it, as far as the surface lies on itself then: a flat face is
    pressed alike everywhere that is far from its edges, and a ball all around.

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
    apart = np.linalg.norm(table.surface_rest_m - table.point_m, axis=1)
    near = table.surface_rest_m[apart < REACH_RADII * table.radius_m]
    if away <= FARTHEST_M:
        moved = _moved(surface, near, way, centre_m, table.direction)
        gap = surface.distance(to_camera(moved, near)) - surface.distance(near)
        if gap.max() < ALIKE_M:
            return moved
    if away > NEAREST_M:
        point = np.round(surface.nearest(centre_m[None])[0], 4).tolist()
        raise ValueError(
            f"contact: expected within {NEAREST_M * 1e3:g} mm of the declared point, beside which"
            f" the surface is another, found {away * 1e3:.1f} mm away (a point of its own, with"
            f" position_m {point}?)"
        )
    return np.eye(4)


def _moved(
    surface: SmoothSurface, near_m: NDArray, way_m: NDArray, centre_m: NDArray, direction: NDArray
) -> NDArray:
    """Bring the near surface (k, 3) there, turned to lie on the surface as well as it can, (4, 4).

    Normals at the two places would not do: a facet's are off by half of what it meets the next
    with, and a turn by 5 degrees lifts what is four radii away by 2 mm.
    """
    axes = rocking_axes(direction)
    found = np.eye(4)
    found[:3, 3] = way_m
    for _ in range(TURNS):
        at = to_camera(found, near_m)
        normals = surface.normals(at)
        gap = ((at - surface.nearest(at)) * normals).sum(axis=1)
        tilts = [(np.cross(axis, at - centre_m) * normals).sum(axis=1) for axis in axes]
        slopes = np.column_stack([*tilts, normals @ direction])
        *tilt, along = -np.linalg.lstsq(slopes, gap, rcond=None)[0]
        turn = Rotation.from_rotvec(tilt @ axes).as_matrix()
        found[:3] = turn @ found[:3]
        found[:3, 3] += centre_m - turn @ centre_m + along * direction
    return found
