"""Derivatives of the problem that a calibration solves, and of its variances."""

from dataclasses import replace

import numpy as np
import pytest
from boards_seen import BOARD, LEFT, RIGHT, RIGHT_FROM_LEFT, poses, seen
from palpate.vision.calibration_problem import TERMS, Problem, View, inverse, vector_of


@pytest.fixture(scope="module")
def problem():
    """Three boards of two cameras, one of them not a pair, and unknowns near the truth."""
    boards = poses(3)
    first, second = seen(BOARD, boards, LEFT), seen(BOARD, boards, RIGHT, RIGHT_FROM_LEFT)
    first["01"][4:9] = np.nan
    views = {
        (name, 0): View(vector_of(boards[name]), {0: first[name], 1: second[name]})
        for name in ("00", "01")
    }
    views["02", 0] = View(vector_of(boards["02"]), {0: first["02"]})
    views["02", 1] = View(vector_of(RIGHT_FROM_LEFT @ boards["02"]), {1: second["02"]})
    lenses = [[c.fx_px, c.fy_px, c.cx_px, c.cy_px, *c.distortion] for c in (LEFT, RIGHT)]
    shared = np.r_[np.ravel(lenses), vector_of(RIGHT_FROM_LEFT)]
    return Problem(BOARD.points_m, views, shared, (TERMS, ("k1",)), (0.1, 0.2))


def residuals(problem):
    return np.concatenate([problem.linearised(key)[0] for key in problem.views])


def whole_jacobian(problem):
    """By the free shared unknowns, then by each pose in turn."""
    rows = []
    for k, key in enumerate(problem.views):
        _, shared, by_pose = problem.linearised(key)
        poses = np.zeros((len(shared), 6 * len(problem.views)))
        poses[:, 6 * k : 6 * k + 6] = by_pose
        rows.append(np.hstack([shared, poses]))
    return np.concatenate(rows)


def test_derivatives(problem):
    by = whole_jacobian(problem)
    assert by.shape == (2 * (6 * 30 - 5), problem.free.sum() + 24)
    for column, place in enumerate(np.flatnonzero(problem.free)):
        step = np.zeros_like(problem.shared)
        step[place] = 1e-6 * max(1, abs(problem.shared[place]))
        ends = [residuals(replace(problem, shared=problem.shared + s * step)) for s in (1, -1)]
        slope = (ends[0] - ends[1]) / (2 * step[place])
        assert by[:, column] == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
    for k, (key, view) in enumerate(problem.views.items()):
        for axis in range(6):
            ends = []
            for way in (1e-6, -1e-6):
                pose = view.pose + way * (np.arange(6) == axis)
                views = {**problem.views, key: replace(view, pose=pose)}
                ends.append(residuals(replace(problem, views=views)))
            slope = (ends[0] - ends[1]) / 2e-6
            column = problem.free.sum() + 6 * k + axis
            assert by[:, column] == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())


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


def test_a_fit_brings_the_residuals_to_their_least(problem):
    start = problem.shared.copy()
    start[:2] += 20
    start[-3:] += 0.01
    found = replace(problem, shared=start).fitted()
    assert np.sum(residuals(found) ** 2) <= np.sum(residuals(problem) ** 2)


def test_what_corners_do_not_determine_has_no_variance():
    found = inverse(np.array([[2.0, 2.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 4.0]]))
    assert np.isinf(np.diag(found)).tolist() == [True, True, False]
    assert found[2, 2] == pytest.approx(0.25)
