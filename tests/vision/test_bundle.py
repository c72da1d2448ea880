"""Derivatives of the problem that a calibration solves, and of its variances."""

import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, poses, seen
from palpate.vision.bundle import TERMS, Bundle, Sight
from palpate.vision.first_guess import vector_of
from palpate.vision.refine import covariance, fit, inverse


@pytest.fixture(scope="module")
def problem():
    """Three boards of two cameras, one of them not a pair, and unknowns near the truth."""
    views = poses(3)
    first, second = seen(BOARD, views, LEFT), seen(BOARD, views, RIGHT, RIGHT_FROM_LEFT)
    first["01"][4:9] = np.nan
    sights = [Sight(view, 0, view != "02", found) for view, found in first.items()]
    sights += [Sight(view, 1, view != "02", found) for view, found in second.items()]
    bundle = Bundle(BOARD.points_m, tuple(sights), (0.1, 0.2), (TERMS, ("k1",)))
    lenses = tuple(
        np.array([c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.distortion]) for c in (LEFT, RIGHT)
    )
    known = {(view, 0): vector_of(pose) for view, pose in views.items()}
    known["02", 1] = vector_of(RIGHT_FROM_LEFT @ views["02"])
    return bundle, bundle.pack(lenses, known, vector_of(RIGHT_FROM_LEFT))


def test_derivatives(problem):
    bundle, x = problem
    found = bundle.jacobian(x).toarray()
    assert found.shape == (2 * (6 * 30 - 5), len(bundle.free))
    for column, place in enumerate(bundle.free):
        step = np.zeros_like(x)
        step[place] = 1e-6 * max(1, abs(x[place]))
        rise = bundle.residuals(x + step) - bundle.residuals(x - step)
        slope = rise / (2 * step[place])
        assert found[:, column] == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())


def test_the_covariance_is_the_whole_normal_matrixs(problem):
    """Eliminating the poses changes nothing."""
    bundle, x = problem
    by = bundle.jacobian(x).toarray()
    scale = np.linalg.norm(by, axis=0)
    whole = np.linalg.inv(by.T @ by / np.outer(scale, scale)) / np.outer(scale, scale)
    shared = bundle.free[bundle.free < bundle.shared]
    found = covariance(bundle, x)[np.ix_(shared, shared)]
    ratio = np.diag(found) / np.diag(whole)[: len(shared)]
    assert ratio == pytest.approx(np.full(len(shared), ratio[0]), rel=1e-5)
    assert not np.diag(covariance(bundle, x))[14:18].any()


def test_a_fit_brings_the_residuals_to_their_least(problem):
    bundle, x = problem
    start = x.copy()
    start[:2] += 20
    start[bundle.shared - 3 : bundle.shared] += 0.01
    found = fit(bundle, start)
    assert np.sum(bundle.residuals(found) ** 2) <= np.sum(bundle.residuals(x) ** 2)


def test_what_is_not_told_has_no_variance():
    normal = np.array([[2.0, 2.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0], [0, 0, 4.0, 0], [0, 0, 0, 0]])
    assert np.diag(inverse(normal)).tolist() == [np.inf, np.inf, pytest.approx(0.25), 0.0]
