"""Places followed in pictures: by parts of a pixel, past shake and light, or not at all."""

import cv2
import numpy as np
import pytest
from palpate.vision.flow import picture_flow, uncovered_share
from scipy.ndimage import fourier_shift

SIZE, WINDOW = (200, 260), 15
LIGHTS = (1.0, 1.03, 0.97, 1.0, 1.02)
PLACES = np.array([[x, y] for x in range(60, 200, 20) for y in range(60, 150, 15)], dtype=float)


def texture(seed=1, blur_px=1.5):
    grain = np.random.default_rng(seed).uniform(0, 255, SIZE).astype(np.float32)
    soft = cv2.GaussianBlur(grain, (0, 0), blur_px)
    return 40 + 160 * (soft - soft.min()) / np.ptp(soft)


def shifted(image, x, y):
    """Exactly, but for what comes in at the other end."""
    return np.fft.ifft2(fourier_shift(np.fft.fft2(image), (y, x))).real


def film(*moves, light=1.0, shake=(0.0, 0.0), blur_px=1.5):
    """Pictures of an object in the middle that moves, before a background that does not."""
    noise, inside = np.random.default_rng(2), np.zeros(SIZE, dtype=bool)
    inside[40:160, 40:220] = True
    pictures = []
    for k, move in enumerate([(0, 0)] * 4 + list(moves)):
        seen = np.where(inside, shifted(texture(blur_px=blur_px), *move), texture(3))
        if k >= 4:
            seen = light * shifted(seen, *shake)
        pictures.append(np.clip(seen + noise.normal(0, 1.5, SIZE), 0, 255).astype(np.uint8))
    return pictures, ~inside


@pytest.mark.parametrize(("light", "shake"), [(1.0, (0, 0)), (0.9, (0, 0)), (1.0, (0.3, -0.2))])
def test_parts_of_a_pixel_whatever_light_and_shake(light, shake):
    moves = [(0.25, -0.4), (0.8, -1.1), (1.6, -2.3)]
    pictures, background = film(*moves, light=light, shake=shake)
    found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)
    assert np.isfinite(found).mean() > 0.95
    assert np.nanmedian(found[4:], axis=1) == pytest.approx(np.array(moves), abs=0.02)
    assert np.nanstd(found[:4]) < 0.06


@pytest.mark.parametrize("move_px", [0.05, 0.1, 0.25])
def test_small_parts_of_a_pixel_of_a_sharp_picture_are_not_made_larger(move_px):
    """Straight lines between its pixels give 0.06 for 0.05 px, 0.12 for 0.10."""
    pictures, background = film(*[(move_px, 0.0)] * 6, blur_px=0.7)
    found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)
    assert np.nanmean(found[4:, :, 0]) == pytest.approx(move_px, abs=0.003 + 0.02 * move_px)


def test_what_is_covered_or_without_texture_is_not_found():
    pictures, background = film((0.5, 0.0))
    pictures[-1][80:130, 100:150] = 90
    found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)
    inside = (np.abs(PLACES - [125, 105]) < [18, 18]).all(axis=1)
    assert inside.any() and not np.isfinite(found[-1, inside]).any()
    assert np.isfinite(found[-1, np.abs(PLACES - [125, 105]).max(axis=1) > 45]).all()


def test_a_probe_and_light_that_change_at_rest_are_no_noise():
    """A faint texture stays one; grey values that a probe passes say nothing of a camera."""
    pictures, background = film((0.5, -0.3))
    faint = [np.clip(0.15 * (seen.astype(float) - 120) + 120, 0, 255) for seen in pictures]
    seen = [np.rint(light * one).astype(np.uint8) for light, one in zip(LIGHTS, faint, strict=True)]
    for k, one in enumerate(seen):
        one[:30, 50 * k : 50 * k + 40] = 255
    found = picture_flow(seen, np.arange(4), PLACES, background, window_px=WINDOW)
    assert np.isfinite(found).mean() > 0.95
    assert np.nanmedian(found[4], axis=0) == pytest.approx([0.5, -0.3], abs=0.05)


def test_what_stays_with_the_light_and_behind_the_object_is_not_followed():
    """A gloss as broad as a window does not move with the surface, nor does the background."""
    move, (y, x) = (0.9, -1.3), np.mgrid[: SIZE[0], : SIZE[1]]
    pictures, background = film(move)
    gloss = 90 * np.exp(-((x - 130) ** 2 + (y - 100) ** 2) / (2 * (1.2 * WINDOW) ** 2))
    shone = [np.clip(0.5 * seen + gloss, 0, 255).astype(np.uint8) for seen in pictures]
    edge = np.array([[x, 40 + WINDOW / 2 - 2] for x in range(60, 200, 10)])
    places = np.vstack([PLACES, edge])
    found = picture_flow(shone, np.arange(4), places, background, window_px=WINDOW)[4]
    near = np.linalg.norm(PLACES - [130, 100], axis=1) < 2 * WINDOW
    assert found[: len(PLACES)][near].mean(axis=0) == pytest.approx(move, abs=0.02)
    assert np.isnan(found[len(PLACES) :]).all()


def test_the_edge_of_a_shadow_that_was_not_there_at_rest_is_not_followed():
    pictures, background = film((0.9, -1.3), (1.2, -1.6))
    pictures = [0.6 * seen for seen in pictures]
    column = np.arange(SIZE[1])
    pictures[-1] = pictures[-1] * (1 - 0.4 / (1 + np.exp((column - 120) / 2)))
    pictures = [np.rint(seen).astype(np.uint8) for seen in pictures]
    *_, lit, found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)
    apart = np.abs(PLACES[:, 0] - 120)
    assert np.isfinite(lit).all()
    assert np.isnan(found[apart < WINDOW / 2]).all()
    assert found[apart > 2 * WINDOW].mean(axis=0) == pytest.approx([1.2, -1.6], abs=0.02)


@pytest.mark.parametrize(("gain", "added"), [(0.6, 0), (1.0, 12), (0.8, -8)])
def test_light_that_falls_evenly_takes_no_window(gain, added):
    """A hand darkens what it comes near to, and lights it by what it reflects."""
    pictures, background = film((0.9, -1.3))
    pictures = [0.5 * seen.astype(float) for seen in pictures]
    pictures[-1] = gain * pictures[-1] + added
    pictures = [np.rint(np.clip(seen, 0, 255)).astype(np.uint8) for seen in pictures]
    found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)[4]
    assert np.isfinite(found).mean() > 0.95


def test_an_arm_that_covers_the_background_now_and_then():
    pictures, background = film((0.9, -1.3))
    uncovered = background.astype(float)
    uncovered[:60] *= 0.8
    edge = np.array([[x, 40 + WINDOW / 2 - 2] for x in range(60, 200, 10)])
    found = picture_flow(pictures, np.arange(4), edge, uncovered, window_px=WINDOW)
    assert np.isnan(found).all()
    none = picture_flow(pictures, np.arange(4), np.zeros((0, 2)), uncovered, window_px=WINDOW)
    assert none.shape == (5, 0, 2)


def test_the_share_of_pictures_in_which_no_mask_covers_a_pixel():
    first, second = np.zeros((2, 3, 4), dtype=bool)
    first[0], second[:, 1] = True, True
    expected = [[0.5, 0, 0.5, 0.5], [1, 0.5, 1, 1], [1, 0.5, 1, 1]]
    assert uncovered_share([first, second]).tolist() == expected
