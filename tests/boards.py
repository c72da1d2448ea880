"""Pictures and corners of printed boards in known poses, and what corrupts them on a bench."""

from functools import cache

import cv2
import numpy as np
from palpate.vision.board import Board
from palpate.vision.board_pictures import board_in
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 790.0, 512.0, 384.0)
LEVELS = 25.0, 230.0
MARGIN, BACKGROUND = 0.75, 110
# Edges of squares and of tags' cells lie between pixels of the texture.
STEP, SUPERSAMPLING, LENS_BLUR_PX = 80, 4, 0.5


def picture(board, pose, camera=CAMERA):
    """A board by its homography, supersampled and through a lens, on grey (uint8)."""
    (left, top), (right, bottom) = board.outline_m / board.unit_m
    x = np.arange(left - MARGIN, right + MARGIN, 1 / STEP) + 0.5 / STEP
    y = np.arange(top - MARGIN, bottom + MARGIN, 1 / STEP) + 0.5 / STEP
    u, v = np.meshgrid(x, y)
    white = board.print.at(u, v)
    white[(u < left) | (u > right) | (v < top) | (v > bottom)] = 1
    texture = LEVELS[0] + (LEVELS[1] - LEVELS[0]) * white
    side = board.unit_m / STEP
    to_board = np.array([[side, 0, x[0] * board.unit_m], [0, side, y[0] * board.unit_m], [0, 0, 1]])
    projection = camera.matrix @ pose[:3, [0, 1, 3]]
    scale = SUPERSAMPLING
    finer = np.array([[scale, 0, (scale - 1) / 2], [0, scale, (scale - 1) / 2], [0, 0, 1]])
    size = (camera.width_px * scale, camera.height_px * scale)
    big = cv2.warpPerspective(
        texture.astype(np.float32),
        finer @ projection @ to_board,
        size,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=BACKGROUND,
    )
    big = cv2.GaussianBlur(big, (0, 0), LENS_BLUR_PX * scale)
    small = cv2.resize(big, (camera.width_px, camera.height_px), interpolation=cv2.INTER_AREA)
    return np.clip(np.round(small), 0, 255).astype(np.uint8)


def exact(board, pose, camera=CAMERA):
    """Where the corners are in `picture` (n, 2) [px]."""
    return camera.project(board.points_m @ pose[:3, :3].T + pose[:3, 3])


def noisy(image, rng, std=2.0):
    """With a camera's noise."""
    return np.clip(np.round(image + rng.normal(0, std, image.shape)), 0, 255).astype(np.uint8)


def about(corners):
    """Middle and size of a board in a picture [px]."""
    return corners.mean(axis=0), np.ptp(corners, axis=0).max()


def glare(image, corners, rng):
    """A lamp's reflection that burns a part of the board out."""
    middle, size = about(corners)
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    place = middle + rng.uniform(-0.3, 0.3, 2) * size
    spot = np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / (2 * (0.15 * size) ** 2))
    return np.clip(image + 400 * spot, 0, 255)


def blur(image, corners, rng):
    """A hand's motion by four pixels."""
    angle = rng.uniform(0, np.pi)
    kernel = np.zeros((9, 9), np.float32)
    end = 4 + np.round(2 * np.array([np.cos(angle), np.sin(angle)])).astype(int)
    start = 8 - end
    cv2.line(kernel, tuple(map(int, start)), tuple(map(int, end)), 1.0)
    return cv2.filter2D(image.astype(np.float32), -1, kernel / kernel.sum())


def shade(image, corners, rng):
    """A sharp shadow over a half of the board."""
    middle, _ = about(corners)
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    angle = rng.uniform(0, 2 * np.pi)
    dark = (x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle) > 0
    return image * np.where(dark, 0.35, 1.0)


def moire(image, corners, rng):
    """A screen's stripes through the print."""
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    angle, pitch = rng.uniform(0, np.pi), rng.uniform(3, 6)
    wave = np.sin(2 * np.pi * (x * np.cos(angle) + y * np.sin(angle)) / pitch)
    return np.clip(image + 25 * wave, 0, 255)


def hand(image, corners, rng, share=1 / 3):
    """A glove before a share of the board, from a side."""
    angle = rng.uniform(0, 2 * np.pi)
    along = corners @ [np.cos(angle), np.sin(angle)]
    limit = np.quantile(along, 1 - share)
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    covered = x * np.cos(angle) + y * np.sin(angle) > limit
    grain = 70 + 8 * rng.standard_normal(image.shape)
    return np.where(covered, grain, image)


CORRUPTIONS = {"glare": glare, "blur": blur, "shade": shade, "moire": moire, "hand": hand}


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
