"""Derivatives of what is printed on a board that moves, held to finite differences."""

import numpy as np
import pytest
from palpate.vision.board import Print, pixel_sizes, place_derivatives
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 760.0, 512.0, 384.0)
SQUARE_M = 0.02
STEPS = np.diag([1e-6] * 6)


@pytest.fixture
def pose():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.4, -0.2, 0.3]).as_matrix()
    pose[:3, 3] = [-0.03, 0.02, 0.6]
    return pose


def moved(pose, step):
    """Turned about the camera's axes by a rotation vector, its origin shifted."""
    other = pose.copy()
    other[:3, :3] = Rotation.from_rotvec(step[:3]).as_matrix() @ pose[:3, :3]
    other[:3, 3] += step[3:]
    return other


def by_pose(function, pose):
    """Derivatives of a function's values (n,) by a step of a pose, (n, 6)."""
    ends = [[function(moved(pose, sign * step)) for step in STEPS] for sign in (1, -1)]
    return np.subtract(*ends).T / 2e-6


def on_board(rays, pose):
    """Where rays meet the board's plane, (n, 2) [squares]."""
    normal = pose[:3, 2]
    points = rays * (pose[:3, 3] @ normal / (rays @ normal))[:, None]
    return ((points - pose[:3, 3]) @ pose[:3, :3])[:, :2] / SQUARE_M


def parts(rays, pose):
    """What the refinement hands on: places, their scale and the inverse homography."""
    inverse = np.linalg.inv(pose[:3, [0, 1, 3]] * [SQUARE_M, SQUARE_M, 1])
    u, v = on_board(rays, pose).T
    return u, v, (rays @ inverse.T)[:, 2], inverse


def rays_of(pixels):
    return CAMERA.rays(np.array(pixels, dtype=float))


PIXELS = [[450, 400], [500, 350], [530, 460]]


def test_places_on_a_board_that_moves(pose):
    rays = rays_of(PIXELS)
    found = np.stack(place_derivatives(*parts(rays, pose), pose, SQUARE_M), axis=1)
    slopes = by_pose(lambda of: on_board(rays, of).ravel(), pose).reshape(found.shape)
    assert found == pytest.approx(slopes, rel=1e-5, abs=1e-5)


def test_squares_that_a_pixel_spans(pose):
    rays = rays_of(PIXELS)
    found = pixel_sizes(*parts(rays, pose), CAMERA)
    slopes = [
        (on_board(rays_of(np.add(PIXELS, step)), pose) - on_board(rays, pose)) / 1e-4
        for step in ([1e-4, 0], [0, 1e-4])
    ]
    assert np.stack(found, axis=1) == pytest.approx(np.hypot(*slopes), rel=1e-4)


def test_a_blurred_print():
    """A checkerboard of lines that are not even, at places about it and beyond."""
    rng, white = np.random.default_rng(2), np.indices((3, 4)).sum(axis=0) % 2
    board = Print(np.array([0.0, 0.8, 2.0]), np.array([0.0, 1.1]), white)
    given = rng.uniform([[-1.3], [-1.2], [0.1], [0.1]], [[3.2], [2.2], [0.3], [0.3]], (4, 19))
    for by, step in zip(board.blurred(*given)[1:], 1e-6 * np.eye(4)[..., None], strict=True):
        ends = [board.blurred(*(given + sign * step)).white for sign in (1, -1)]
        assert by == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-6)
    sharp = board.blurred(*given[:2], *np.full((2, 19), 1e-4)).white
    assert sharp == pytest.approx(board.at(*given[:2]), abs=1e-6)
    # Half a blur beside an edge a normal error's 69 % are over it.
    edge = Print(np.array([0.0]), np.zeros(0), np.array([[0.0, 1.0]]))
    assert edge.blurred(*np.array([[0.05], [0], [0.1], [0.1]])).white == pytest.approx(0.6914625)
