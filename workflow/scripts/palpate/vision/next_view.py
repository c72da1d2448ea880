"""Where to hold the board next: the pose that would tell most of what is known least."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.units import MILLIMETRES
from palpate.vision.board import FlatBoard
from palpate.vision.calibration import Calibration
from palpate.vision.calibration_problem import (
    FEWEST_CORNERS,
    POSE,
    Problem,
    View,
    composed,
    inverse,
    vector_of,
)
from palpate.vision.calibration_verdict import REACH, reach
from palpate.vision.camera import PinholeCamera
from palpate.vision.pair_calibration import PairCalibration

# How much of the picture a board fills, and how it leans.
SHARES = (0.35, 0.65)
# Left free at the picture's edge, and what is no overhang.
MARGIN_PX, LITTLE_PX = 20, 10
MOST_MOVES = 4
TILT_RAD = np.deg2rad(30)
TILTS = {
    "facing the camera": (0, 0),
    "its right side 30 degrees nearer": (0, TILT_RAD),
    "its left side 30 degrees nearer": (0, -TILT_RAD),
    "its upper edge 30 degrees nearer": (TILT_RAD, 0),
    "its lower edge 30 degrees nearer": (-TILT_RAD, 0),
}
PLACES = {
    "in the picture's middle": (0, 0),
    "in the upper left corner": (-1, -1),
    "in the upper right corner": (1, -1),
    "in the lower left corner": (-1, 1),
    "in the lower right corner": (1, 1),
}


def next_view(found: Calibration | PairCalibration, board: FlatBoard) -> str:
    """Where to hold the board next, in words.

    Of a grid of poses before the (first) camera it is the one with which the focal lengths'
    variance, or for two cameras the translation's, becomes least. Where a camera's boards were
    never near the picture's corners, it is one of those.

    Parameters
    ----------
    found : Calibration or PairCalibration
    board : FlatBoard
    """
    paired = isinstance(found, PairCalibration)
    cameras = found.cameras if paired else (found,)
    spread = found.shared_covariance if paired else found.covariance
    free = np.diag(spread) > 0
    known = inverse(spread[np.ix_(free, free)])
    # Translation or focal lengths, which are never dropped.
    wanted = slice(int(free.sum()) - POSE // 2, None) if paired else slice(0, 2)
    outer = not paired and reach(found) < REACH
    errors = {
        words: _error(inverse(known + _told(cameras, board, found, pose)), wanted)
        for words, pose in _candidates(cameras[0], board, outer=outer)
    }
    if not errors:
        return "hold the board farther away: it does not fit into the picture"
    words = min(errors, key=errors.__getitem__)
    now, then = _error(spread[np.ix_(free, free)], wanted), errors[words]
    if paired:
        what, unit, scale = "translation", "mm", MILLIMETRES
    else:
        what, unit, scale = "focal length", "px", 1 / np.sqrt(2)
    gain = f"{scale * now:.2g} to {scale * then:.2g} {unit}"
    return f"hold the board {words} (the {what}'s standard error: {gain})"


def _error(spread: NDArray, wanted: slice) -> float:
    return float(np.sqrt(np.trace(spread[wanted, wanted])))


def _candidates(
    camera: Calibration, board: FlatBoard, *, outer: bool
) -> Iterator[tuple[str, NDArray]]:
    """Poses, turn and shift, at which the whole board is in the picture, or in its corners."""
    optics = camera.camera
    size = np.array([optics.width_px, optics.height_px])
    extent = 2 * board.points_m.mean(axis=0)[:2]
    for (place, side), (lean, angles), share in product(PLACES.items(), TILTS.items(), SHARES):
        if outer and not any(side):
            continue
        distance = float(np.max(optics.fx_px * extent / (share * size)))
        turn = Rotation.from_rotvec([*angles, 0])
        # Aimed at the picture's corner itself it hangs out of it: as far as that it is moved in.
        aim = (size - 1) * (1 + np.array(side)) / 2
        pose = _aimed(optics, board, aim, distance, turn)
        for _ in range(MOST_MOVES):
            aim = aim + _overhang(optics, board, pose)
            pose = _aimed(optics, board, aim, distance, turn)
        if not _overhang(optics, board, pose).any():
            yield f"{place}, {distance:.2g} m away, {lean}", pose


def _aimed(
    optics: PinholeCamera, board: FlatBoard, aim_px: NDArray, distance_m: float, turn: Rotation
) -> NDArray:
    """Pose of a board whose middle is on the ray through a pixel."""
    centre, focal = (optics.cx_px, optics.cy_px), (optics.fx_px, optics.fy_px)
    ray = np.append((aim_px - centre) / focal, 1.0)
    shift = ray * distance_m - turn.apply(board.points_m.mean(axis=0))
    return np.concatenate([turn.as_rotvec(), shift])


def _overhang(optics: PinholeCamera, board: FlatBoard, pose: NDArray) -> NDArray:
    """By how much a board must be moved to be in the picture with a margin, (2,) [px]."""
    pixels = _pixels(optics, board, pose)
    least, most = MARGIN_PX, np.array([optics.width_px, optics.height_px]) - 1 - MARGIN_PX
    over = np.maximum(least - pixels.min(axis=0), 0) + np.minimum(most - pixels.max(axis=0), 0)
    return np.where(np.abs(over) > LITTLE_PX, over, 0.0)


def _pixels(optics: PinholeCamera, board: FlatBoard, pose: NDArray) -> NDArray:
    """Where a board's corners are in the picture, (n, 2) [px]; NaN for those not before it."""
    points = Rotation.from_rotvec(pose[:3]).apply(board.points_m) + pose[3:]
    return np.where(points[:, 2:] > 0, optics.project(points), np.nan)


def _told(
    cameras: tuple[Calibration, ...],
    board: FlatBoard,
    found: Calibration | PairCalibration,
    pose: NDArray,
) -> NDArray:
    """What a board at a pose of the first camera would tell of the shared unknowns."""
    transform = vector_of(found.second_from_first) if len(cameras) > 1 else None
    poses = [pose] if transform is None else [pose, composed(pose, transform)[0]]
    corners = {}
    for k, (camera, own) in enumerate(zip(cameras, poses, strict=True)):
        optics, pixels = camera.camera, _pixels(camera.camera, board, own)
        inside = ((pixels >= 0) & (pixels < [optics.width_px, optics.height_px])).all(axis=1)
        if inside.sum() >= FEWEST_CORNERS:
            corners[k] = np.where(inside[:, None], pixels, np.nan)
    first = min(corners, default=0)
    lenses = np.concatenate([camera.lens for camera in cameras])
    problem = Problem(
        board.points_m,
        {("next", first): View(poses[first], corners)} if corners else {},
        lenses if transform is None else np.r_[lenses, transform],
        tuple(camera.terms for camera in cameras),
        tuple(camera.sigma_px for camera in cameras),
    )
    return problem.information()
