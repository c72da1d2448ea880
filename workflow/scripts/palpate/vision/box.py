"""Place a box of known size on a cloud of its top (the CD case of Section 4.2.4)."""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize

from palpate.vision.support_plane import height_above

# Cells of the plan on which the top is drawn, and how holes in it are closed [m].
CELL_M, CLOSED_M, MARGIN_M = 0.001, 0.008, 0.06
MILLIMETRE, MILLIRADIAN = 1e-3, 1e-3
# Points lower than this are the table's; those farther than this from the box are something else.
LOWEST_M, REACH_M = 0.003, 0.012
FEWEST_POINTS = 200
# First steps of the search [m, m, rad]; part of the top's area that may be missing or too much.
FIRST_STEP, MOST_APART = (0.004, 0.004, 0.03), 0.2
# Points of the top lie within this of its height [m].
TOP_BAND_M = 0.004


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
        camera_from_box; the box's frame has x along its length, z up, its origin amid its foot.

    Raises
    ------
    ValueError
        If too few points lie at the box's height, or they do not fill its top.
    """
    height = height_above(plane, points_m)
    top = points_m[np.abs(height - size_m[2]) < TOP_BAND_M]
    if len(top) < FEWEST_POINTS:
        raise ValueError(
            f"box: expected at least {FEWEST_POINTS} points {size_m[2] * 1e3:g} mm above the"
            f" table, found {len(top)}"
        )
    axes = _plane_axes(plane[:3])
    cells, drawn = _plan(top @ axes.T)
    size_m = np.asarray(size_m, dtype=float)
    if size_m[0] < size_m[1]:
        raise ValueError(f"box: expected length >= width, found {size_m[0]:g}, {size_m[1]:g} m")
    middle, angle, apart = _laid(cells, drawn, size_m[:2])
    if apart > MOST_APART:
        raise ValueError(
            f"box: expected a top of {size_m[0] * 1e3:.0f} x {size_m[1] * 1e3:.0f} mm, found a"
            f" piece that differs from it in {apart:.0%} of its area"
        )
    scene = np.column_stack([points_m @ axes.T, height])
    middle, angle = _registered(scene[height > LOWEST_M], size_m, middle, angle)
    along, across = (np.array([np.cos(way), np.sin(way)]) for way in (angle, angle + np.pi / 2))
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = along @ axes, across @ axes, plane[:3]
    pose[:3, 3] = middle @ axes - plane[3] * plane[:3]
    return pose


def outline_distance(places_m: NDArray, size_m: NDArray) -> NDArray:
    """Signed distance of places (n, 2) from a centred rectangle's outline, positive outside [m]."""
    beyond = np.abs(places_m) - np.asarray(size_m)[:2] / 2
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0)


def _plane_axes(normal: NDArray) -> NDArray:
    """Two unit vectors in a plane, right-handed with its normal, (2, 3)."""
    start = np.eye(3)[np.argmin(np.abs(normal))]
    first = start - (start @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


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


def _laid(cells_m: NDArray, drawn: NDArray, size_m: NDArray) -> tuple[NDArray, float, float]:
    """Middle [m] and angle [rad] of the rectangle that fits the drawn cells best.

    The last value is the part of the rectangle's area by which the two differ.
    """

    def mismatch(parameters: NDArray) -> float:
        distance = outline_distance(_turned(cells_m - parameters[:2], parameters[2]), size_m)
        return float(
            distance[drawn & (distance > 0)].sum() - distance[~drawn & (distance < 0)].sum()
        )

    inside = cells_m[drawn].astype(np.float32)
    (x, y), _, degrees = cv2.minAreaRect(inside)
    fits = []
    for turn in (0, 90):
        start = np.array([x, y, np.deg2rad(degrees + turn)])
        simplex = np.vstack([start, start + np.diag(FIRST_STEP)])
        options = {"initial_simplex": simplex, "xatol": 1e-6, "fatol": 1e-6, "maxiter": 600}
        fits.append(minimize(mismatch, start, method="Nelder-Mead", options=options))
    best = min(fits, key=lambda fit: fit.fun).x
    covered = outline_distance(_turned(cells_m - best[:2], best[2]), size_m) < 0
    apart = (covered ^ drawn).sum() / max(covered.sum(), 1)
    return best[:2], float(best[2]), float(apart)


def _registered(
    scene_m: NDArray, size_m: NDArray, middle_m: NDArray, angle: float
) -> tuple[NDArray, float]:
    """Middle [m] and angle [rad] at which points (x, y, height) lie nearest to the box."""
    half = size_m[:2] / 2
    placed = _turned(scene_m[:, :2] - middle_m, angle)
    near = (np.abs(placed) < half + REACH_M).all(axis=1) & (scene_m[:, 2] < size_m[2] + REACH_M)
    places, height = scene_m[near, :2], scene_m[near, 2] - size_m[2]

    def distance(parameters: NDArray) -> NDArray:
        shift, turn = parameters[:2] * MILLIMETRE, parameters[2] * MILLIRADIAN
        beside = np.abs(_turned(places - middle_m - shift, angle + turn)) - half
        beyond = np.column_stack([beside, height])
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        return (outside + np.minimum(beyond.max(axis=1), 0)) / MILLIMETRE

    best = least_squares(distance, np.zeros(3), loss="soft_l1", diff_step=1e-2).x
    return middle_m + best[:2] * MILLIMETRE, angle + float(best[2]) * MILLIRADIAN


def _turned(places: NDArray, angle: float) -> NDArray:
    """Places seen from axes turned by an angle, (n, 2)."""
    along, across = (np.array([np.cos(way), np.sin(way)]) for way in (angle, angle + np.pi / 2))
    return places @ np.stack([along, across]).T
