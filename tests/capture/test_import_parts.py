"""Pairs, lenses and pictures by themselves."""

import cv2
import numpy as np
import pytest
from bag_writing import Messages
from palpate.capture.importing.optics import coefficients
from palpate.capture.importing.pixels import file_form, form_of
from palpate.capture.importing.recording import paired

K = np.array([640.0, 0, 645, 0, 640, 361, 0, 0, 1])


def test_pairs_are_mutual_and_within_half_a_frame():
    color = np.array([0, 100, 200, 300, 400, 500])
    depth = np.array([10, 112, 390, 405, 540, 900])
    pairs = paired(color, depth)
    assert pairs.color.tolist() == [0, 1, 4, 5]
    assert pairs.depth.tolist() == [0, 1, 3, 4]
    assert (pairs.within_ns, pairs.farthest_ns) == (50, 40)


def test_pairs_halfway_and_out_of_order():
    times = np.arange(6) * 100
    pairs = paired(times, times + 50)
    assert pairs.color.tolist() == pairs.depth.tolist() == [0, 1, 2, 3, 4, 5]
    order = np.array([3, 0, 5, 1, 4, 2])
    pairs = paired(times[order], times)
    assert times[order][pairs.color].tolist() == times.tolist()
    assert times[pairs.depth].tolist() == times.tolist()


def test_stamps_that_do_not_move():
    with pytest.raises(ValueError, match="color: stamps: expected times that move, found 0"):
        paired(np.zeros(5, int), np.arange(5))
    with pytest.raises(ValueError, match="depth: expected at least 2 images, found 1"):
        paired(np.arange(5), np.arange(1))


def test_inverse_lens_of_a_realsense():
    """The SDK takes rays to the image with its five, all but as OpenCV does with the same."""
    stated = np.array([-0.0567, 0.0665, 0.0006, 0.0002, -0.0214])
    found = coefficients("Inverse Brown Conrady", stated)
    assert found == stated.tolist()
    x, y = np.random.default_rng(1).uniform(-0.5, 0.5, (2, 50))
    k1, k2, p1, p2, k3 = stated
    r2 = x**2 + y**2
    u, v = (part * (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) for part in (x, y))
    u, v = (
        u + 2 * p1 * u * v + p2 * (r2 + 2 * u**2),
        v + 2 * p2 * u * v + p1 * (r2 + 2 * v**2),
    )
    rays = np.column_stack([x, y, np.ones(50)])
    pixels, _ = cv2.projectPoints(rays, *np.zeros((2, 3)), K.reshape(3, 3), np.array(found))
    expected = np.column_stack([K[0] * u + K[2], K[4] * v + K[5]])
    np.testing.assert_allclose(pixels.reshape(-1, 2), expected, rtol=0, atol=0.05)


def test_lenses_are_kept_as_opencv_has_them():
    rational = [0.0757, -2.48, 0.0007, -0.0002, 1.454, -0.045, -2.296, 1.379]
    assert coefficients("rational_polynomial", rational) == rational
    assert coefficients("plumb_bob", rational[:4]) == [*rational[:4], 0.0]
    assert coefficients("", []) == coefficients("None", [0.0] * 5) == [0.0] * 5
    with pytest.raises(ValueError, match="found equidistant with 4"):
        coefficients("equidistant", [0.0] * 4)
    with pytest.raises(ValueError, match="D: expected finite numbers"):
        coefficients("plumb_bob", [np.nan] * 5)
    with pytest.raises(ValueError, match="distortion_model: expected .*, found equidistant with 4"):
        coefficients("equidistant", rational[:4])


def test_pictures_that_are_none():
    with pytest.raises(ValueError, match="image: expected PNG or JPEG, found neither"):
        file_form(b"GIF89a" + bytes(100))
    messages = Messages(ros1=False)
    image = messages.image(np.zeros((48, 64), np.uint8), 0, "")
    image.width = 2**31
    with pytest.raises(ValueError, match="image: expected 16 to 16384 pixels, found 2147483648"):
        form_of(image)
    image.encoding = "64FC1"
    with pytest.raises(ValueError, match="encoding: expected one of .* found 64FC1"):
        form_of(image)
    codec = messages.compressed(bytes(20), 0, "", "32FC1; compressedDepth png")
    with pytest.raises(ValueError, match="format: expected 16UC1; compressedDepth png"):
        form_of(codec)
