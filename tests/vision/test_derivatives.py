"""Derivatives and covariances of poses of boards, held to finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.vision.board import Board, Print, pixel_sizes, place_derivatives
from palpate.vision.camera import PinholeCamera
from palpate.vision.photometric import FILLED_IN_PX, SYSTEMATIC_PX, BoardRefiner, _Pixels
from palpate.vision.pose import corner_cofactor, point_covariance
from scipy.spatial.transform import Rotation

CAMERA = PinholeCamera(1024, 768, 790.0, 760.0, 512.0, 384.0)
SQUARE_M = 0.02
BOARD = Board(4, 3, SQUARE_M)
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
    rng, step = np.random.default_rng(2), 1e-6
    white = np.indices((3, 4)).sum(axis=0) % 2
    board = Print(np.array([0.0, 0.8, 2.0]), np.array([0.0, 1.1]), white)
    u, v = rng.uniform(-1.3, 3.2, 19), rng.uniform(-1.2, 2.2, 19)
    blur = rng.uniform(0.1, 0.3, (2, 19))
    found = board.blurred(u, v, *blur)
    for k, by in enumerate((found.by_u, found.by_v, found.by_blur_u, found.by_blur_v)):
        ends = []
        for sign in (1, -1):
            moved = [u, v, *blur]
            moved[k] = moved[k] + sign * step
            ends.append(board.blurred(*moved).white)
        assert by == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)
    sharp = board.blurred(u, v, *np.full((2, 19), 1e-4)).white
    assert sharp == pytest.approx(board.at(u, v), abs=1e-6)
    # Half a blur beside an edge a normal error's 69 % are over it.
    edge = Print(np.array([0.0]), np.zeros(0), np.array([[0.0, 1.0]]))
    assert edge.blurred(*np.array([[0.05], [0], [0.1], [0.1]])).white == pytest.approx(0.6914625)


def test_covariances_are_those_of_the_linearised_corners(pose):
    points = np.column_stack([np.indices((4, 3)).reshape(2, -1).T * SQUARE_M, np.zeros(12)])

    def seen(of):
        return CAMERA.project(points @ of[:3, :3].T + of[:3, 3]).ravel()

    jacobian = by_pose(seen, pose)
    cofactor = corner_cofactor(points, pose, CAMERA)
    assert cofactor == pytest.approx(np.linalg.inv(jacobian.T @ jacobian), rel=1e-3)
    tip = np.array([0.03, 0.25, -0.05])

    def place(of):
        return of[:3, :3] @ tip + of[:3, 3]

    expected = by_pose(place, pose) @ cofactor @ by_pose(place, pose).T
    assert point_covariance(pose, cofactor, tip) == pytest.approx(expected, rel=1e-6)


@pytest.fixture
def refiner():
    return BoardRefiner(CAMERA, BOARD, encoding="mono8")


BLUR_PX = 0.9


def shaded(pose):
    """Pixels of a blurred board whose brightness slopes, and what bends black and white."""
    rays = CAMERA.rays(CAMERA.pixel_grid()[::7])
    rays = rays[(np.abs(on_board(rays, pose) - [1.5, 1]) < [2.3, 1.8]).all(axis=1)]
    u, v, w, inverse = parts(rays, pose)
    across, down = pixel_sizes(u, v, w, inverse, CAMERA)
    white = BOARD.print.blurred(u, v, BLUR_PX * across, BLUR_PX * down).white
    values = 40 + 2 * u - v + (120 + 3 * v) * white + 9 * white * (1 - white) * (2 - white)
    return _Pixels(rays, values, np.zeros((len(rays), 0)))


def test_the_boards_picture_is_fitted_exactly_where_it_is(refiner, pose):
    seen = shaded(pose)
    fit = refiner._fit(seen, pose, BLUR_PX, 0.4)
    assert len(seen.rays) > 1000
    assert np.abs(fit.residual).max() < 1e-9
    assert fit.contrast == pytest.approx(np.ptp(seen.values))
    # A pose and blur beside it leave what the derivatives say, but for what the shading takes.
    basis = fit.jacobian[:, 7:]
    steps = [*np.eye(6) * 1e-7, 1e-6]
    for k, step in enumerate(steps):
        ends = [
            refiner._fit(
                seen,
                moved(pose, sign * step) if k < 6 else pose,
                BLUR_PX if k < 6 else BLUR_PX + sign * step,
                0.4,
            ).residual
            for sign in (1, -1)
        ]
        slope = -(ends[0] - ends[1]) / (2 * np.max(step))
        expected = fit.jacobian[:, k]
        expected = expected - basis @ np.linalg.lstsq(basis, expected, rcond=None)[0]
        assert np.linalg.norm(slope - expected) < 0.01 * np.linalg.norm(expected)


def test_pixels_of_something_before_the_board_count_nothing(refiner, pose):
    seen = shaded(pose)
    hidden = np.arange(len(seen.rays)) % 20 == 0
    covered = seen._replace(values=np.where(hidden, 20.0, seen.values))
    fit = refiner._fit(covered, pose, BLUR_PX, 0.12)
    bright = hidden & (seen.values > 60)
    assert not fit.weight[bright].any() and fit.weight[~hidden].all()
    assert np.abs(fit.residual[~hidden]).max() < 0.5
    assert np.abs(fit.residual).max() == pytest.approx(0.12 * fit.contrast)
    assert fit.variance < 0.05


def believed(refiner, start, **changes):
    fit = refiner._fit(shaded(start), start, BLUR_PX, 0.4)
    return refiner._result(replace(fit, **changes), start, BOARD.points_m) is not None


def test_a_fit_far_from_its_start_is_not_believed(refiner):
    """Moved across by 2.5 and 3.5 pixels at the nearest corner of a target that tilts away."""
    near = np.eye(4)
    near[:3, :3] = Rotation.from_rotvec([0.9, 0, 0]).as_matrix()
    near[:3, 3] = [0, 0, 0.1]
    for pixels, fine in ((2.5, True), (3.5, False)):
        beside = near.copy()
        beside[0, 3] += pixels / CAMERA.fx_px * 0.1
        assert believed(refiner, near, pose=beside) == fine
        assert believed(refiner, beside, pose=near) == fine


def test_a_fit_that_does_not_look_like_the_target_is_not_believed(refiner, pose):
    assert believed(refiner, pose)
    count = len(shaded(pose).values)
    contrast = refiner._fit(shaded(pose), pose, BLUR_PX, 0.4).contrast
    for change in (
        {"residual": np.full(count, 0.031 * contrast)},
        {"contrast": 19.0},
        {"weight": (np.arange(count) > 0.26 * count).astype(float)},
    ):
        assert not believed(refiner, pose, **change)


def test_what_edges_are_off_by_is_added_to_the_noise(refiner, pose):
    """A picture without noise knows the pose as well as corners of the stated error do."""
    seen, corners = shaded(pose), corner_cofactor(BOARD.points_m, pose, CAMERA)
    fit = refiner._fit(seen, pose, BLUR_PX, 0.4)
    for encoding, off_px in (("mono8", SYSTEMATIC_PX), ("rgb8", FILLED_IN_PX)):
        refine = BoardRefiner(CAMERA, BOARD, encoding=encoding)
        found = refine._result(fit, pose, BOARD.points_m).covariance
        assert found == pytest.approx(off_px**2 * corners, rel=1e-6)
    # With noise the fit's own covariance stands beside it.
    noise = np.random.default_rng(1).normal(0, 2, len(seen.values))
    fit = refiner._fit(seen._replace(values=seen.values + noise), pose, BLUR_PX, 0.4)
    own = np.linalg.inv(fit.jacobian.T @ fit.jacobian)[:6, :6] * fit.variance
    assert fit.variance == pytest.approx(4.0, rel=0.1)
    found = refiner._result(fit, pose, BOARD.points_m).covariance
    assert found == pytest.approx(own + SYSTEMATIC_PX**2 * corners)
