"""Masks of a synthetic scene with a known mask and a shadow."""

import tracemalloc

import cv2
import numpy as np
import pytest
from palpate.vision.background import build_model, distortion, load_model, save_model
from palpate.vision.foreground import (
    Classifier,
    _require_still,
    load_masks,
    masks_of,
    save_masks,
)
from palpate.vision.options import Background
from palpate.vision.stillness import camera_shift

OPTIONS = {
    "alpha_low": 0.55,
    "alpha_high": 1.25,
    "smallest_blob_px": 100,
}


def largest(shifts):
    """Of the picture's corners, the longest shift."""
    return np.linalg.norm(shifts, axis=1).max()


def classify(model, image):
    return Classifier(model, **OPTIONS)(image)


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(3)
    table = np.array([150.0, 120.0, 95.0]) * rng.uniform(0.8, 1.2, (120, 160, 1))
    frames = [np.clip(np.round(table + rng.normal(0, 1.2, table.shape)), 0, 255) for _ in range(10)]
    image = table.copy()
    image[70:110, 20:150] *= 0.75
    mask = np.zeros((120, 160), bool)
    mask[30:80, 40:120] = True
    image[mask] = np.array([110.0, 130.0, 165.0])
    image[40:50, 60:80] = 6.0
    image = np.clip(np.round(image + rng.normal(0, 1.2, image.shape)), 0, 255)
    return [frame.astype(np.uint8) for frame in frames], image.astype(np.uint8), mask


def test_object_is_foreground_and_shadow_is_not(scene):
    frames, image, mask = scene
    model = build_model(frames, false_positive_rate=0.002)
    found = classify(model, image)
    assert (found & mask).sum() / (found | mask).sum() > 0.97
    assert not found[85:105, 30:140].any()


def test_black_part_of_the_object_is_foreground(scene):
    frames, image, _ = scene
    model = build_model(frames, false_positive_rate=0.002)
    assert classify(model, image)[42:48, 62:78].all()


def test_background_is_background_at_about_the_stated_rate(scene):
    frames, _, _ = scene
    model = build_model(frames[:-1], false_positive_rate=0.002)
    assert not classify(model, frames[-1]).any()


@pytest.mark.parametrize("count", [6, 12, 40])
def test_the_stated_rate_of_false_positives_is_kept(count):
    rng = np.random.default_rng(count)
    table = rng.uniform(60, 190, (120, 160, 3))

    def shot():
        noisy = table * (1 + rng.normal(0, 0.003)) + rng.normal(0, 1.5, table.shape)
        return np.round(noisy).astype(np.uint8)

    model = build_model([shot() for _ in range(count)], false_positive_rate=0.01)
    rates = []
    for _ in range(10):
        brightness, chroma = distortion(model, shot())
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
    frames = [np.round(table + rng.normal(0, 1.2, table.shape)).astype(np.uint8) for _ in range(13)]
    model = build_model(frames[:-1], false_positive_rate=0.002)
    classifier = Classifier(model, **OPTIONS)
    assert classifier.pixels(frames[-1]).mean() < 0.01
    image = frames[-1].copy()
    image[30:80, 40:120] = level // 2
    mask = np.zeros(image.shape, bool)
    mask[30:80, 40:120] = True
    found = classifier(image)
    assert (found & mask).sum() / (found | mask).sum() > 0.97


def test_the_mask_ends_where_half_of_a_pixel_is_foreground():
    """A lens's blur reaches beyond the object; the mask does not."""
    rng = np.random.default_rng(6)
    table = np.full((150, 150, 3), [150.0, 120.0, 95.0])
    frames = [np.round(table + rng.normal(0, 1, table.shape)).astype(np.uint8) for _ in range(12)]
    y, x = np.mgrid[:150, :150]
    disc = np.hypot(x - 75, y - 75) < 40
    share = cv2.GaussianBlur(disc.astype(float), (0, 0), 1.2)[..., None]
    image = table * (1 - share) + np.array([70.0, 90.0, 140.0]) * share
    image = np.round(image + rng.normal(0, 1, image.shape)).astype(np.uint8)
    found = classify(build_model(frames, false_positive_rate=0.002), image)
    assert (found & disc).sum() / (found | disc).sum() > 0.985
    assert abs(found.sum() / disc.sum() - 1) < 0.01


def test_noise_of_a_black_background_is_no_foreground():
    rng = np.random.default_rng(5)
    dark = np.full((60, 80, 3), 1.5)
    frames = [np.clip(np.round(dark + rng.normal(0, 1, dark.shape)), 0, 255) for _ in range(12)]
    model = build_model([f.astype(np.uint8) for f in frames[:-1]], false_positive_rate=0.002)
    found = Classifier(model, **OPTIONS).pixels(frames[-1].astype(np.uint8))
    assert found.mean() < 0.02
    bright = np.full((60, 80, 3), 90, np.uint8)
    assert classify(model, bright).all()


class Lazy:
    """Background frames made when they are asked for."""

    def __init__(self, count):
        self.count = count

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        return np.random.default_rng(k).integers(100, 110, (120, 160, 3), dtype=np.uint8)


def test_memory_does_not_grow_with_the_number_of_frames():
    peaks = []
    for count in (8, 64):
        tracemalloc.start()
        build_model(Lazy(count), false_positive_rate=0.002)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.02 * peaks[0]


def test_a_camera_that_moved_is_told(scene):
    rng = np.random.default_rng(4)
    wide = cv2.GaussianBlur(rng.uniform(0, 255, (400, 560, 3)), (0, 0), 2)
    wide = np.clip(128 + 4 * (wide - 128), 0, 255).astype(np.uint8)
    still, moved = wide[8:-8, 8:-8], wide[6:-10, 5:-11]
    nothing, noise = np.zeros(still.shape[:2], bool), np.ones(still.shape)
    nothing[100:200, 200:300] = True
    assert largest(camera_shift(still, noise, moved, nothing)) == pytest.approx(
        np.hypot(2, 3), abs=0.1
    )
    assert largest(camera_shift(still, noise, still, nothing)) < 0.01
    plain = np.full((400, 560), 90, np.uint8)
    assert camera_shift(plain, noise, plain, np.zeros(plain.shape, bool)) is None


def test_model_round_trip(scene, tmp_path):
    frames, image, _ = scene
    model = build_model(frames, false_positive_rate=0.002)
    save_model(tmp_path / "m.npz", model)
    again = load_model(tmp_path / "m.npz")
    assert np.array_equal(classify(again, image), classify(model, image))


def test_masks_of_a_film(scene):
    frames, image, _ = scene
    model, options = build_model(frames, false_positive_rate=0.002), Background(**OPTIONS)
    found = list(masks_of([image, image], model, options))
    assert len(found) == 2
    assert np.array_equal(found[1], classify(model, image))
    with pytest.raises(ValueError, match="mask: expected foreground in each frame, found none in"):
        list(masks_of([image, frames[-1]], model, options))
    elsewhere = np.full_like(image, 250)
    elsewhere[:, :20] = image[:, :20]
    with pytest.raises(ValueError, match="found 8[78]% foreground in frame 0"):
        list(masks_of([elsewhere, image], model, options))


@pytest.mark.parametrize("turn", [0.0, 0.003])
def test_a_picture_that_grew_or_rolled_is_off_by_its_farthest_tile(turn):
    """About its upper left corner by 0.4 %, or by 3 mrad: seen 448 px across and 320 px down."""
    rng = np.random.default_rng(4)
    wide = cv2.GaussianBlur(rng.uniform(0, 255, (384, 512)), (0, 0), 3)
    wide = np.clip(128 + 6 * (wide - 128), 0, 255)
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


def test_a_camera_that_moved_at_the_end_of_a_film():
    rng = np.random.default_rng(4)
    grey = cv2.GaussianBlur(rng.uniform(0, 255, (272, 272, 1)), (0, 0), 3)
    wide = np.clip(128 + 4 * (grey - 128), 60, 200)[..., None] * [1.0, 0.9, 0.8]

    def shot(place, with_object=True):
        picture = wide[place : place + 256, 8:264].copy()
        if with_object:
            picture[20:50, 20:50] = [5, 120, 250]
        return np.round(picture + rng.normal(0, 1, picture.shape)).astype(np.uint8)

    model = build_model([shot(8, False) for _ in range(6)], false_positive_rate=0.002)
    with pytest.raises(ValueError, match="found it moved by 1.0 px from frame 2 on"):
        film = [shot(8), shot(8), *(shot(9) for _ in range(3))]
        list(masks_of(film, model, Background(largest_shift_px=0.5)))


def test_a_limit_goes_with_what_a_median_of_frames_that_shake_may_be():
    """A median of five scatters by a fifth more than a mean: of 3 deviations 2 in 1000 are left."""
    rng, shake_px = np.random.default_rng(11), 0.4
    medians = np.median(rng.normal(0, shake_px, (20_000, 5)), axis=1)
    shaking = [np.tile(x, (4, 1)) for x in rng.normal(0, shake_px, (4000, 2))]

    def refused(by_px):
        # Moved along x alone, at the end of a long film of known shake.
        try:
            _require_still([*shaking, *[np.tile([by_px, 0.0], (4, 1))] * 5], 0.0, at_end=True)
        except ValueError:
            return True
        return False

    assert (medians > 3 * medians.std()).mean() < 0.004
    assert not refused(2.8 * medians.std()) and refused(3.4 * medians.std())


def test_a_camera_that_shakes_did_not_move():
    """A stand that trembles by 0.35 px of deviation, and then is knocked by 2 px."""
    rng = np.random.default_rng(5)
    tremble = rng.normal(0, 0.35, (60, 1, 2)) + np.zeros((60, 4, 2))
    knocked = tremble + 2.0 * (np.arange(60) >= 40)[:, None, None]
    for k in range(1, 60):
        _require_still(list(tremble[:k]), 0.5, at_end=False)
    with pytest.raises(ValueError, match=r"moved by [23]\.\d px from frame (3[6-9]|4.) on"):
        for k in range(1, 60):
            _require_still(list(knocked[:k]), 0.5, at_end=False)
    # Without a tremble the limit is as stated.
    with pytest.raises(ValueError, match="within 0.5 px"):
        _require_still([np.full((4, 2), 0.4)] * 5, 0.5, at_end=True)


def test_masks_round_trip(tmp_path):
    rng = np.random.default_rng(0)
    masks = [rng.random((5, width)) > 0.5 for width in (16, 19, 7)]
    save_masks(tmp_path / "mask.npz", iter(masks))
    again = load_masks(tmp_path / "mask.npz")
    assert len(again) == 3
    assert all(np.array_equal(one, other) for one, other in zip(masks, again, strict=True))
    short = {"000000/mask": np.zeros((5, 2), np.uint8), "000000/shape": np.array([5, 17])}
    np.savez(tmp_path / "short.npz", **short)
    with pytest.raises(
        ValueError, match=r"expected the bits of \(h, w\), found uint8 \(5, 2\) for"
    ):
        load_masks(tmp_path / "short.npz")[0]


def test_bad_input(scene):
    frames, image, _ = scene
    with pytest.raises(ValueError, match="at least 4 background frames, found 3"):
        build_model(frames[:3], false_positive_rate=0.01)
    model = build_model(frames, false_positive_rate=0.01)
    with pytest.raises(ValueError, match="expected the background's shape"):
        classify(model, image[:50])


def test_background_of_one_picture():
    frames = [np.random.default_rng(0).integers(0, 255, (40, 50, 3), dtype=np.uint8)] * 6
    with pytest.raises(ValueError, match="with a camera's noise, found copies of one"):
        build_model(frames, false_positive_rate=0.01)


def soft_film(contrast, noise, motion, seed):
    """A model of a soft texture, and nine frames of it of which the last five were moved."""
    rng = np.random.default_rng(seed)
    soft = cv2.GaussianBlur(rng.normal(0, 1, (480, 640)), (0, 0), 3)
    soft = 128 + contrast * soft / soft.std()
    moved = cv2.warpAffine(soft, motion, (640, 480), flags=cv2.INTER_CUBIC, borderMode=2)

    def shot(picture, thing=True):
        picture = picture + rng.normal(0, noise, picture.shape)
        if thing:
            picture[200:260, 300:360] = 250
        return np.clip(np.round(picture), 0, 255).astype(np.uint8)

    model = build_model([shot(soft, False) for _ in range(6)], false_positive_rate=0.002)
    return model, [shot(part) for part in [soft] * 4 + [moved] * 5]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("contrast", "noise"), [(3, 1), (5, 2), (8, 2), (10, 2), (3, 3)])
def test_a_still_camera_over_a_soft_texture_is_still(contrast, noise, seed):
    model, film = soft_film(contrast, noise, np.eye(2, 3), seed)
    assert len(list(masks_of(film, model, Background(largest_shift_px=0.5)))) == len(film)


# By 2 mm, 0.7 m away and of 525 px of focal length; and about the picture's middle.
@pytest.mark.parametrize(
    "motion",
    [np.array([[1, 0, 1.5], [0, 1, 0]]), cv2.getRotationMatrix2D((320, 240), 0.4, 1)],
    ids=["2 mm", "0.4 degrees"],
)
@pytest.mark.parametrize(("contrast", "noise"), [(5, 1), (10, 2)])
def test_a_bump_over_a_soft_texture_is_told(contrast, noise, motion):
    model, film = soft_film(contrast, noise, motion, 1)
    with pytest.raises(ValueError, match="found it moved by [1-3].. px from frame 4 on"):
        list(masks_of(film, model, Background(largest_shift_px=0.5)))
