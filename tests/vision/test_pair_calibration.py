"""Two cameras and the transform between them from one refinement."""

import numpy as np
import pytest
from boards import (
    BOARD,
    CALTECH,
    LEFT,
    RIGHT,
    RIGHT_FROM_LEFT,
    SIZE_PX,
    caltech,
    poses,
    seen,
    with_outliers,
)
from palpate.vision.board import Board
from palpate.vision.camera import camera_from_spec
from palpate.vision.pair_calibration import calibrate_pair
from scipy.spatial.transform import Rotation

SIZES_PX = (SIZE_PX, SIZE_PX)


def pair_of(count, *, seed=0, share=0.0, noise_px=0.1):
    views = poses(count, seed=seed, far_m=(0.35, 0.7))
    sides = [
        seen(BOARD, views, LEFT, noise_px=noise_px, seed=2 * seed + 1),
        seen(BOARD, views, RIGHT, RIGHT_FROM_LEFT, noise_px=noise_px, seed=2 * seed + 2),
    ]
    return [with_outliers(side, share, 100 + seed + k) for k, side in enumerate(sides)]


def normalised(pair):
    """Errors of both cameras' four optics and of the transform, in standard errors."""
    errors = []
    for found, true in zip(pair.cameras, (LEFT, RIGHT), strict=True):
        for name in ("fx_px", "fy_px", "cx_px", "cy_px"):
            off = getattr(found.camera, name) - getattr(true, name)
            errors.append(off / found.standard_errors[name])
    turn, true = (
        Rotation.from_matrix(transform[:3, :3]).as_rotvec()
        for transform in (pair.second_from_first, RIGHT_FROM_LEFT)
    )
    shift = pair.second_from_first[:3, 3] - RIGHT_FROM_LEFT[:3, 3]
    known = pair.standard_errors
    errors += [*(turn - true) / known["rotation_rad"], *shift / known["translation_m"]]
    return np.array(errors)


@pytest.mark.long
def test_the_toolboxes_stereo_optimisation(root):
    """Both cameras and the transform at once, as the toolbox that the pictures come with."""
    known = ((533.523, 533.527, 341.604, 235.193), (536.814, 536.476, 326.287, 250.101))
    views = [caltech(root, side) for side in ("left", "right")]
    pair = calibrate_pair(*views, CALTECH, SIZES_PX)
    for found, (fx, fy, cx, cy) in zip(pair.cameras, known, strict=True):
        camera = found.camera
        assert (camera.fx_px, camera.fy_px) == pytest.approx((fx, fy), rel=5e-4)
        assert (camera.cx_px, camera.cy_px) == pytest.approx((cx, cy), abs=2.0)
        assert camera.distortion[4] == 0
    assert pair.baseline_m == pytest.approx(0.09981, abs=1e-4)
    assert 3e-5 < pair.baseline_error_m < 1e-4
    assert pair.rms_px < 0.25
    assert pair.rejected == {}


@pytest.mark.parametrize("columns", [9, 8], ids=["odd x even", "even x even"])
def test_a_pair_is_found_whichever_way_up_its_boards_are(sensors, columns):
    spec = sensors["kinect"]
    board, views = Board(columns, 6, 0.025), poses(14)
    colour, infrared = (camera_from_spec(spec[block]) for block in ("color", "depth"))
    truth = np.linalg.inv(np.array(spec["depth"]["color_from_depth"]))
    first, second = seen(board, views, colour), seen(board, views, infrared, truth)
    turned = list(second)[::3] if board.ambiguous else []
    for name in turned:
        second[name] = second[name][::-1]
    pair = calibrate_pair(first, second, board, SIZES_PX)
    assert sorted(pair.rejected) == turned
    error = np.linalg.inv(truth) @ pair.second_from_first
    assert np.linalg.norm(error[:3, 3]) < 3e-4
    assert Rotation.from_matrix(error[:3, :3]).magnitude() < np.deg2rad(0.02)


def test_a_board_that_two_cameras_order_differently_in_most_views():
    board, views = Board(8, 6, 0.025), poses(14)
    first, second = (seen(board, views, *of) for of in ((LEFT,), (RIGHT, RIGHT_FROM_LEFT)))
    second |= {name: second[name][::-1] for k, name in enumerate(second) if k % 3}
    with pytest.raises(ValueError, match="a board that has one order .one odd and one even"):
        calibrate_pair(first, second, board, SIZES_PX)


def test_a_pair_of_different_moments_counts_for_each_camera_alone():
    first, second = pair_of(12)
    moved = poses(12, far_m=(0.35, 0.7))["04"]
    moved[:3, 3] += [0.003, 0.0, 0.0]
    second |= seen(BOARD, {"04": moved}, RIGHT, RIGHT_FROM_LEFT, noise_px=0.1)
    pair = calibrate_pair(first, second, BOARD, SIZES_PX)
    assert list(pair.rejected) == ["04"]
    assert "as a pair, expected at most" in pair.rejected["04"]
    assert "04" in pair.cameras[1].camera_from_board
    assert "04" not in pair.errors_px
    assert np.abs(normalised(pair)).max() < 4


def test_views_of_one_camera_alone_count_for_its_optics():
    first, second = pair_of(14)
    del first["02"], second["05"], second["06"]
    pair = calibrate_pair(first, second, BOARD, SIZES_PX)
    assert set(pair.errors_px) == set(first) & set(second)
    assert "02" in pair.cameras[1].errors_px
    assert np.abs(normalised(pair)).max() < 4


def of_other_moments(first, second):
    names = list(second)
    return first, {a: second[b] for a, b in zip(names, names[1:] + names[:1], strict=True)}


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        (of_other_moments, "expected pairs taken at one moment"),
        (
            lambda a, b: (dict([*a.items()][:8]), dict([*b.items()][6:])),
            "both cameras see, found 2",
        ),
        (
            lambda a, b: (a, dict([*b.items()][:3])),
            "second camera: expected at least 6 views of the board, found 3",
        ),
    ],
    ids=["other moments", "too few pairs", "too few of one camera"],
)
def test_views_that_are_no_pairs(changed, line):
    with pytest.raises(ValueError, match=line):
        calibrate_pair(*changed(*pair_of(14)), BOARD, SIZES_PX)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.0, 0.05], ids=["clean", "with outliers"])
def test_intervals_hold_the_truth(share):
    """Of 30 small calibrations' 95 % intervals of 14 numbers each, 95 % do."""
    errors = [
        normalised(calibrate_pair(*pair_of(8, seed=seed, share=share), BOARD, SIZES_PX))
        for seed in range(30)
    ]
    held = np.abs(errors) < 1.96
    assert 0.92 < held.mean() < 0.98
    assert held.mean(axis=0).min() > 0.8
