"""Noise of the surface's motion: its reach, and what the sensor's pattern adds to it."""

import numpy as np
import pytest
from palpate.estimate.direct.motion_noise import (
    correlation_length,
    correlogram,
    pattern_growth,
)


@pytest.fixture
def places():
    x, y = np.meshgrid(np.arange(-0.04, 0.04, 0.0035), np.arange(-0.04, 0.04, 0.0035))
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])


def correlated(places, length_m, frames, seed=2):
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
    values, vectors = np.linalg.eigh(np.exp(-((apart / length_m) ** 2)))
    root = vectors * np.sqrt(np.maximum(values, 0))
    return (root @ np.random.default_rng(seed).standard_normal((len(places), frames))).T


@pytest.mark.parametrize("length_m", [0.005, 0.010])
def test_length_of_the_correlation(places, length_m):
    noise = correlated(places, length_m, 60)
    noise[3, :40] = np.nan
    assert correlation_length(places, noise) == pytest.approx(length_m, rel=0.06)
    distance, correlation = correlogram(places, noise)
    assert correlation[distance > 0.03] == pytest.approx(0, abs=0.05)


def test_one_place_has_no_correlation():
    assert correlation_length(np.zeros((1, 3)), np.ones((4, 1))) == 0


@pytest.mark.parametrize("growth_m", [0.0, 4e-5, 2e-4])
def test_growth_of_the_pattern(places, growth_m):
    rng = np.random.default_rng(7)
    r = np.linalg.norm(places, axis=1)
    kept = r > 0.015
    x, r, std_m = places[kept], r[kept], 8e-5
    moved = -1e-5 / r * (1 + 0.2 * x[:, 0] / r)
    found = []
    for _ in range(20):
        std = np.sqrt(std_m**2 + growth_m * np.abs(moved))
        seen = moved + std * rng.standard_normal(len(moved))
        seen[::17] = np.nan
        found.append(pattern_growth(x, seen, np.full(len(x), std_m**2), np.zeros(3)))
    assert np.mean(found) == pytest.approx(growth_m, rel=0.15, abs=1.5e-6)


def test_too_few_cells_tell_of_no_pattern(places):
    moved = np.full(len(places), np.nan)
    moved[:10] = -1e-4
    assert pattern_growth(places, moved, np.full(len(places), 1e-10), np.zeros(3)) == 0
