"""Scatter of residuals that depend on each other."""

import numpy as np
import pytest
from palpate.estimate.hertz.fit import deviation, effective_samples, freedom


def test_independent_samples_of_a_first_order_process():
    """Its lag-1 autocorrelation r leaves (1 - r)/(1 + r) of them."""
    rng, values = np.random.default_rng(2), np.zeros(20_000)
    for k in range(1, len(values)):
        values[k] = 0.6 * values[k - 1] + rng.normal()
    assert effective_samples(values) == pytest.approx(20_000 * 0.4 / 1.6, rel=0.05)
    assert effective_samples(rng.normal(size=20_000)) == pytest.approx(20_000, rel=0.05)
    assert effective_samples((-1.0) ** np.arange(100)) == 100
    # By hand: 1, 1, -1, -1 has a lag-1 autocorrelation of 1/4, less its bias of (1 + 1)/4.
    few = np.array([1.0, 1, -1, -1])
    assert effective_samples(few) == pytest.approx(4 * 0.25 / 1.75)
    # Of a steady drift five are left.
    assert effective_samples(np.linspace(-1, 1, 1000)) == pytest.approx(5)


def test_freedom_and_deviation_of_few_samples():
    few = np.array([1.0, 1, -1, -1])
    assert freedom(few, 1) == pytest.approx(4 * 0.75)
    assert deviation(few, 1) == pytest.approx(np.sqrt(4 / (4 / 7 * 0.75)))
    drift = np.linspace(-1, 1, 1000)
    assert freedom(drift, 2) == pytest.approx(5 * 0.998)
