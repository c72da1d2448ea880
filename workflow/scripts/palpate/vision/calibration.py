"""Intrinsics of a camera and the transform between two, from a checkerboard (Section 4.1.4)."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import Board
from palpate.vision.camera import PinholeCamera

FEWEST_VIEWS = 6
# Real boards leave a few tenths; pictures of different moments leave tens.
LARGEST_PAIR_RMS_PX = 2.0
# A view is an outlier beyond this many times the median error, but never below so many pixels.
OUTLIER_FACTOR, OUTLIER_PX = 3.0, 0.3
CONVERGED = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-12)
PARAMETERS = ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"]


@dataclass(frozen=True)
class Calibration:
    """Optics of one camera and what they rest on.

    Attributes
    ----------
    camera : PinholeCamera
    standard_errors : mapping
        Of the parameters that were free.
    camera_from_board : dict
        View to its board's pose (4, 4).
    errors_px : dict
        View to its root mean square residual.
    rejected : dict
        View to the reason.
    rms_px : float
    """

    camera: PinholeCamera
    standard_errors: Mapping[str, float]
    camera_from_board: Mapping[str, NDArray]
    errors_px: Mapping[str, float]
    rejected: Mapping[str, str]
    rms_px: float


@dataclass(frozen=True)
class PairCalibration:
    """Transform between two cameras.

    Attributes
    ----------
    second_from_first : (4, 4) array
    errors_px : dict
        View to the root mean square residuals in both cameras.
    rms_px : float
    """

    second_from_first: NDArray
    errors_px: Mapping[str, tuple[float, float]]
    rms_px: float


def calibrate_camera(
    corners: Mapping[str, NDArray], board: Board, size_px: tuple[int, int]
) -> Calibration:
    """Zhang's calibration of one camera with five distortion parameters.

    Views whose residual is far above the others' are left out and named.

    Parameters
    ----------
    corners : mapping
        View to its corners (n, 2) [px].
    board : Board
    size_px : (width, height)

    Raises
    ------
    ValueError
        If too few views show the board.
    """
    views, rejected = dict(corners), {}
    while True:
        _check_count(len(views), rejected)
        seen = {name: np.isfinite(found[:, 0]) for name, found in views.items()}
        points = [board.points_m[seen[name]].astype(np.float32) for name in views]
        images = [found[seen[name]].astype(np.float32) for name, found in views.items()]
        rms, K, distortion, turns, shifts, std, _, errors = cv2.calibrateCameraExtended(
            points, images, size_px, None, None, criteria=CONVERGED
        )
        errors = dict(zip(views, errors.ravel().tolist(), strict=True))
        limit = max(OUTLIER_PX, OUTLIER_FACTOR * float(np.median(list(errors.values()))))
        bad = [name for name, error in errors.items() if error > limit]
        if not bad:
            break
        for name in bad:
            rejected[name] = f"residual {errors[name]:.2f} px, expected at most {limit:.2f}"
            del views[name]
    camera = PinholeCamera(
        *size_px, K[0, 0], K[1, 1], K[0, 2], K[1, 2], tuple(distortion.ravel()[:5].tolist())
    )
    poses = [_pose(turn, shift) for turn, shift in zip(turns, shifts, strict=True)]
    return Calibration(
        camera,
        dict(zip(PARAMETERS, std.ravel()[: len(PARAMETERS)].tolist(), strict=True)),
        dict(zip(views, poses, strict=True)),
        errors,
        rejected,
        float(rms),
    )


def calibrate_pair(
    first: Mapping[str, NDArray],
    second: Mapping[str, NDArray],
    board: Board,
    cameras: tuple[PinholeCamera, PinholeCamera],
) -> PairCalibration:
    """Transform between two cameras of known optics from boards that both see.

    A board that looks the same after half a turn is ordered by the pose that both cameras agree
    on.

    Parameters
    ----------
    first, second : mapping
        View to its corners in each camera (n, 2) [px].
    board : Board
    cameras : (PinholeCamera, PinholeCamera)

    Raises
    ------
    ValueError
        If too few views are seen by both, or the order of an ambiguous board can't be settled.
    """
    shared = [name for name in first if name in second]
    _check_count(len(shared), {})
    paired = {name: second[name] for name in shared}
    if board.ambiguous:
        paired = _ordered_alike(first, paired, board, cameras)
    seen = {
        name: np.isfinite(first[name][:, 0]) & np.isfinite(paired[name][:, 0]) for name in shared
    }
    points = [board.points_m[seen[name]].astype(np.float32) for name in shared]
    lenses = [item for c in cameras for item in (c.matrix, np.array(c.distortion))]
    rms, _, _, _, _, turn, shift, *_, errors = cv2.stereoCalibrateExtended(
        points,
        [first[name][seen[name]].astype(np.float32) for name in shared],
        [paired[name][seen[name]].astype(np.float32) for name in shared],
        *lenses,
        (cameras[0].width_px, cameras[0].height_px),
        None,
        None,
        flags=cv2.CALIB_FIX_INTRINSIC,
        criteria=CONVERGED,
    )
    if rms > LARGEST_PAIR_RMS_PX:
        raise ValueError(
            "calibration: expected pairs taken at one moment (residual up to"
            f" {LARGEST_PAIR_RMS_PX:g} px), found {rms:.1f} px"
        )
    transform = np.eye(4)
    transform[:3, :3], transform[:3, 3] = turn, shift.ravel()
    pairs = {name: tuple(row) for name, row in zip(shared, errors.tolist(), strict=True)}
    return PairCalibration(transform, pairs, float(rms))


def _ordered_alike(
    first: Mapping[str, NDArray],
    second: Mapping[str, NDArray],
    board: Board,
    cameras: tuple[PinholeCamera, PinholeCamera],
) -> dict[str, NDArray]:
    """Turn the second camera's corners so that all views give about one transform."""
    options = {}
    for name, corners in second.items():
        known = _board_pose(first[name], board, cameras[0])
        options[name] = [
            (seen, _board_pose(seen, board, cameras[1]) @ np.linalg.inv(known))
            for seen in (corners, corners[::-1].copy())
        ]
    best = None
    for choices in options.values():
        for _, guess in choices:
            picked = {
                name: min(pair, key=lambda option, guess=guess: _apart(option[1], guess))
                for name, pair in options.items()
            }
            cost = float(np.median([_apart(option[1], guess) for option in picked.values()]))
            if best is None or cost < best[0]:
                best = (cost, picked)
    cost, picked = best
    others = {
        name: max(_apart(option[1], picked[name][1]) for option in pair)
        for name, pair in options.items()
    }
    if cost > 0.2 * min(others.values()):
        raise ValueError(
            "board: expected one odd and one even number of corners, or views that settle its"
            f" order, found {board.columns} x {board.rows}"
        )
    return {name: option[0] for name, option in picked.items()}


def _apart(a: NDArray, b: NDArray) -> float:
    """Angle between two transforms [rad]."""
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1, 1)))


def _board_pose(corners: NDArray, board: Board, camera: PinholeCamera) -> NDArray:
    seen = np.isfinite(corners[:, 0])
    _, turn, shift = cv2.solvePnP(
        board.points_m[seen], corners[seen], camera.matrix, np.array(camera.distortion)
    )
    return _pose(turn, shift)


def _pose(turn: NDArray, shift: NDArray) -> NDArray:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(turn)[0]
    pose[:3, 3] = shift.ravel()
    return pose


def _check_count(count: int, rejected: Mapping[str, str]) -> None:
    if count < FEWEST_VIEWS:
        more = f" ({len(rejected)} rejected)" if rejected else ""
        raise ValueError(
            f"calibration: expected at least {FEWEST_VIEWS} views of the board, found {count}{more}"
        )
