"""Masks of a synthetic scene with a known mask and a shadow."""

import numpy as np
import pytest
from palpate.vision.background import build_model, classify, load_model, save_model

OPTIONS = {
    "alpha_low": 0.55,
    "alpha_high": 1.5,
    "opening_px": 3,
    "closing_px": 7,
    "smallest_blob_px": 100,
}


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
    found = classify(model, image, **OPTIONS)
    assert (found & mask).sum() / (found | mask).sum() > 0.97
    assert not found[85:105, 30:140].any()


def test_black_part_of_the_object_is_foreground(scene):
    frames, image, _ = scene
    model = build_model(frames, false_positive_rate=0.002)
    assert classify(model, image, **OPTIONS)[42:48, 62:78].all()


def test_background_is_background_at_about_the_stated_rate(scene):
    frames, _, _ = scene
    model = build_model(frames[:-1], false_positive_rate=0.002)
    assert not classify(model, frames[-1], **OPTIONS).any()


def test_constant_pixels_are_guarded():
    frames = [np.full((40, 40, 3), 100, np.uint8)] * 6
    model = build_model(frames, false_positive_rate=0.01)
    assert np.isfinite(model.threshold)
    assert not classify(model, frames[0], **OPTIONS).any()


def test_model_round_trip(scene, tmp_path):
    frames, image, _ = scene
    model = build_model(frames, false_positive_rate=0.002)
    save_model(tmp_path / "m.npz", model)
    again = load_model(tmp_path / "m.npz")
    assert np.array_equal(classify(again, image, **OPTIONS), classify(model, image, **OPTIONS))


def test_bad_input(scene):
    frames, image, _ = scene
    with pytest.raises(ValueError, match="at least 4 background frames, found 3"):
        build_model(frames[:3], false_positive_rate=0.01)
    model = build_model(frames, false_positive_rate=0.01)
    with pytest.raises(ValueError, match="expected the background's shape"):
        classify(model, image[:50], **OPTIONS)
