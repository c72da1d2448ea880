"""Samples of an undeformed surface, and the points that are seen on them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import at_nodes
from palpate.solid.smooth_surface import corner_normals
from palpate.surface.template import Template

# Points off a crease have no foot of their own: their way from the foot is not along its normal.
SHARP_COSINE, SHARP_EDGE_M = 0.87, 0.0005
# A sample's points have normals like its own.
ALIKE_COSINE = 0.8


@dataclass(frozen=True)
class ClosestAtRest:
    """Points on the undeformed surface, k of them.

    Attributes
    ----------
    closest_m, normal : (k, 3) arrays
        Closest places of the surface [m] and unit normals there, of the smooth surface that its
        facets stand for.
    distance_m : (k,) array
        Of the points from there along the normal, positive outside [m].
    """

    closest_m: NDArray
    normal: NDArray
    distance_m: NDArray


@dataclass(frozen=True)
class Samples:
    """Places of the undeformed surface, c of them.

    Attributes
    ----------
    cell_m, normal : (c, 3) arrays
        Object frame [m], unit normals outward.
    """

    cell_m: NDArray
    normal: NDArray

    def numbers(self, closest: ClosestAtRest, *, reach_m: float) -> NDArray:
        """Cell of each foot (k,); -1 where none within reach faces the same way."""
        distance, number = cKDTree(self.cell_m).query(closest.closest_m)
        alike = (self.normal[number] * closest.normal).sum(axis=1) > ALIKE_COSINE
        return np.where(alike & (distance < reach_m), number, -1)


class RestSurface:
    """The undeformed template, to find the feet of points on it.

    Parameters
    ----------
    template : Template
    """

    def __init__(self, template: Template) -> None:
        self.closest = ClosestPoints(template.vertices_m, template.faces)
        # A ball's facets are turned by degrees against it: a motion along their normals would be
        # wrong by as much of what the object sinks.
        self.corner_normal = corner_normals(template.vertices_m, template.faces)

    def at_rest(
        self,
        points_m: NDArray,
        normals: NDArray,
        *,
        largest_distance_m: float,
        largest_normal_deg: float,
    ) -> ClosestAtRest:
        """Feet of the points that belong to the surface.

        Parameters
        ----------
        points_m, normals : (n, 3) arrays
            Object frame [m].
        largest_distance_m, largest_normal_deg : float
            Points farther away, or turned more against the surface, are left out.
        """
        foot, triangle, weights = self.closest(points_m)
        normal = np.einsum("nk,nka->na", weights, self.corner_normal[triangle])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        gap = points_m - foot
        along, length = (gap * normal).sum(axis=1), np.linalg.norm(gap, axis=1)
        kept = length < largest_distance_m
        kept &= (normal * normals).sum(axis=1) > np.cos(np.deg2rad(largest_normal_deg))
        kept &= (np.abs(along) > SHARP_COSINE * length) | (length < SHARP_EDGE_M)
        return ClosestAtRest(foot[kept], normal[kept], np.copysign(length, along)[kept])


def samples_of(closest: Sequence[ClosestAtRest], centre_m: NDArray, *, spacing_m: float) -> Samples:
    """Samples where points were seen, at the means of their feet.

    Seeds are taken from the first frame, the nearest to a centre first, each at least a spacing
    from the others; every foot belongs to the nearest of them.

    Parameters
    ----------
    closest : sequence of ClosestAtRest
        Of frames.
    centre_m : (3,) array
        Object frame [m].
    spacing_m : float
    """
    seeds = _seeds(closest[0], centre_m, spacing_m)
    every = ClosestAtRest(
        *(
            np.concatenate([getattr(one, name) for one in closest])
            for name in ClosestAtRest.__annotations__
        )
    )
    number = seeds.numbers(every, reach_m=spacing_m)
    kept, count = number >= 0, len(seeds.cell_m)
    places, normals = (
        at_nodes(number[kept], part[kept], count) for part in (every.closest_m, every.normal)
    )
    points = np.bincount(number[kept], minlength=count)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Samples(places / points[:, None], normals / length)


def _seeds(closest: ClosestAtRest, centre_m: NDArray, spacing_m: float) -> Samples:
    order = np.argsort(np.linalg.norm(closest.closest_m - centre_m, axis=1), kind="stable")
    places = closest.closest_m[order]
    tree, free, chosen = cKDTree(places), np.ones(len(places), dtype=bool), []
    for k, place in enumerate(places):
        if free[k]:
            chosen.append(k)
            free[tree.query_ball_point(place, spacing_m)] = False
    return Samples(places[chosen], closest.normal[order][chosen])
