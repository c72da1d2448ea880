"""Mirrors of a surface that is its own image, so that a pressed point serves its images too."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.open3d_core import o3d
from palpate.solid.quality import scene_of

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


def mirrors_of(
    vertices_m: NDArray, faces: NDArray, support_normal: NDArray, *, tolerance_m: float
) -> list[Mirror]:
    """Planes along the coordinate axes, across the support, in which a surface is its own image.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Closed surface [m].
    support_normal : (3,) array
        A mirror's normal lies across it.
    tolerance_m : float
        How far the image's vertices and middles of facets may be from the surface [m].
    """
    centre = (vertices_m.min(axis=0) + vertices_m.max(axis=0)) / 2
    found = []
    for normal in np.eye(3):
        mirror = Mirror(centre, normal)
        level = abs(normal @ support_normal) < 1e-6 * np.linalg.norm(support_normal)
        if level and _gap(mirror, vertices_m, faces) <= tolerance_m:
            found.append(mirror)
    return found


def images_of_points(
    points_m: Mapping[str, NDArray], mirrors: list[Mirror], *, tolerance_m: float
) -> dict[str, tuple[str, tuple[Mirror, ...]]]:
    """For each point the first that it is an image of, and the mirrors that take that one to it.

    Parameters
    ----------
    points_m : mapping
        Places (3,) by name [m].
    mirrors : list of Mirror
        At right angles to each other.
    tolerance_m : float
        How far an image may be from its point [m].

    Returns
    -------
    dict
        A point that is its own first has no mirrors.
    """
    chains = [()]
    for mirror in mirrors:
        chains += [(*chain, mirror) for chain in chains]
    found = {}
    for name in sorted(points_m):
        place = np.asarray(points_m[name], dtype=float)
        found[name] = next(
            (other, chain)
            for other in sorted(points_m)
            for chain in chains
            if np.linalg.norm(_through(chain, points_m[other]) - place) <= tolerance_m
        )
    return found


def _through(chain: tuple[Mirror, ...], point_m: NDArray) -> NDArray:
    point = np.asarray(point_m, dtype=float)
    for mirror in chain:
        point = mirror.image(point)
    return point


def _gap(mirror: Mirror, vertices_m: NDArray, faces: NDArray) -> float:
    """Largest distance of the image's vertices and facets' middles from the surface [m]."""
    places = np.matmul(POINTS, vertices_m[faces]).reshape(-1, 3)
    scene = scene_of(vertices_m - mirror.point_m, faces)
    query = o3d.core.Tensor((mirror.image(places) - mirror.point_m).astype(np.float32))
    return float(scene.compute_distance(query, nthreads=1).numpy().max())
