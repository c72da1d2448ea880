"""Masks of a synthetic scene with a known mask and a shadow."""

import tracemalloc
from collections.abc import Sequence

import cv2
import numpy as np
import pytest
from palpate.vision.background import (
    BackgroundModel,
    build_model,
    distortion,
    load_model,
    save_model,
)
from palpate.vision.foreground import Classifier, camera_shift, load_masks, masks_of, save_masks
from palpate.vision.options import Background

OPTIONS = Background(alpha_low=0.55, alpha_high=1.25, smallest_blob_px=100)


def largest(shifts):
    """Of the picture's corners, the longest shift."""
    return np.linalg.norm(shifts, axis=1).max()


def model_of(frames):
    return build_model(frames, false_positive_rate=0.002)


def classify(model, image):
    return Classifier(model, OPTIONS)(image)


def shot(rng, scene, noise=1.2):
    """A picture of a scene with a camera's noise."""
    noisy = scene + rng.normal(0, noise, scene.shape)
    return np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def overlap(found, mask):
    return (found & mask).sum() / (found | mask).sum()


def smooth(rng, shape, width, contrast):
    """A soft texture."""
    return np.clip(
        128 + contrast * (cv2.GaussianBlur(rng.uniform(0, 255, shape), (0, 0), width) - 128), 0, 255
    )


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(3)
    table = np.array([150.0, 120.0, 95.0]) * rng.uniform(0.8, 1.2, (120, 160, 1))
    frames = [shot(rng, table) for _ in range(10)]
    image = table.copy()
    image[70:110, 20:150] *= 0.75
    mask = np.zeros((120, 160), bool)
    mask[30:80, 40:120] = True
    image[mask] = np.array([110.0, 130.0, 165.0])
    image[40:50, 60:80] = 6.0
    return frames, shot(rng, image), mask, model_of(frames)


def test_object_is_foreground_and_shadow_is_not(scene):
    frames, image, mask, model = scene
    found = classify(model, image)
    assert overlap(found, mask) > 0.97
    assert not found[85:105, 30:140].any()
    # Its black part too, whose chromaticity says nothing.
    assert found[42:48, 62:78].all()
    assert not classify(model_of(frames[:-1]), frames[-1]).any()


@pytest.mark.parametrize("count", [6, 12, 40])
def test_the_stated_rate_of_false_positives_is_kept(count):
    rng = np.random.default_rng(count)
    table = rng.uniform(60, 190, (120, 160, 3))

    def flickering():
        return shot(rng, table * (1 + rng.normal(0, 0.003)), 1.5)

    model = build_model([flickering() for _ in range(count)], false_positive_rate=0.01)
    rates = []
    for _ in range(10):
        brightness, chroma = distortion(model, flickering())
        bright = np.abs(brightness) > model.brightness_threshold
        rates.append([(chroma > model.threshold).mean(), bright.mean()])
    chroma_rate, brightness_rate = np.mean(rates, axis=0)
    assert 0.004 < chroma_rate < 0.02
    assert 0.002 < brightness_rate < 0.03


@pytest.mark.parametrize("level", [40, 120, 225])
def test_grey_images(level):
    """No chromaticity, no noise of it; what differs in brightness is foreground."""
    rng = np.random.default_rng(level)
    table = level + 20 * rng.random((120, 160))
    frames = [shot(rng, table) for _ in range(13)]
    classifier = Classifier(model_of(frames[:-1]), OPTIONS)
    assert classifier.pixels(frames[-1]).mean() < 0.01
    image, mask = frames[-1].copy(), np.zeros((120, 160), bool)
    image[30:80, 40:120], mask[30:80, 40:120] = level // 2, True
    assert overlap(classifier(image), mask) > 0.97


def test_the_mask_ends_where_half_of_a_pixel_is_foreground():
    """A lens's blur reaches beyond the object; the mask does not."""
    rng = np.random.default_rng(6)
    table = np.full((150, 150, 3), [150.0, 120.0, 95.0])
    frames = [shot(rng, table, 1) for _ in range(12)]
    y, x = np.mgrid[:150, :150]
    disc = np.hypot(x - 75, y - 75) < 40
    share = cv2.GaussianBlur(disc.astype(float), (0, 0), 1.2)[..., None]
    image = table * (1 - share) + np.array([70.0, 90.0, 140.0]) * share
    found = classify(model_of(frames), shot(rng, image, 1))
    assert overlap(found, disc) > 0.985
    assert abs(found.sum() / disc.sum() - 1) < 0.01


def test_noise_of_a_black_background_is_no_foreground():
    rng = np.random.default_rng(5)
    frames = [shot(rng, np.full((60, 80, 3), 1.5), 1) for _ in range(12)]
    classifier = Classifier(model_of(frames[:-1]), OPTIONS)
    assert classifier.pixels(frames[-1]).mean() < 0.02
    assert classifier(np.full((60, 80, 3), 90, np.uint8)).all()


def test_small_blobs_are_dropped_and_small_holes_filled(scene):
    frames, image, _, model = scene
    image = image.copy()
    # Of 144 and of 64 pixels, on the table and in the object.
    image[5:17, 5:17] = image[5:13, 140:148] = 250
    image[55:67, 60:72], image[55:63, 90:98] = frames[0][55:67, 60:72], frames[0][55:63, 90:98]
    found = classify(model, image)
    assert found[7:15, 7:15].all() and not found[3:15, 138:150].any()
    assert not found[57:65, 62:70].any() and found[53:65, 88:100].all()


class Lazy(Sequence):
    """Background frames made when they are asked for."""

    def __init__(self, count):
        self.count = count

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        if k >= self.count:
            raise IndexError
        return np.random.default_rng(k).integers(100, 110, (120, 160, 3), dtype=np.uint8)


def test_memory_does_not_grow_with_the_number_of_frames():
    peaks = []
    for count in (8, 64):
        tracemalloc.start()
        model_of(Lazy(count))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.02 * peaks[0]


@pytest.mark.parametrize("turn", [0.0, 0.003])
def test_a_picture_that_grew_or_rolled_is_off_by_its_farthest_tile(turn):
    """About its upper left corner by 0.4 %, or by 3 mrad: seen 448 px across and 320 px down."""
    wide = smooth(np.random.default_rng(4), (384, 512), 3, 6)
    part = 1.0 if turn else 1.004
    motion = part * np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0]])
    now = cv2.warpAffine(wide, motion, (512, 384), flags=cv2.INTER_CUBIC, borderMode=2)
    still = np.zeros((384, 512), bool)
    shift = largest(camera_shift(wide[..., None], np.ones(wide.shape), now, still))
    assert shift == pytest.approx((turn or 0.004) * np.hypot(448, 320), rel=0.08)
    # Tiles that are mostly covered, or that show nothing, say nothing.
    covered = still.copy()
    covered[:, 128:] = True
    assert camera_shift(wide[..., None], np.ones(wide.shape), now, covered) is None


def test_masks_of_a_recording(scene):
    frames, image, _, model = scene
    found = list(masks_of([image, image], model, OPTIONS))
    assert len(found) == 2
    assert np.array_equal(found[1], classify(model, image))
    with pytest.raises(ValueError, match="mask: expected foreground in each frame, found none in"):
        list(masks_of([image, frames[-1]], model, OPTIONS))
    elsewhere = np.full_like(image, 250)
    elsewhere[:, :20] = image[:, :20]
    with pytest.raises(ValueError, match="found 8[78]% foreground in frame 0"):
        list(masks_of([elsewhere, image], model, OPTIONS))


def test_model_and_masks_round_trip(scene, tmp_path):
    _, image, _, model = scene
    save_model(tmp_path / "m.npz", model)
    assert np.array_equal(classify(load_model(tmp_path / "m.npz"), image), classify(model, image))
    rng = np.random.default_rng(0)
    masks = [rng.random((5, width)) > 0.5 for width in (16, 19, 7)]
    save_masks(tmp_path / "mask.npz", iter(masks))
    again = load_masks(tmp_path / "mask.npz")
    assert len(again) == 3
    assert all(np.array_equal(one, other) for one, other in zip(masks, again, strict=True))


def test_bad_input(scene):
    frames, image, _, model = scene
    with pytest.raises(ValueError, match="at least 4 background frames, found 3"):
        model_of(frames[:3])
    with pytest.raises(ValueError, match="with a camera's noise, found copies of one"):
        model_of(frames[:1] * 6)
    with pytest.raises(ValueError, match="frame 4: expected shape"):
        model_of([*frames[:3], image[:50]])
    with pytest.raises(ValueError, match="expected the background's shape"):
        classify(model, image[:50])


def soft_recording(contrast, noise, motion, seed):
    """A model of a soft texture, and nine frames of it of which the last five were moved."""
    rng = np.random.default_rng(seed)
    soft = cv2.GaussianBlur(rng.normal(0, 1, (480, 640)), (0, 0), 3)
    soft = 128 + contrast * soft / soft.std()
    moved = cv2.warpAffine(soft, motion, (640, 480), flags=cv2.INTER_CUBIC, borderMode=2)
    model = model_of([shot(rng, soft, noise) for _ in range(6)])
    frames = [shot(rng, part, noise) for part in [soft] * 4 + [moved] * 5]
    for frame in frames:
        frame[200:260, 300:360] = 250
    return model, frames


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("contrast", "noise"), [(3, 1), (5, 2), (8, 2), (10, 2), (3, 3)])
def test_a_still_camera_over_a_soft_texture_is_still(contrast, noise, seed):
    model, frames = soft_recording(contrast, noise, np.eye(2, 3), seed)
    assert len(list(masks_of(frames, model, Background(largest_shift_px=0.5)))) == len(frames)


# By 2 mm, 0.7 m away and of 525 px of focal length; and about the picture's middle.
@pytest.mark.parametrize(
    "motion",
    [np.array([[1, 0, 1.5], [0, 1, 0]]), cv2.getRotationMatrix2D((320, 240), 0.4, 1)],
    ids=["2 mm", "0.4 degrees"],
)
@pytest.mark.parametrize(("contrast", "noise"), [(5, 1), (10, 2)])
def test_a_bump_over_a_soft_texture_is_found(contrast, noise, motion):
    model, frames = soft_recording(contrast, noise, motion, 1)
    with pytest.raises(ValueError, match="found it moved by [1-3].. px from frame 4 on"):
        list(masks_of(frames, model, Background(largest_shift_px=0.5)))


def projected(line, colours):
    """Alpha of colours along a line through black, and how far they are from it."""
    alpha = (line * colours).sum(axis=-1) / (line**2).sum(axis=-1)
    return alpha, np.linalg.norm(colours - alpha[..., None] * line, axis=-1)


def test_distortions_are_the_projection_and_its_rest():
    """Of a colour on its expected line (Eq. 4.15, 4.16), each axis in its deviations."""
    rng = np.random.default_rng(2)
    mean, std = rng.uniform(50, 150, (4, 5, 3)), rng.uniform(0.5, 2, (4, 5, 3))
    a, b = rng.uniform(0.01, 0.02, (4, 5)), rng.uniform(0.5, 2, (4, 5))
    image = rng.integers(0, 255, (4, 5, 3)).astype(np.uint8)
    brightness, chroma = distortion(BackgroundModel(mean, std, a, b, 3.0, 4.0), image)
    alpha, apart = projected(mean / std, image / std)
    assert brightness == pytest.approx((alpha - 1) / a)
    assert chroma == pytest.approx(apart / b)


def test_a_table_that_shows_nothing_is_said_to(caplog):
    rng, plain = np.random.default_rng(8), np.full((240, 320, 3), [150.0, 120.0, 95.0])
    model, frames = model_of([shot(rng, plain) for _ in range(6)]), [shot(rng, plain)] * 2
    for frame in frames:
        frame[100:140, 150:190] = [20, 120, 220]
    assert len(list(masks_of(frames, model, Background()))) == 2
    assert "whether it stood still is not known in 2 of 2 frames" in caplog.text
