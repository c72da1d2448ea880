"""Boards before cameras of known optics, and the corners that these see."""

from functools import cache

import cv2
import numpy as np
from palpate.vision.board import Board
from palpate.vision.board_pictures import board_in
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

LEFT = PinholeCamera(640, 480, 520.0, 522.0, 315.0, 236.0, (-0.25, 0.08, 0.0, 0.0, 0.0))
RIGHT = PinholeCamera(640, 480, 580.0, 579.0, 322.0, 243.0)
RIGHT_FROM_LEFT = np.eye(4)
RIGHT_FROM_LEFT[:3, :3] = Rotation.from_rotvec([0.01, -0.05, 0.004]).as_matrix()
RIGHT_FROM_LEFT[:3, 3] = -0.1, 0.002, 0.004
SIZE_PX = (640, 480)
BOARD = Board(6, 5, 0.04)
CALTECH = Board(9, 6, 0.030)


def poses(count, seed=0, far_m=(0.5, 1.0)):
    """Poses of a board, view by view."""
    rng = np.random.default_rng(seed)
    found = {}
    for k in range(count):
        pose = np.eye(4)
        turn = np.deg2rad(rng.uniform(-30, 30, 3)) * [1, 1, 0.5]
        pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        pose[:3, 3] = [*rng.uniform(-0.2, 0.0, 2), rng.uniform(*far_m)]
        found[f"{k:02d}"] = pose
    return found


def seen(board, views, camera, second_from_first=None, noise_px=0.02, seed=1):
    """Corners of each view as a camera sees them."""
    second_from_first = np.eye(4) if second_from_first is None else second_from_first
    rng = np.random.default_rng(seed)
    corners = {}
    for name, pose in views.items():
        pose = second_from_first @ pose
        points = board.points_m @ pose[:3, :3].T + pose[:3, 3]
        exact = camera.project(points)
        corners[name] = exact + noise_px * rng.standard_normal(exact.shape)
    return corners


def with_outliers(corners, share, seed, size_px=3.0):
    """The same corners, some of them far off."""
    rng = np.random.default_rng(seed)
    corrupted = {}
    for name, found in corners.items():
        off = rng.normal(0, size_px, found.shape) * (rng.random(len(found)) < share)[:, None]
        corrupted[name] = found + off
    return corrupted


@cache
def caltech(root, side):
    """Corners of CALTECH in one camera's real pictures."""
    files = sorted((root / "tests/real/boards").glob(f"{side}*.jpg"))
    images = {path.stem[-2:]: cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in files}
    pictures = board_in(side, images, CALTECH)
    assert len(pictures.corners) + len(pictures.missing) == 13
    return pictures.corners
