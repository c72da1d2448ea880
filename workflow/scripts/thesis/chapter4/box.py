"""Place a box of known size on a cloud of its top (the CD case of Section 4.2.4)."""

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.vision.support_plane import height_above
from scipy.optimize import least_squares, minimize

# Cells of the plan on which the top is drawn, and how holes in it are closed [m].
CELL_M, CLOSED_M, MARGIN_M = 0.001, 0.008, 0.06
# Units of the last step's unknowns, a shift and an angle [m, rad].
UNITS = np.array([1e-3, 1e-3, 1e-3])
# Points lower than this are the table's; those farther than this from the box are something else.
LOWEST_M, REACH_M = 0.003, 0.012
# So many points of the top, within this of its height [m].
FEWEST_POINTS, TOP_BAND_M = 200, 0.004
# First steps of the search [m, m, rad]; part of the top's area that may be missing or too much.
FIRST_STEP, MOST_APART = (0.004, 0.004, 0.03), 0.2


def place_box(points_m: NDArray, plane: NDArray, size_m: NDArray) -> NDArray:
    """Find where a box stands on a table from points of its top.

    The top's points are drawn on a plan of the table, and the rectangle is laid so that what it
    covers and what is drawn differ least, each cell weighted by its distance from the outline.
    From there the points' distances from the box, the sides that are seen too, are made least.

    Parameters
    ----------
    points_m : (n, 3) array
        Cloud of the scene, camera frame [m].
    plane : (4,) array
        The table (`fit_support_plane`).
    size_m : (3,) array
        Length, width and height of the box; length >= width.

    Returns
    -------
    (4, 4) array
        camera_from_box; the box's frame has x along its length, z up, its origin amid its base.

    Raises
    ------
    ValueError
        If too few points lie at the box's height, or they do not fill its top.
    """
    size_m, height = np.asarray(size_m, dtype=float), height_above(plane, points_m)
    top = points_m[np.abs(height - size_m[2]) < TOP_BAND_M]
    if len(top) < FEWEST_POINTS:
        raise ValueError(
            f"box: expected at least {FEWEST_POINTS} points {size_m[2] * 1e3:g} mm above the"
            f" table, found {len(top)}"
        )
    if size_m[0] < size_m[1]:
        raise ValueError(f"box: expected length >= width, found {size_m[0]:g}, {size_m[1]:g} m")
    axes = _plane_axes(plane[:3])
    place, apart = _laid(*_plan(top @ axes.T), size_m)
    if apart > MOST_APART:
        raise ValueError(
            f"box: expected a top of {size_m[0] * 1e3:.0f} x {size_m[1] * 1e3:.0f} mm, found a"
            f" piece that differs from it in {apart:.0%} of its area"
        )
    scene = np.column_stack([points_m @ axes.T, height])
    place = _registered(scene[height > LOWEST_M], size_m, place)
    pose = np.eye(4)
    pose[:3, :2], pose[:3, 2] = (_turn(place[2]) @ axes).T, plane[:3]
    pose[:3, 3] = place[:2] @ axes - plane[3] * plane[:3]
    return pose


def outline_distance(places_m: NDArray, size_m: NDArray) -> NDArray:
    """Signed distance of places (n, 2) from a centred rectangle's outline, positive outside [m]."""
    return _outside(np.abs(places_m) - np.asarray(size_m)[:2] / 2)


def _outside(beyond: NDArray) -> NDArray:
    """Signed distance from a box, by how far places are beyond each of its sides (n, k)."""
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)


def _plane_axes(normal: NDArray) -> NDArray:
    """Two unit vectors in a plane, right-handed with its normal, (2, 3)."""
    start = np.eye(3)[np.argmin(np.abs(normal))]
    first = start - (start @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def _turn(angle: float) -> NDArray:
    """Axes turned by an angle, (2, 2)."""
    return np.array([[np.cos(a), np.sin(a)] for a in (angle, angle + np.pi / 2)])


def _plan(flat_m: NDArray) -> tuple[NDArray, NDArray]:
    """Cells (k, 2) [m] around the points, and whether the largest drawn piece covers each."""
    middle = np.median(flat_m, axis=0)
    reach = 2 * np.median(np.abs(flat_m - middle), axis=0) + MARGIN_M
    low, count = middle - reach, np.ceil(2 * reach / CELL_M).astype(int)
    places = np.floor((flat_m - low) / CELL_M).astype(int)
    places = places[((places >= 0) & (places < count)).all(axis=1)]
    plan = np.zeros(count[::-1], dtype=np.uint8)
    plan[places[:, 1], places[:, 0]] = 1
    size = int(CLOSED_M / CELL_M) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    plan = cv2.morphologyEx(cv2.morphologyEx(plan, cv2.MORPH_CLOSE, disc), cv2.MORPH_OPEN, disc)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(plan)
    largest = 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA]) if len(stats) > 1 else 0
    y, x = np.indices(plan.shape)
    cells = low + (np.column_stack([x.ravel(), y.ravel()]) + 0.5) * CELL_M
    return cells, (labels == largest).ravel()


def _laid(cells_m: NDArray, drawn: NDArray, size_m: NDArray) -> tuple[NDArray, float]:
    """Middle and angle (3,) [m, rad] of the rectangle on drawn cells, and the part it misses."""

    def distance(place: NDArray) -> NDArray:
        return outline_distance((cells_m - place[:2]) @ _turn(place[2]).T, size_m)

    def mismatch(place: NDArray) -> float:
        d = distance(place)
        return float(d[drawn & (d > 0)].sum() - d[~drawn & (d < 0)].sum())

    (x, y), _, degrees = cv2.minAreaRect(cells_m[drawn].astype(np.float32))
    fits = []
    for turn in (0, 90):
        start = np.array([x, y, np.deg2rad(degrees + turn)])
        simplex = np.vstack([start, start + np.diag(FIRST_STEP)])
        options = {"initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-6, "maxiter": 600}
        fits.append(minimize(mismatch, start, method="Nelder-Mead", options=options))
    best = min(fits, key=lambda fit: fit.fun).x
    covered = distance(best) < 0
    return best, float((covered ^ drawn).sum() / max(covered.sum(), 1))


def _registered(scene_m: NDArray, size_m: NDArray, place: NDArray) -> NDArray:
    """Middle and angle (3,) [m, rad] at which points (x, y, height) lie nearest to the box."""
    half = size_m[:2] / 2
    placed = (scene_m[:, :2] - place[:2]) @ _turn(place[2]).T
    near = (np.abs(placed) < half + REACH_M).all(axis=1) & (scene_m[:, 2] < size_m[2] + REACH_M)
    flat, height = scene_m[near, :2], scene_m[near, 2] - size_m[2]

    def distance(step: NDArray) -> NDArray:
        there = place + step * UNITS
        beside = np.abs((flat - there[:2]) @ _turn(there[2]).T) - half
        return _outside(np.column_stack([beside, height])) / UNITS[0]

    return place + least_squares(distance, np.zeros(3), loss="soft_l1", diff_step=1e-2).x * UNITS
