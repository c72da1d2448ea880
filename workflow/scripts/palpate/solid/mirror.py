"""Mirrors of a surface that is its own image, so that a pressed point serves its images too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import ClosestPoints

# Points of a facet that are compared, barycentric.
POINTS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1 / 3, 1 / 3, 1 / 3]])


@dataclass(frozen=True)
class Mirror:
    """A plane.

    Attributes
    ----------
    point_m : (3,) array
        Of the plane [m].
    normal : (3,) array
        Of length 1.
    """

    point_m: NDArray
    normal: NDArray

    def image(self, points_m: NDArray) -> NDArray:
        """Mirror images of points (..., 3) [m]."""
        away = (points_m - self.point_m) @ self.normal
        return points_m - 2 * away[..., None] * self.normal


def require_image(
    mirror: Mirror, vertices_m: NDArray, faces: NDArray, *, tolerance_m: float
) -> None:
    """Refuse a mirror in which a surface is not its own image.

    Parameters
    ----------
    mirror : Mirror
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface [m].
    tolerance_m : float
        How far the image's vertices and middles of facets may be from the surface [m].

    Raises
    ------
    ValueError
        If they are farther.
    """
    places = mirror.image(np.matmul(POINTS, vertices_m[faces]).reshape(-1, 3))
    gap = ClosestPoints(vertices_m, faces).distance(places).max()
    if not gap <= tolerance_m:
        raise ValueError(
            f"mirrors: expected planes in which the template is its own image within"
            f" {tolerance_m:g} m, found {mirror.normal.tolist()} with {gap:.2g} m"
        )
