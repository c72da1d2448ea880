"""Points that the study adds to a captured cloud (Sections 5.2.1 and 5.2.2)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

# In Hertz's contact the sphere touches below half of its indentation.
TOUCHING_PART = 0.5
SPACING_M = 0.001
PARTS = ("none", "places", "cap", "hemisphere")


def indenter_points(
    tip_m: NDArray, up: NDArray, *, radius_m: float, depth_m: float, part: str = "cap"
) -> tuple[NDArray, NDArray]:
    """Points of the sphere where it touches the object.

    The study adds a hemisphere; of it the cap is what Hertz's contact touches: the rest draws the
    surface up along the sphere's sides.

    Parameters
    ----------
    tip_m : (3,) array
        Centre of the sphere [m].
    up : (3,) array
        Unit normal of the undeformed surface at the contact.
    radius_m, depth_m : float
        Radius of the sphere and depth of its lowest point below the undeformed surface [m].
    part : {"cap", "hemisphere", "none", "places"}, optional
        None for the last two: `pressed_places` gives the places.

    Returns
    -------
    points_m, normals : (n, 3) arrays
        None before contact. The normals are the object's, into the sphere.

    Raises
    ------
    ValueError
        If the part is unknown.
    """
    if part not in PARTS:
        raise ValueError(f"indenter_points: expected one of {', '.join(PARTS)}, found {part}")
    if part in ("none", "places") or depth_m <= 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    directions = _sphere(radius_m)
    below_surface = depth_m - radius_m * (1 + directions @ up)
    touching = (below_surface > TOUCHING_PART * depth_m) | (part == "hemisphere")
    kept = directions[touching & (directions @ up < 0)]
    return tip_m + radius_m * kept, -kept


def pressed_places(
    vertices_m: NDArray, tip_m: NDArray, up: NDArray, *, radius_m: float, depth_m: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Places on the sphere of the vertices that it pushes straight down.

    Where a sphere presses a soft surface the surface hardly moves sideways, so that these places
    hold vertices in all directions, which points of the sphere cannot.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Undeformed template [m].
    tip_m, up, radius_m, depth_m
        As of `indenter_points`.

    Returns
    -------
    vertices : (k,) int array
        Those that Hertz's contact touches; none before contact.
    points_m, normals : (k, 3) arrays
    """
    offset = vertices_m - tip_m
    height = offset @ up
    aside = ((offset - height[:, None] * up) ** 2).sum(axis=1)
    under = height + np.sqrt(np.maximum(radius_m**2 - aside, 0))
    touched = (aside < radius_m**2) & (np.abs(height) < 2 * radius_m)
    touched &= (under > TOUCHING_PART * depth_m) & (depth_m > 0)
    chosen = np.flatnonzero(touched)
    points = vertices_m[chosen] - under[chosen, None] * up
    return chosen, points, (tip_m - points) / radius_m


def undeformed_points(
    vertices_m: NDArray, cloud_m: NDArray, contact_m: NDArray, *, reach_m: float
) -> NDArray:
    """Template vertices that no camera sees and that lie far from the contact.

    Parameters
    ----------
    vertices_m : (n, 3) array
        The rigidly aligned template [m], camera frame.
    cloud_m : (k, 3) array
        First frame's cloud [m].
    contact_m : (3,) array
        Contact point [m].
    reach_m : float
        Vertices nearer than this to the contact or to the cloud are left out [m]; for the cloud
        a quarter of it counts.

    Returns
    -------
    (k,) int array
    """
    far = np.linalg.norm(vertices_m - contact_m, axis=1) > reach_m
    unseen = cKDTree(cloud_m).query(vertices_m)[0] > reach_m / 4
    return np.flatnonzero(far & unseen)


def turned_copies(
    points_m: NDArray, normals: NDArray, *, centre_m: NDArray, axis: NDArray, copies: int
) -> tuple[NDArray, NDArray]:
    """The cloud's further copies about an axis, as by the study's hexagon (Section 5.2.2).

    Parameters
    ----------
    points_m, normals : (n, 3) arrays
        The cloud [m].
    centre_m, axis : (3,) arrays
        Point of the axis [m] and its direction, of any length.
    copies : int
        How many there are with the cloud itself, evenly spread over the full turn.

    Returns
    -------
    points_m, normals : ((copies - 1) n, 3) arrays

    Raises
    ------
    ValueError
        If there is no copy.
    """
    if copies < 1:
        raise ValueError(f"copies: expected at least 1, found {copies}")
    unit = np.asarray(axis) / np.linalg.norm(axis)
    turns = [Rotation.from_rotvec(2 * np.pi * k / copies * unit) for k in range(1, copies)]
    none = [np.zeros((0, 3))]
    points = [centre_m + turn.apply(points_m - centre_m) for turn in turns]
    return np.concatenate(points + none), np.concatenate(
        [turn.apply(normals) for turn in turns] + none
    )


def _sphere(radius_m: float) -> NDArray:
    """Directions spread evenly over a sphere (golden-angle spiral), about one every millimetre."""
    count = int(4 * np.pi * radius_m**2 / SPACING_M**2)
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = k * np.pi * (1 + np.sqrt(5))
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
