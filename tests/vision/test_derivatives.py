"""Derivatives of a blurred print and of a calibration, by finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from boards import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, SIZE_PX, poses, seen
from palpate.vision.board import Print, pixel_sizes
from palpate.vision.calibration_problem import TERMS, Problem, vector_of
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 760.0, 512.0, 384.0)

SQUARE_M = 0.02


@pytest.fixture
def pose():
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.4, -0.2, 0.3]).as_matrix()
    pose[:3, 3] = [-0.03, 0.02, 0.6]
    return pose


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


@pytest.fixture(scope="module")
def problem():
    """Three boards of two cameras, one of them not a pair, and unknowns near the truth."""
    boards = poses(3)
    first, second = seen(BOARD, boards, LEFT), seen(BOARD, boards, RIGHT, RIGHT_FROM_LEFT)
    first["01"][4:9] = np.nan

    first, second = (np.array([*corners.values()]) for corners in (first, second))
    unseen = np.full_like(first[0], np.nan)
    corners = [*zip(first[:2], second[:2], strict=True), (first[2], unseen), (unseen, second[2])]
    places = [*boards.values(), RIGHT_FROM_LEFT @ boards["02"]]
    poses_of = np.array([vector_of(place) for place in places])
    lenses = [[c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.distortion] for c in (LEFT, RIGHT)]
    shared = np.r_[np.ravel(lenses), vector_of(RIGHT_FROM_LEFT)]
    names, corners, sigma = (*boards, "02"), np.array(corners), np.array([0.1, 0.2])
    views = names, poses_of, corners, corners
    return Problem(BOARD.points_m, *views, shared, (TERMS, ("k1",)), sigma, (SIZE_PX, SIZE_PX))


def whole_jacobian(problem):
    """By the free shared unknowns, then by each pose in turn."""
    rows = []
    for k, (_, shared, by_pose) in enumerate(problem.linearised()):
        by_poses = np.zeros((len(shared), problem.poses.size))
        by_poses[:, 6 * k : 6 * k + 6] = by_pose
        rows.append(np.hstack([shared, by_poses]))
    return np.concatenate(rows)


def test_derivatives(problem):
    by, free = whole_jacobian(problem), np.flatnonzero(problem.free)
    assert by.shape == (2 * (6 * 30 - 5), len(free) + 24)

    unknowns = np.r_[problem.shared, problem.poses.ravel()]
    places = [*free, *range(len(problem.shared), len(unknowns))]
    for column, place in zip(by.T, places, strict=True):
        step = 1e-6 * max(1, abs(unknowns[place])) * (np.arange(len(unknowns)) == place)
        shared, poses_of = np.split(step, [len(problem.shared)])
        ends = [
            replace(
                problem,
                shared=problem.shared + way * shared,
                poses=problem.poses + way * poses_of.reshape(-1, 6),
            ).residuals()
            for way in (1, -1)
        ]
        slope = (ends[0] - ends[1]) / (2 * step[place])
        assert column == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())


def test_the_covariance_is_the_whole_normal_matrixs(problem):
    """Eliminating the poses changes nothing."""
    by = whole_jacobian(problem)
    scale = np.linalg.norm(by, axis=0)
    whole = np.linalg.inv(by.T @ by / np.outer(scale, scale)) / np.outer(scale, scale)
    free = np.flatnonzero(problem.free)
    found = np.diag(problem.covariance())
    ratio = found[free] / np.diag(whole)[: len(free)]
    assert ratio == pytest.approx(np.full(len(free), ratio[0]), rel=1e-5)
    assert not found[14:18].any()
