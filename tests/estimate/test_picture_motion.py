"""Surface displacement from pictures: along which directions, how far, how well, and where."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from made_up_indentation import displacement_of
from palpate.estimate.direct.motion import MotionAlong, load_motion, save_motion
from palpate.estimate.direct.observe import Pictures, with_pictures
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import ProbeInView
from palpate.surface.alignment import Alignment
from palpate.vision.camera import PinholeCamera
from scipy.ndimage import fourier_shift

CAMERA = PinholeCamera(320, 240, 300.0, 300.0, 160.0, 120.0)
# A flat that faces the camera half a metre away; its object frame is turned by a quarter.
POSE = np.array([[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1.0]])
REST, MOVED_PX = 4, np.array([0.8, -0.5])
ALIGNED = Alignment(POSE, np.zeros(3), REST, None)


def motion():
    """Samples that don't move along their normals."""
    x, y = (one.ravel() for one in np.mgrid[-0.08:0.081:0.02, -0.08:0.081:0.02])
    cell = np.column_stack([x, y, 0 * x])
    normal = np.tile([0.0, 0, -1], (len(cell), 1))
    return displacement_of(cell, normal, np.zeros((REST + 1, len(cell))), REST)


def probe(tip_m=(0.3, 0.3, -0.1)):
    frames = REST + 1
    tips, axes = np.tile(tip_m, (frames, 1)), np.tile([0.0, 0, 1], (frames, 1))
    return ProbeInView(np.array([[0.0, 0, -0.5]]), tips, axes)


def pictures(contrast=30.0):
    rng = np.random.default_rng(1)
    grain = cv2.GaussianBlur(rng.normal(size=(240, 320)), (0, 0), 1.5)
    grain *= contrast / grain.std()
    moved = np.fft.ifft2(fourier_shift(np.fft.fft2(grain), MOVED_PX[::-1])).real
    seen = [grain] * REST + [moved]
    noisy = [120 + one + rng.normal(0, 1.5, one.shape) for one in seen]
    images = [np.clip(one, 0, 255).astype(np.uint8) for one in noisy]
    return Pictures(images, CAMERA, np.zeros((240, 320), dtype=bool))


def test_material_moves_across_the_line_of_sight():
    found = with_pictures(motion(), ALIGNED, pictures(), probe(), Observation())
    # A pixel is half a metre over 300, along the picture's columns and rows.
    near = np.linalg.norm(found.cell_m, axis=1) < 0.03
    assert found.across[:, near] @ POSE[:3, :3].T == pytest.approx(
        np.broadcast_to(np.eye(3)[:2, None], (2, near.sum(), 3)), abs=0.06
    )
    sight = found.cell_m - [0, 0, -0.5]
    assert (found.across * sight).sum(axis=-1) == pytest.approx(0, abs=1e-7)
    expected = MOVED_PX * 0.5 / 300
    seen = np.isfinite(found.across_m[-1]).all(axis=0)
    assert seen.mean() > 0.9
    assert np.median(found.across_m[-1][:, seen], axis=1) == pytest.approx(expected, abs=3e-5)
    assert (found.across_std_m[:, seen] < 1e-4).all()
    sides = found.window_m[:, near] / 1000 @ POSE[:3, :3].T
    places = found.cell_m[near] @ POSE[:3, :3].T + POSE[:3, 3]
    moved_px = [1000 * (CAMERA.project(places + side) - CAMERA.project(places)) for side in sides]
    assert np.array(moved_px) == pytest.approx(
        np.broadcast_to(13 * np.eye(2)[:, None], (2, near.sum(), 2)), abs=0.05
    )
    error = found.across_m[-1][:, seen & near] - expected[:, None]
    assert np.abs(error).max() < 5 * found.across_std_m[:, seen & near].max()


def repeated(shown):
    return replace(shown, images=[shown.images[0]] * len(shown.images))


@pytest.mark.parametrize(
    "shown", [pictures(0.0), repeated(pictures())], ids=["no texture", "repeated picture"]
)
def test_pictures_that_show_no_displacement(shown):
    found = with_pictures(motion(), ALIGNED, shown, probe(), Observation())
    assert not np.isfinite(found.across_m).any()


def test_nothing_is_seen_past_the_probe():
    hidden = with_pictures(motion(), ALIGNED, pictures(), probe((0, 0, -0.01)), Observation())
    near = np.linalg.norm(hidden.cell_m, axis=1) < 0.015
    assert near.any() and not np.isfinite(hidden.across_m[:, :, near]).any()


@pytest.mark.parametrize("hovers", [False, True])
def test_what_moves_with_the_probe_before_the_touch_is_not_the_surface(hovers):
    """A part of the picture goes down with the probe: an arm, or the edge of its shadow."""
    shown, view = pictures(), probe()
    way_m = np.array([0.015, 0.01, 0.005, 0.0, 0.0])
    images = [image.copy() for image in shown.images]
    for image, way in zip(images, way_m, strict=True):
        lower = np.fft.fft2(image[:, 160:].astype(float))
        gone = np.fft.ifft2(fourier_shift(lower, (20 * (way_m[0] - way), 0))).real
        image[:, 160:] = np.clip(gone, 0, 255).astype(np.uint8)
    if not hovers:
        view = replace(view, tip_m=view.tip_m - way_m[:, None] * view.axis)
    found = with_pictures(motion(), ALIGNED, replace(shown, images=images), view, Observation())
    column_px = CAMERA.project(found.cell_m @ POSE[:3, :3].T + POSE[:3, 3])[:, 0]
    seen = np.isfinite(found.across_m[-1]).all(axis=0)
    assert seen[column_px < 145].mean() > 0.9
    assert seen[column_px > 175].mean() > 0.9 if hovers else not seen[column_px > 175].any()


def test_motions_are_written_and_taken_apart(tmp_path):
    found = with_pictures(motion(), ALIGNED, pictures(), probe(), Observation())
    save_motion(tmp_path / "motion.npz", found)
    again = load_motion(tmp_path / "motion.npz")
    assert all(np.array_equal(getattr(again, k), v, equal_nan=True) for k, v in vars(found).items())
    each = MotionAlong.of(again)
    assert np.array_equal(each.moved_m[:, each.axis == 2], found.across_m[:, 1], equal_nan=True)
    assert np.array_equal(np.isfinite(each.std_m), np.isfinite(each.moved_m))
    assert MotionAlong.of(motion()).way.shape == found.cell_m.shape


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda shown: {"images": shown.images[1:]}, "frames: expected 4, one a picture, found"),
        (lambda shown: {"uncovered": np.zeros((24, 32), dtype=bool)}, "mask: expected"),
    ],
    ids=["a picture too few", "mask of another size"],
)
def test_pictures_of_another_recording(change, message):
    shown = pictures()
    with pytest.raises(ValueError, match=message):
        with_pictures(motion(), ALIGNED, replace(shown, **change(shown)), probe(), Observation())
