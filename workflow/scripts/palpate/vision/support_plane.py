"""The table, from the depth of the empty scene."""

import logging
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.json_fields import numbers_of, read_fields
from palpate.yaml_files import mismatch

SAMPLES = 20_000
TRIALS = 300
FEWEST_POINTS = 100
# Up to so many planes are told apart; what lies within so many distances of one is its noise.
PLANES, APART = 5, 3
# A camera the right way up sees a table, at whatever slope, within 50 degrees of this, and a wall
# beyond it.
UP, LEAST_COSINE = np.array([0.0, -1.0, -1.0]) / np.sqrt(2), np.cos(np.deg2rad(50))
# In the middle of the picture, a table has so much of what the largest plane has.
LEAST_PART = 0.25
# And the largest so much of all that is seen there: false matches on a table of one colour make
# planes too, of a fifth (the lab's devices see 77 to 100 %, among clutter a third).
LEAST_SHARE = 0.25
# Where the object is in view: its top is as level as this, and no higher above the table [m].
LEVEL_COSINE, HIGHEST_M = np.cos(np.deg2rad(10)), 0.3
# Files are rounded by whoever writes them; a normal of another length is none.
UNIT_TOLERANCE = 1e-3


def fit_support_plane(
    points_m: NDArray, *, inlier_distance_m: float, rng: np.random.Generator, empty: bool = True
) -> NDArray:
    """Find the plane that objects stand on: RANSAC, then least squares on its inliers.

    It is the nearest level one in the middle of the picture, where the object stands: behind a
    small table a wall or the floor has more points. Where no plane is level, all count. With the
    object in view it is the largest one, above which an object's top may be level too.

    Parameters
    ----------
    points_m : (n, 3) array
        Cloud of the scene, camera frame [m].
    inlier_distance_m : float
        Distance up to which a point belongs to the plane [m].
    rng : numpy.random.Generator
    empty : bool, optional
        Whether the object is not in the scene.

    Returns
    -------
    (4,) array
        Unit normal, pointing to the camera's side, and offset d [m] of n.x + d = 0.

    Raises
    ------
    ValueError
        If there are too few points, they lie on no plane, or on more than can be told apart.
    """
    name, count = "background depth" if empty else "first cloud", len(points_m)
    if count < FEWEST_POINTS:
        why = " (the sensor's range_m, depth.count_m or cloud.unit?)" * empty
        raise ValueError(f"{name}: expected at least {FEWEST_POINTS} points, found {count}{why}")

    def near(points: NDArray, plane: NDArray, distances: int = 1) -> NDArray:
        return np.abs(height_above(plane, points)) < distances * inlier_distance_m

    sample = points_m[rng.choice(count, min(SAMPLES, count), replace=False)]
    found, left = [], sample
    while len(found) < PLANES and len(left) >= FEWEST_POINTS:
        threes = (left[rng.choice(len(left), 3, replace=False)] for _ in range(TRIALS))
        plane = max(map(_least_squares, threes), key=lambda trial: near(left, trial).sum())
        for _ in range(2):
            plane = _least_squares(points_m[near(points_m, plane)])
        found.append(plane if plane[3] > 0 else -plane)
        left = left[~near(left, plane, APART)]
    seen = sample[:, :2] / sample[:, 2:]
    low, high = np.quantile(seen, [0.25, 0.75], axis=0)
    middle = sample[((seen > low) & (seen < high)).all(axis=1)] if empty else sample
    parts = [near(middle, plane).mean() for plane in found]
    if max(parts) < LEAST_SHARE:
        share = f"{LEAST_SHARE:.0%} or more of what is seen in the middle of the picture"
        most = f"{max(parts):.0%} (a table without a pattern?)"
        raise mismatch(name, f"a plane with {share}", most)
    large = [k for k, part in enumerate(parts) if part >= LEAST_PART * max(parts)]
    level = [k for k in large if found[k][:3] @ UP > LEAST_COSINE] or large
    taken = min(level, key=lambda k: found[k][3] if empty else -parts[k])
    for k in set(level) - {taken} if not empty else ():
        lower_m = found[k][3] - found[taken][3]
        if found[k][:3] @ found[taken][:3] > LEVEL_COSINE and not -HIGHEST_M < lower_m < 0:
            where = f"{abs(lower_m):.3f} m {'below' if lower_m > 0 else 'above'} it"
            other = f"one {where} ({parts[k]:.0%} of the points for {parts[taken]:.0%})"
            top = "the table as its largest plane, and of level ones no other than an object's top"
            raise mismatch(name, top, f"{other}: which is the table? (record a background)")
    text = "table: %.3f m from the camera, %.0f %% of the middle of the picture, of %d level planes"
    logging.info(text, found[taken][3], 100 * parts[taken], len(level))
    return found[taken]


def height_above(plane: NDArray, points_m: NDArray) -> NDArray:
    """Signed distance of points from a plane, positive on the camera's side, shape (n,) [m]."""
    return points_m @ plane[:3] + plane[3]


def read_plane(path: str | Path) -> NDArray:
    """Unit normal and offset (4,) [m] of a support_plane.json, as `fit_support_plane` gives them.

    Raises
    ------
    ValueError
        Naming file and field, if the file is no JSON, or the normal or the offset is not there.
    """
    fields = read_fields(path)
    normal = numbers_of(path, fields, "normal", (3,))
    offset = numbers_of(path, fields, "offset_m", ())
    if not abs(np.linalg.norm(normal) - 1) < UNIT_TOLERANCE:
        raise ValueError(f"{path}: normal: expected a unit vector, found {normal.tolist()}")
    return np.append(normal, offset)


def _least_squares(points: NDArray) -> NDArray:
    centre = points.mean(axis=0)
    _, vectors = np.linalg.eigh(np.cov((points - centre).T))
    return np.append(vectors[:, 0], -vectors[:, 0] @ centre)
