"""The tip of a filmed handle: what the camera's optics are wrong by is alike in all frames."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.pivot import Pivot, find_pivot
from palpate.vision.pose import by_turn, pose_by_optics

# What stated optics are taken to be wrong by: of the focal length, of the principal point, and of
# each of k1, p1 and p2 at the picture's corners. Of calibrated ones the covariance is known.
FOCAL_STD, CENTRE_STD_PX, BENT_STD_PX = 0.001, 0.5, 0.3
FOCAL, CENTRE, BENT = [0, 1], [2, 3], [4, 6, 7]
OPTICS = 9


def filmed_pivot(
    camera_from_marker: NDArray, names: Sequence[str], board: FlatBoard, spec: Mapping
) -> Pivot:
    """`find_pivot`, with what the optics are wrong by in the covariance.

    Parameters
    ----------
    camera_from_marker : (n, 4, 4) array
        Poses of the board in the order of time.
    names : sequence of str
        What errors call the frames.
    board : FlatBoard
    spec : mapping
        The ``color`` block of the sensor's file, with the ``covariance`` of a calibration where
        there is one.

    Raises
    ------
    ValueError
        As `find_pivot` does.
    """
    found, camera = find_pivot(camera_from_marker, names), camera_from_spec(spec)
    moved = tip_by_optics(camera_from_marker[found.kept], found.tip_m, board, camera)
    spread = spec.get("covariance")
    spread = stated_covariance(camera) if spread is None else np.array(spread, dtype=float)
    part = moved @ spread @ moved.T
    return replace(found, covariance=found.covariance + part, optics_covariance=part)


def tip_by_optics(
    camera_from_marker: NDArray, tip_m: NDArray, board: FlatBoard, camera: PinholeCamera
) -> NDArray:
    """Derivatives of a tip by the optics of the camera that saw it, (3, 9).

    Each pose is off as the optics are, and the tip is the least squares' of all poses.
    """
    turns = camera_from_marker[:, :3, :3]
    centred = turns - turns.mean(axis=0)
    each = np.stack([pose_by_optics(board.points_m, pose, camera) for pose in camera_from_marker])
    placed = by_turn(turns @ tip_m) @ each[:, :3] + each[:, 3:]
    normal = np.einsum("nji,njk->ik", centred, centred)
    return -np.linalg.solve(normal, np.einsum("nji,njk->ik", centred, placed))


def stated_covariance(camera: PinholeCamera) -> NDArray:
    """Covariance of fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3 that nobody calibrated, (9, 9).

    The focal lengths are wrong by one share.
    """
    focal_px = np.array([camera.fx_px, camera.fy_px])
    corner = float(np.hypot(camera.width_px, camera.height_px)) / (2 * camera.fx_px)
    std = np.zeros(OPTICS)
    std[CENTRE] = CENTRE_STD_PX
    std[BENT] = BENT_STD_PX / camera.fx_px / np.array([corner**3, 3 * corner**2, 3 * corner**2])
    found = np.diag(std**2)
    found[np.ix_(FOCAL, FOCAL)] = FOCAL_STD**2 * np.outer(focal_px, focal_px)
    return found
