"""Distortions of colours against a background, and what its thresholds count (Eq. 4.13-4.19)."""

import numpy as np
import pytest
from palpate.vision.background import (
    BIN_EDGES,
    BackgroundModel,
    _left_out,
    _moments,
    _quantile,
    build_model,
    distortion,
)


def test_distortions_are_the_projection_and_its_rest():
    """Of a colour on its expected line (Eq. 4.15, 4.16), each axis in its deviations."""
    rng = np.random.default_rng(2)
    mean, std = rng.uniform(50, 150, (4, 5, 3)), rng.uniform(0.5, 2, (4, 5, 3))
    a, b = rng.uniform(0.01, 0.02, (4, 5)), rng.uniform(0.5, 2, (4, 5))
    model = BackgroundModel(mean, std, a, b, 3.0, 4.0)
    image = rng.integers(0, 255, (4, 5, 3)).astype(np.uint8)
    brightness, chroma = distortion(model, image)
    for at in np.ndindex(4, 5):
        line, colour = mean[at] / std[at], image[at] / std[at]
        alpha = line @ colour / (line @ line)
        assert brightness[at] == pytest.approx((alpha - 1) / a[at])
        assert chroma[at] == pytest.approx(np.linalg.norm(colour - alpha * line) / b[at])


def test_mean_and_squares_in_one_pass():
    frames = list(np.random.default_rng(1).integers(0, 255, (7, 3, 4, 3)).astype(np.uint8))
    mean, square = _moments(frames)
    assert mean == pytest.approx(np.mean(frames, axis=0))
    assert square == pytest.approx(np.var(frames, axis=0) * 7)


def test_a_frame_is_held_against_all_others():
    """Far from the others, its distortion is that against their own mean and deviation."""
    rng = np.random.default_rng(3)
    frames = [rng.normal(100, 2, (1, 1, 3)) for _ in range(9)] + [np.full((1, 1, 3), 160.0)]
    mean, square = _moments(frames)
    sums, spreads = (np.full((1, 1), 30.0), np.full((1, 1), 30.0)), (np.array([[1e-3]]),) * 2
    brightness, chroma = _left_out(frames[-1], mean, square, sums, spreads, 10)
    others = np.array(frames[:-1])[:, 0, 0]
    line, colour = (x / others.std(axis=0) for x in (others.mean(axis=0), frames[-1][0, 0]))
    alpha = line @ colour / (line @ line)
    # The sums of the others: all, less what this frame has in the model of all.
    std = np.sqrt(square[0, 0] / 10)
    whole, own = mean[0, 0] / std, frames[-1][0, 0] / std
    part = whole @ own / (whole @ whole)
    rest = (
        np.sqrt((30 - (part - 1) ** 2) / 9),
        np.sqrt(max(30 - np.linalg.norm(own - part * whole) ** 2, 0) / 9),
    )
    assert brightness[0, 0] == pytest.approx((alpha - 1) / max(rest[0], 1e-3))
    assert chroma[0, 0] == pytest.approx(np.linalg.norm(colour - alpha * line) / max(rest[1], 1e-3))


def test_quantile_of_counted_values():
    counts = np.zeros(len(BIN_EDGES) - 1, dtype=int)
    counts[[3, 10, 20]] = 90, 9, 1
    assert _quantile(counts, 0.5) == BIN_EDGES[4]
    assert _quantile(counts, 0.95) == BIN_EDGES[11]
    assert _quantile(counts, 0.999) == BIN_EDGES[21]
    counts[-1] = 100
    assert _quantile(counts, 0.9) == BIN_EDGES[-2]


def test_spreads_of_a_model_are_root_mean_squares():
    """Of brightness and chromaticity about the mean (Eq. 4.17), none below the typical."""
    rng = np.random.default_rng(4)
    table = rng.uniform(80, 160, (6, 9, 3))
    noise = rng.uniform(1, 3, (6, 9, 1))
    frames = [np.round(table + noise * rng.normal(size=table.shape)) for _ in range(12)]
    model = build_model([frame.astype(np.uint8) for frame in frames], false_positive_rate=0.01)
    mean = np.mean(frames, axis=0)
    std = np.maximum(np.std(frames, axis=0), 1 / np.sqrt(12))
    assert model.mean == pytest.approx(mean, rel=1e-6)
    assert model.std == pytest.approx(std, rel=1e-5)
    line, colours = mean / std, np.array(frames) / std
    alpha = (line * colours).sum(axis=-1) / (line**2).sum(axis=-1)
    apart = np.linalg.norm(colours - alpha[..., None] * line, axis=-1)
    for found, values in ((model.brightness_rms, alpha - 1), (model.chromaticity_rms, apart)):
        rms = np.sqrt(np.mean(values**2, axis=0))
        assert found == pytest.approx(np.maximum(rms, np.median(rms)), rel=1e-4)
