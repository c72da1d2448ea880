"""Samples of an undeformed surface: the points on them, how high these stand, and what hides them.

A window that holds probe and surface finds neither, and what only one of a stereo head's cameras
sees, or the projector does not light, is filled in from its surroundings.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.estimate.direct.options import Observation
from palpate.open3d_core import ClosestPoints
from palpate.solid.mesh import at_nodes
from palpate.solid.smooth_surface import corner_normals
from palpate.surface.template import Template
from palpate.units import FROM_MEDIAN

# Points off a crease have no place of their own: the cosine of their way to its normal is less,
SHARP_COSINE = 0.87
# unless they are so near that their way has no direction [m].
SHARP_EDGE_M = 0.0005
# A sample's points have normals like its own.
ALIKE_COSINE = 0.8
# With fewer points in a frame a sample was not seen there.
FEWEST_POINTS = 2
# Points of a sample farther from its median than so many deviations are left out.
CLIP = 3.0
# Slope of an indented surface: what it adds to that limit within a sample.
SLOPE = 0.05
# Length of a probe above its tip, and where on it the handle begins [m].
SHAFT_M, SHAFT_FROM_M = 0.25, 0.05


@dataclass(frozen=True)
class Samples:
    """Places of the undeformed surface, c of them.

    Attributes
    ----------
    cell_m, normal : (c, 3) arrays
        Object frame [m], unit normals outward of the smooth surface.
    """

    cell_m: NDArray
    normal: NDArray

    def at(self, chosen: NDArray) -> Self:
        """Those that are chosen, by a mask or by numbers."""
        return type(self)(*(part[chosen] for part in vars(self).values()))

    def numbers(self, closest: "ClosestAtRest", *, reach_m: float) -> NDArray:
        """Sample of each closest place (k,); -1 where none within reach faces the same way."""
        distance, number = cKDTree(self.cell_m).query(closest.cell_m)
        alike = (self.normal[number] * closest.normal).sum(axis=1) > ALIKE_COSINE
        return np.where(alike & (distance < reach_m), number, -1)


@dataclass(frozen=True)
class ClosestAtRest(Samples):
    """Closest places of points, and how far along the normals these are, positive outside [m]."""

    distance_m: NDArray


class RestSurface:
    """The undeformed template, to find the closest places of points on it."""

    def __init__(self, template: Template) -> None:
        self.closest = ClosestPoints(template.vertices_m, template.faces)
        # A ball's facets are turned by degrees against it: a motion along their normals would be
        # wrong by as much of what the object sinks.
        self.corner_normal = corner_normals(template.vertices_m, template.faces)

    def at_rest(self, points_m: NDArray, normals: NDArray, options: Observation) -> ClosestAtRest:
        """Closest places of the points that belong to the surface.

        Of points and normals (n, 3), object frame [m]: farther away than `largest_distance_m`, or
        turned more against the surface than `largest_normal_deg`, they are left out.
        """
        place, triangle, weights = self.closest(points_m)
        normal = np.einsum("nk,nka->na", weights, self.corner_normal[triangle])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        gap = points_m - place
        along, length = (gap * normal).sum(axis=1), np.linalg.norm(gap, axis=1)
        kept = length < options.largest_distance_m
        kept &= (normal * normals).sum(axis=1) > np.cos(np.deg2rad(options.largest_normal_deg))
        kept &= (np.abs(along) > SHARP_COSINE * length) | (length < SHARP_EDGE_M)
        return ClosestAtRest(place, normal, np.copysign(length, along)).at(kept)


def samples_of(closest: Sequence[ClosestAtRest], centre_m: NDArray, *, spacing_m: float) -> Samples:
    """Samples where points were seen, at the means of their closest places.

    Seeds are taken from the first frame, the nearest to a centre (3,) in the object frame [m]
    first, each at least a spacing [m] from the others; every place of all frames belongs to the
    nearest of them.
    """
    seeds = _seeds(closest[0], centre_m, spacing_m)
    each = zip(*(vars(one).values() for one in closest), strict=True)
    every = ClosestAtRest(*map(np.concatenate, each))
    number = seeds.numbers(every, reach_m=spacing_m)
    kept, count = number >= 0, len(seeds.cell_m)
    places, normals = (
        at_nodes(number[kept], part[kept], count) for part in (every.cell_m, every.normal)
    )
    points = np.bincount(number[kept], minlength=count)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return Samples(places / points[:, None], normals / length)


def _seeds(closest: ClosestAtRest, centre_m: NDArray, spacing_m: float) -> Samples:
    order = np.argsort(np.linalg.norm(closest.cell_m - centre_m, axis=1), kind="stable")
    places = closest.cell_m[order]
    tree, free, chosen = cKDTree(places), np.ones(len(places), dtype=bool), []
    for k, place in enumerate(places):
        if free[k]:
            chosen.append(k)
            free[tree.query_ball_point(place, spacing_m)] = False
    return Samples(places, closest.normal[order]).at(np.array(chosen))


def cell_heights(
    samples: Samples, closest: Iterable[ClosestAtRest], options: Observation
) -> tuple[NDArray, NDArray]:
    """Clipped mean distance of each frame's points in each sample [m], and their number, (f, c).

    Of a frame the points' samples and distances are kept, no more.
    """
    count, cells, distances = len(samples.cell_m), [], []
    for frame, one in enumerate(closest):
        number = samples.numbers(one, reach_m=options.spacing_m)
        cells.append(frame * count + number[number >= 0])
        distances.append(one.distance_m[number >= 0])
    shape, cell, far = (len(cells), count), np.concatenate(cells), np.concatenate(distances)
    off = np.abs(far - pd.Series(far).groupby(cell).transform("median").to_numpy())
    limit = CLIP * FROM_MEDIAN * np.median(off) + SLOPE * options.spacing_m
    cell, far = cell[off <= limit], far[off <= limit]
    points, sums = (np.bincount(cell, of, np.prod(shape)).reshape(shape) for of in (None, far))
    height = np.full(shape, np.nan)
    return np.divide(sums, points, out=height, where=points >= FEWEST_POINTS), points


@dataclass(frozen=True)
class ProbeInView:
    """Where the probe is and from where the surface must be seen past it, object frame.

    Attributes
    ----------
    views_m : (e, 3) array
        Cameras, and the projector of one that projects [m].
    tip_m, axis : (f, 3) arrays
        Centre of the sphere [m] and indentation direction in each frame.
    """

    views_m: NDArray
    tip_m: NDArray
    axis: NDArray

    def clearance(self, places_m: NDArray, frame: int, *, along_m: tuple[float, float]) -> NDArray:
        """Least distance of lines of sight to places (c, 3) from a part of the axis, (c,) [m].

        The part goes from the tip upwards, `along_m` (low, high).
        """
        axis = -self.axis[frame] / np.linalg.norm(self.axis[frame])
        ends = self.tip_m[frame] + np.outer(along_m, axis)
        each = [segment_distance(places_m, view, *ends) for view in self.views_m]
        return np.min(each, axis=0)

    def hides(self, places_m: NDArray, options: Observation) -> NDArray:
        """Which places (c, 3) the probe hides or comes too near in each frame, (f, c)."""
        hidden = np.ones((len(self.tip_m), len(places_m)), dtype=bool)
        for k, one in enumerate(hidden):
            tip = self.clearance(places_m, k, along_m=(0.0, SHAFT_FROM_M))
            shaft = self.clearance(places_m, k, along_m=(SHAFT_FROM_M, SHAFT_M))
            # A probe that was not found is nowhere clear.
            one[(tip >= options.clear_m) & (shaft >= options.shaft_clear_m)] = False
        return hidden


def segment_distance(starts: NDArray, end: NDArray, first: NDArray, last: NDArray) -> NDArray:
    """Least distances of segments from `starts` (c, 3) to `end` from another segment, (c,) [m]."""
    d1, d2, r = end - starts, last - first, starts - first
    a, b, c = (d1 * d1).sum(axis=1), d1 @ d2, (d1 * r).sum(axis=1)
    e, f = d2 @ d2, r @ d2
    across = np.maximum(a * e - b * b, 1e-12 * a * e)
    s = np.clip((b * f - c * e) / across, 0, 1)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    gap = r + s[:, None] * d1 - t[:, None] * d2
    return np.linalg.norm(gap, axis=1)


def facing_samples(samples: Samples, probe: ProbeInView, options: Observation) -> Samples:
    """Samples that are not seen too much from the side from anywhere; a `ValueError` if none is."""
    least = np.cos(np.deg2rad(options.largest_view_deg))
    sight = probe.views_m[:, None] - samples.cell_m
    facing = (sight * samples.normal).sum(axis=2) > least * np.linalg.norm(sight, axis=2)
    if not (kept := facing.all(axis=0)).any():
        expected = (
            f"some surface seen at less than {options.largest_view_deg:g} degrees to its normal"
        )
        raise ValueError(
            f"clouds: expected {expected} at the contact, found none (move the camera)"
        )
    return samples.at(kept)
