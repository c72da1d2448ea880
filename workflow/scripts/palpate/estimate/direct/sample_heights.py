"""How high the samples of an undeformed surface stand in each frame."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import ClosestAtRest, RestSurface, Samples
from palpate.estimate.hertz.indentation import FROM_MEDIAN
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object

# A sample with fewer points in a frame was not seen there.
FEWEST_POINTS = 2
# Points of a sample farther from its median than so many deviations, and what a pressed surface may
# slope in it, are left out.
CLIP, SLOPE = 3.0, 0.05


def frame_closest(
    surface: RestSurface,
    alignment: Alignment,
    cloud: tuple[NDArray, NDArray],
    options: Observation,
) -> ClosestAtRest:
    """Feet of a frame's points within reach of the contact.

    Parameters
    ----------
    surface : RestSurface
    alignment : Alignment
    cloud : (points (n, 3) [m], normals (n, 3))
        Camera frame.
    options : Observation
    """
    pose = alignment.camera_from_object
    points, normals = to_object(pose, cloud[0]), cloud[1] @ pose[:3, :3]
    offset = np.linalg.norm(points - alignment.contact_point_m, axis=1)
    near = offset < options.reach_m + options.largest_distance_m
    closest = surface.at_rest(
        points[near],
        normals[near],
        largest_distance_m=options.largest_distance_m,
        largest_normal_deg=options.largest_normal_deg,
    )
    inside = np.linalg.norm(closest.closest_m - alignment.contact_point_m, axis=1) < options.reach_m
    return ClosestAtRest(
        closest.closest_m[inside], closest.normal[inside], closest.distance_m[inside]
    )


def cell_heights(
    samples: Samples, closest: Iterable[ClosestAtRest], options: Observation
) -> tuple[NDArray, NDArray]:
    """Clipped mean distance of each frame's points in each sample [m], and their number, (f, c).

    Of a frame the points' samples and distances are kept, no more.
    """
    numbers, distances = [], []
    for one in closest:
        number = samples.numbers(one, reach_m=options.spacing_m)
        numbers.append(number[number >= 0].astype(np.int32))
        distances.append(one.distance_m[number >= 0])
    count, pairs = len(samples.cell_m), list(zip(numbers, distances, strict=True))
    middle = np.array([_medians(*pair, count) for pair in pairs])
    rest = [np.abs(far - m[n]) for (n, far), m in zip(pairs, middle, strict=True)]
    limit = CLIP * FROM_MEDIAN * np.median(np.concatenate(rest)) + SLOPE * options.spacing_m
    height, points = np.full(middle.shape, np.nan), np.zeros(middle.shape, dtype=np.int64)
    for k, (number, far) in enumerate(pairs):
        kept = rest[k] <= limit
        points[k] = np.bincount(number[kept], minlength=count)
        sums = np.bincount(number[kept], far[kept], count)
        seen = points[k] >= FEWEST_POINTS
        height[k, seen] = sums[seen] / points[k, seen]
    return height, points


def _medians(numbers: NDArray, values: NDArray, count: int) -> NDArray:
    """Median of the values in each sample (c,); not a number where there are none."""
    sorted_values = values[np.lexsort((values, numbers))]
    size = np.bincount(numbers, minlength=count)
    first = np.cumsum(size) - size
    last = max(len(sorted_values) - 1, 0)
    low, high = (np.minimum(first + half, last) for half in ((size - 1) // 2, size // 2))
    found = (sorted_values[low] + sorted_values[high]) / 2 if len(sorted_values) else 0.0
    return np.where(size > 0, found, np.nan)
