"""Corners and views of a board that do not go with the others."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.vision.bundle import Bundle, Sight

# A corner is an outlier beyond this many standard deviations of a coordinate: of 100,000 good
# ones 4 are. A view, beyond this many times the root mean square of all.
CORNER_FACTOR, VIEW_FACTOR = 4.5, 3.0
# A view that loses more of its corners than this is an outlier itself.
LARGEST_SHARE_LOST = 0.4
# Of corners with normal errors: the median distance over the standard deviation of a coordinate.
MEDIAN_DISTANCE = np.sqrt(2 * np.log(2))
# Below this, corners are exact: rounding, and the noise of no picture.
LEAST_SIGMA_PX = 1e-4
# Coordinates less unknowns over coordinates: fewer would be no measure of anything.
LEAST_SPARE = 0.1
FEWEST_CORNERS = 8
# Part of the picture's diagonal by which a corner of another view is elsewhere: a board that tilts
# in place moves its outer corners by a few pixels, a still one none by half a pixel.
SAME_VIEW_SHARE = 0.001


def scatter(kept: Bundle, found_px: Sequence[NDArray]) -> tuple[float, ...]:
    """Standard deviation of a corner's coordinate by camera, whatever a few outliers are [px].

    Parameters
    ----------
    kept : Bundle
        With the corners that count.
    found_px : sequence of (n,) arrays
        Distances of found and projected corners, by sight.
    """
    counted = [far[sight.seen] for far, sight in zip(found_px, kept.sights, strict=True)]
    coordinates = 2 * sum(map(len, counted))
    spare = max(1 - len(kept.free) / coordinates, LEAST_SPARE)
    sigma = []
    for camera in range(len(kept.sigma_px)):
        own = [
            far for far, sight in zip(counted, kept.sights, strict=True) if sight.camera == camera
        ]
        median = float(np.median(np.concatenate(own)))
        sigma.append(max(median / MEDIAN_DISTANCE / np.sqrt(spare), LEAST_SIGMA_PX))
    return tuple(sigma)


def distances(off_px: Sequence[NDArray]) -> list[NDArray]:
    """Lengths of residuals (n, 2) of each sight [px]."""
    return [np.hypot(*off.T) for off in off_px]


def without_outliers(
    sights: Sequence[Sight], found_px: Sequence[NDArray], sigma_px: Sequence[float]
) -> tuple[Sight, ...]:
    """Sights without the corners that are too far from where they are projected.

    One that would lose most of its corners keeps them all: its pose may be what is wrong.

    Parameters
    ----------
    sights : sequence of Sight
        With all their corners.
    found_px : sequence of (n,) arrays
        Distances of found and projected corners, by sight.
    sigma_px : sequence of float
        Standard deviation of a coordinate, by camera.
    """
    kept = []
    for sight, far in zip(sights, found_px, strict=True):
        good = sight.seen & (far <= CORNER_FACTOR * sigma_px[sight.camera])
        if good.sum() < max(FEWEST_CORNERS, (1 - LARGEST_SHARE_LOST) * sight.seen.sum()):
            good = sight.seen
        corners = np.where(good[:, None], sight.corners_px, np.nan)
        kept.append(replace(sight, corners_px=corners))
    return tuple(kept)


def bad_views(
    kept: Sequence[Sight], found_px: Sequence[NDArray], sigma_px: float
) -> dict[str, str]:
    """Views of one camera whose corners that count are outliers together, with the reason."""
    limit = VIEW_FACTOR * np.sqrt(2) * sigma_px
    bad = {}
    for sight, far in zip(kept, found_px, strict=True):
        error = root_mean_square(far[sight.seen])
        if not error <= limit:
            bad[sight.view] = f"residual {error:.2f} px, expected at most {limit:.2f}"
    return bad


def same_corners(some: Sequence[Sight], others: Sequence[Sight]) -> bool:
    """Whether the same corners count."""
    return all(np.array_equal(a.seen, b.seen) for a, b in zip(some, others, strict=True))


def lost_corners(whole: Sequence[Sight], bundle: Bundle, camera: int) -> dict[str, list[int]]:
    """Places of the outliers among a camera's corners, by view."""
    kept = {sight.view: sight.seen for sight in bundle.sights if sight.camera == camera}
    lost = {
        sight.view: np.flatnonzero(sight.seen & ~kept[sight.view]).tolist()
        for sight in whole
        if sight.camera == camera and sight.view in kept
    }
    return {view: places for view, places in lost.items() if places}


def root_mean_square(values: NDArray) -> float:
    """Root mean square of distances; 0 of none."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def usable_views(
    corners: Mapping[str, NDArray], points_m: NDArray, size_px: tuple[int, int]
) -> tuple[dict[str, NDArray], dict[str, str]]:
    """Views with enough corners that are not the same as another; the rest's reason.

    Parameters
    ----------
    corners : mapping
        View to its corners (n, 2) [px].
    points_m : (n, 3) array
        The board's.
    size_px : (width, height)

    Raises
    ------
    ValueError
        If a view has another number of corners than the board.
    """
    usable, rejected, count = {}, {}, len(points_m)
    same_px = SAME_VIEW_SHARE * np.hypot(*size_px)
    for view, found in corners.items():
        if np.shape(found) != (count, 2):
            raise ValueError(f"{view}: corners: expected ({count}, 2), found {np.shape(found)}")
        seen = np.isfinite(found).all(axis=1)
        if seen.sum() < FEWEST_CORNERS:
            rejected[view] = f"{seen.sum()} corners seen, expected at least {FEWEST_CORNERS}"
        elif np.linalg.matrix_rank(points_m[seen] - points_m[seen][0]) < 2:
            rejected[view] = "corners of one line of the board seen, expected more"
        elif other := _same(found, usable, same_px):
            rejected[view] = f"the same view as {other}"
        else:
            usable[view] = found
    return usable, rejected


def _same(found: NDArray, others: Mapping[str, NDArray], same_px: float) -> str | None:
    """A view whose corners are at the same places."""
    for name, other in others.items():
        moved = np.hypot(*(found - other).T)
        moved = moved[np.isfinite(moved)]
        if len(moved) >= FEWEST_CORNERS and moved.max() < same_px:
            return name
    return None
