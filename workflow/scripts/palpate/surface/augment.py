"""Points that the study adds to a captured cloud (Section 5.2.1)."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

# In Hertz's contact the sphere touches below half of its indentation.
TOUCHING_PART = 0.5
SPACING_M = 0.001


def indenter_points(
    tip_m: NDArray, up: NDArray, *, radius_m: float, depth_m: float
) -> tuple[NDArray, NDArray]:
    """Points of the sphere where it touches the object.

    The study adds a hemisphere; of it only the cap that Hertz's contact touches is kept, since
    the rest would draw the surface up along the sphere's sides.

    Parameters
    ----------
    tip_m : (3,) array
        Centre of the sphere [m].
    up : (3,) array
        Unit normal of the undeformed surface at the contact.
    radius_m, depth_m : float
        Radius of the sphere and depth of its lowest point below the undeformed surface [m].

    Returns
    -------
    points_m, normals : (n, 3) arrays
        None before contact. The normals are the object's, into the sphere.
    """
    if depth_m <= 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    directions = _sphere(radius_m)
    below_surface = depth_m - radius_m * (1 + directions @ up)
    kept = directions[(below_surface > TOUCHING_PART * depth_m) & (directions @ up < 0)]
    return tip_m + radius_m * kept, -kept


def undeformed_points(
    vertices_m: NDArray, normals: NDArray, cloud_m: NDArray, contact_m: NDArray, *, reach_m: float
) -> tuple[NDArray, NDArray]:
    """Template vertices that no camera sees and that lie far from the contact.

    Parameters
    ----------
    vertices_m, normals : (n, 3) arrays
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
    points_m, normals : (m, 3) arrays
    """
    far = np.linalg.norm(vertices_m - contact_m, axis=1) > reach_m
    unseen = cKDTree(cloud_m).query(vertices_m)[0] > reach_m / 4
    return vertices_m[far & unseen], normals[far & unseen]


def _sphere(radius_m: float) -> NDArray:
    """Directions spread evenly over a sphere (golden-angle spiral), about one every millimetre."""
    count = int(4 * np.pi * radius_m**2 / SPACING_M**2)
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = k * np.pi * (1 + np.sqrt(5))
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(angle), ring * np.sin(angle), z])
