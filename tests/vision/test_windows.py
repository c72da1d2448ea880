"""Planes, means and derivatives over windows, counted pixel by pixel; what highlights show."""

import numpy as np
import pytest
from palpate.capture.images import grey
from palpate.vision.depth import _colours_differ, derivative, local_plane, mean, warped

SIDE = 7


def windows(shape):
    reach = SIDE // 2
    for row in range(shape[0]):
        for column in range(shape[1]):
            rows = slice(max(row - reach, 0), row + reach + 1)
            columns = slice(max(column - reach, 0), column + reach + 1)
            yield (row, column), (rows, columns)


@pytest.fixture
def holed():
    rng = np.random.default_rng(3)
    return rng.normal(50, 4, (16, 22)).astype(np.float32), rng.random((16, 22)) > 0.3


def test_mean_of_the_valid_pixels(holed):
    image, valid = holed
    found = mean(image, valid, SIDE)
    for at, window in windows(image.shape):
        # Away from the image's edge, where pixels are reflected.
        if window[0].stop - window[0].start == SIDE == window[1].stop - window[1].start:
            if window[0].stop <= 16 and window[1].stop <= 22:
                assert found[at] == pytest.approx(image[window][valid[window]].mean(), rel=1e-5)
    assert not mean(image, np.zeros_like(valid), SIDE).any()


def test_plane_through_the_valid_pixels(holed):
    image, valid = holed
    row, column = np.indices(image.shape)
    tilted = (40 + 0.7 * column - 0.4 * row).astype(np.float32)
    flat = local_plane(np.where(valid, tilted, 0).astype(np.float32), valid, SIDE)
    assert flat == pytest.approx(tilted, abs=2e-3)
    found = local_plane(np.where(valid, image, 0), valid, SIDE)
    for at, window in windows(image.shape):
        used = valid[window]
        places = np.column_stack(
            [np.ones(used.sum()), column[window][used] - at[1], row[window][used] - at[0]]
        )
        plane = np.linalg.lstsq(places, image[window][used], rcond=None)[0]
        assert found[at] == pytest.approx(plane[0], rel=1e-3)


def test_derivative_is_exact_on_cubics():
    x = np.arange(20.0)
    image = np.tile(0.3 * x + 0.1 * x**2 - 0.01 * x**3, (4, 1)).astype(np.float32)
    expected = 0.3 + 0.2 * x - 0.03 * x**2
    assert derivative(image)[1, 2:-2] == pytest.approx(expected[2:-2], abs=1e-4)


def test_the_right_image_as_the_left_camera_sees_it():
    right = np.tile(np.arange(30, dtype=np.uint8), (5, 1))
    disparity = np.full((5, 30), 2.5, np.float32)
    assert warped(right, disparity)[:, 6:28] == pytest.approx(right[:, 6:28] - 2.5, abs=1e-3)
    tall = np.repeat(np.arange(20, dtype=np.uint8)[:, None], 9, axis=1)
    assert warped(tall, np.zeros((20, 9), np.float32)) == pytest.approx(tall)


def test_grey_levels():
    image = np.zeros((2, 2, 3), np.uint8)
    image[0, 0], image[1, 1] = [255, 0, 0], [0, 0, 255]
    # Rec. 601: 0.299 red, 0.114 blue.
    assert grey(image).tolist() == [[76, 0], [0, 29]]
    assert grey(image[..., 0]) is not None and grey(image[..., 0]).ndim == 2


def textured(rng, shape=(60, 90)):
    return np.clip(rng.normal(100, 3, (*shape, 3)), 0, 255)


def test_colours_that_differ_are_not_of_one_surface():
    rng = np.random.default_rng(5)
    left = textured(rng)
    right = left + rng.normal(0, 0.5, left.shape)
    # White light on both is no difference, and neither is what two cameras differ by everywhere.
    left[10:30, 20:50] += 40
    right[..., 0] += 6
    patch = np.s_[35:55, 40:70]
    right[patch][..., 2] += 9
    pair = [np.round(image).astype(np.uint8) for image in (left, right)]
    valid = np.ones((60, 90), bool)
    valid[:, :5] = False
    found = _colours_differ(*pair, np.zeros((60, 90), np.float32), valid, SIDE)
    inside = np.zeros_like(valid)
    inside[38:52, 43:67] = True
    outside = np.ones_like(valid)
    outside[30:60, 35:75] = False
    assert found[inside].all() and not found[outside].any()
    assert not found[:, :5].any()


def test_what_a_shift_within_a_matchs_precision_explains_is_no_difference():
    rng = np.random.default_rng(6)
    row = 100 + 30 * np.sin(np.arange(121) / 1.5)
    image = np.stack(
        [np.tile(row, (40, 1)), np.full((40, 121), 90.0), np.full((40, 121), 90.0)], -1
    )
    for shift, differs in ((0.1, False), (0.9, True)):
        moved = image.copy()
        moved[..., 0] = 100 + 30 * np.sin((np.arange(121) + shift) / 1.5)
        half = np.where(np.arange(121)[None, :, None] > 60, moved, image)
        pair = [
            np.round(one + rng.normal(0, 0.3, one.shape)).astype(np.uint8) for one in (image, half)
        ]
        still = np.zeros((40, 121), np.float32)
        found = _colours_differ(*pair, still, np.ones((40, 121), bool), 3)
        assert (found[5:-5, 66:-5].mean() > 0.2) == differs
        assert found[5:-5, 5:55].mean() < 0.02
