"""Noise of the surface's motion: its reach."""

import numpy as np
import pytest
from palpate.estimate.direct.motion_noise import (
    correlation_length,
    correlogram,
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
