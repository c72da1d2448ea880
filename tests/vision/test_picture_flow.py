"""Places followed in pictures: by parts of a pixel, past shake and light, or not at all."""

import cv2
import numpy as np
import pytest
from palpate.vision.flow import never_covered, picture_flow
from scipy.ndimage import fourier_shift

SIZE, WINDOW = (200, 260), 15
PLACES = np.array([[x, y] for x in range(60, 200, 20) for y in range(60, 150, 15)], dtype=float)


def texture(seed=1):
    grain = np.random.default_rng(seed).uniform(0, 255, SIZE).astype(np.float32)
    soft = cv2.GaussianBlur(grain, (0, 0), 1.5)
    return 40 + 160 * (soft - soft.min()) / np.ptp(soft)


def shifted(image, x, y):
    """Exactly, but for what comes in at the other end."""
    return np.fft.ifft2(fourier_shift(np.fft.fft2(image), (y, x))).real


def film(*moves, light=1.0, shake=(0.0, 0.0)):
    """Pictures of an object in the middle that moves, before a background that does not."""
    noise, inside = np.random.default_rng(2), np.zeros(SIZE, dtype=bool)
    inside[40:160, 40:220] = True
    pictures = []
    for k, move in enumerate([(0, 0)] * 4 + list(moves)):
        seen = np.where(inside, shifted(texture(), *move), texture(3))
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


def test_what_is_covered_or_without_texture_is_not_found():
    pictures, background = film((0.5, 0.0))
    pictures[-1][80:130, 100:150] = 90
    found = picture_flow(pictures, np.arange(4), PLACES, background, window_px=WINDOW)
    inside = (np.abs(PLACES - [125, 105]) < [18, 18]).all(axis=1)
    assert inside.any() and not np.isfinite(found[-1, inside]).any()
    assert np.isfinite(found[-1, np.abs(PLACES - [125, 105]).max(axis=1) > 45]).all()


def test_pixels_that_no_mask_covers():
    first, second = np.zeros((2, 3, 4), dtype=bool)
    first[0], second[:, 1] = True, True
    assert never_covered([first, second]).tolist() == (~(first | second)).tolist()
