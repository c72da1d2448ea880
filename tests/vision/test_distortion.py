"""Distortions of colours against a background, and what its thresholds count (Eq. 4.13-4.19)."""

import numpy as np
import pytest
from palpate.vision.background import BackgroundModel, build_model, distortion


def projected(line, colours):
    """Alpha of colours along a line through black, and how far they are from it."""
    alpha = (line * colours).sum(axis=-1) / (line**2).sum(axis=-1)
    return alpha, np.linalg.norm(colours - alpha[..., None] * line, axis=-1)


def deviation(frames):
    return np.maximum(np.std(frames, axis=0), 1 / np.sqrt(12))


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


def test_spreads_and_thresholds_of_a_model():
    """Root mean squares about the mean (Eq. 4.17), none below the typical; quantiles of frames.

    Each frame is compared with mean, deviation and distortions of all others.
    """
    rng = np.random.default_rng(4)
    table, noise = rng.uniform(80, 160, (6, 9, 3)), rng.uniform(1, 3, (6, 9, 1))
    frames = np.round(table + noise * rng.normal(size=(12, *table.shape)))
    model = build_model(list(frames.astype(np.uint8)), false_positive_rate=0.05)
    mean, std = frames.mean(axis=0), deviation(frames)
    assert model.mean == pytest.approx(mean, rel=1e-6)
    assert model.std == pytest.approx(std, rel=1e-5)
    alpha, apart = projected(mean / std, frames / std)
    bright = alpha - 1, model.brightness_rms, model.brightness_threshold
    chroma = apart, model.chromaticity_rms, model.threshold
    for part, (values, spread, threshold) in enumerate((bright, chroma)):
        rms = np.sqrt(np.mean(values**2, axis=0))
        typical = np.maximum(rms, np.median(rms))
        assert spread == pytest.approx(typical, rel=1e-4)
        left_out = []
        for k in range(12):
            others, rest = np.delete(frames, k, axis=0), np.delete(values, k, axis=0)
            own = deviation(others)
            value = projected(others.mean(axis=0) / own, frames[k] / own)[part] - (part == 0)
            rms = np.sqrt(np.mean(rest**2, axis=0))
            left_out.append(np.abs(value) / np.maximum(rms, np.median(typical)))
        # To the width of a bin, and the gap between two of 648 values.
        assert threshold == pytest.approx(np.quantile(left_out, 0.95), rel=0.02)
