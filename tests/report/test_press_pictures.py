"""Small pictures of a press: which frames they are, and what is drawn in them."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from palpate.report.press_pictures import FOUND, MEASURED, OUTLINE, WIDTH_PX, Frames, glimpses
from palpate.vision.camera import PinholeCamera

CAMERA = PinholeCamera(80, 60, 100.0, 100.0, 40.0, 30.0)
FORCE_N = np.array([0.0, 0.4, 1.1, 2.0, 1.9])


def frames(photo_shape=(60, 80, 3), tip=(0.0, 0.0, 1.0)):
    """A disc in the middle of grey pictures, and a square patch of a cloud on it."""
    rows, columns = np.mgrid[:60, :80]
    disc = (rows - 30) ** 2 + (columns - 40) ** 2 < 12**2
    side = np.linspace(-0.1, 0.1, 9)
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    cloud = SimpleNamespace(points_m=np.column_stack([x, y, 1 + 0.1 * x]))
    count = len(FORCE_N)
    return Frames(
        photos=[np.full(photo_shape, 128, np.uint8)] * count,
        masks=[disc] * count,
        tips_m=np.tile(tip, (count, 1)),
        axes=np.tile([0.0, 1.0, 0.0], (count, 1)),
        clouds=[cloud] * count,
        camera=CAMERA,
        force_n=FORCE_N,
    )


def decoded(one):
    return cv2.imdecode(np.frombuffer(one.jpeg, np.uint8), cv2.IMREAD_COLOR)


def test_three_frames_twice_the_deepest_first():
    """Then the one nearest half the force, and the first; a tip that was not found is no matter."""
    found = list(glimpses(frames(), 3, "cam 1"))
    for one, said in zip(found, ["4 of 5", "3 of 5", "1 of 5"] * 2, strict=True):
        assert said in one.caption and ("81 points" in one.caption) == (one.shows == MEASURED)
    assert [one.shows for one in found] == [FOUND] * 3 + [MEASURED] * 3
    assert list(glimpses(frames(), 3, "cam 1")) == found
    assert len(list(glimpses(frames(tip=(np.nan,) * 3), 3, "cam 1"))) == 6


@pytest.mark.parametrize("shape", [(60, 80, 3), (60, 80)])
def test_outline_and_tip_are_drawn_around_the_object(shape):
    image = decoded(next(glimpses(frames(shape), 3, "cam 1")))
    assert image.shape[1] == WIDTH_PX
    # The window is the 20 px of the cloud and, on each side, a part of the 25 px up to the board.
    near = np.linalg.norm(image.astype(float) - OUTLINE[::-1], axis=2) < 120
    across = np.flatnonzero(near[image.shape[0] // 2])
    assert np.ptp(across) / WIDTH_PX == pytest.approx(22 / 36, rel=0.1)
    assert image.shape[0] > image.shape[1]


def test_near_and_far_points_differ():
    image = decoded(list(glimpses(frames(), 3, "cam 1"))[3]).astype(float)
    # Points have gaps between them: the brightest in each half is one.
    middle = image[image.shape[0] // 2].mean(axis=1)
    left, right = np.split(middle, 2)
    assert right.max() > left.max() + 40
