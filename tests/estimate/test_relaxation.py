"""Relaxation of a press, forward and back."""

import numpy as np
import pytest
from palpate.estimate.relaxation import (
    elastic_force,
    relaxed_force,
    relaxed_share,
)

PRONY = {"fractions": [0.1, 0.05, 0.2], "times_s": [0.2, 1.0, 5.0]}


def history(seed, n=40):
    """Return jittered times and a force that rises and holds."""
    rng = np.random.default_rng(seed)
    time = np.arange(n) / 6 + rng.uniform(-0.02, 0.02, n)
    return time, np.clip(time - 1, 0, 2) ** 1.5 + 0.01 * rng.normal(size=n)


@pytest.mark.parametrize("columns", [None, 3])
def test_inverse_gives_back_the_elastic_force(columns):
    time, force = history(1)
    if columns:
        force = np.stack([history(seed)[1] for seed in range(columns)], axis=1)
    relaxed = relaxed_force(time, force, **PRONY)
    assert np.abs(relaxed - force).max() > 0.1
    assert elastic_force(time, relaxed, **PRONY) == pytest.approx(force, abs=1e-12)
    for function in (relaxed_force, elastic_force):
        assert np.array_equal(function(time, force, fractions=[], times_s=[]), force)


def test_steps_relax_as_the_series_and_ramps_are_exact_whatever_the_sampling():
    """The force is straight between samples: a smooth one errs by the square of their distance."""
    time = np.array([0.0, 0.1, 0.35, 2.0, 30.0])
    found = relaxed_force(time, np.full(5, 3.0), **PRONY)
    assert found == pytest.approx(3 * (1 - relaxed_share(time, **PRONY)), rel=1e-13)
    assert relaxed_share(1e9, **PRONY) == pytest.approx(0.35)
    time = np.sort(np.random.default_rng(2).uniform(0, 4, 7))
    time[0], g, tau = 0, 0.3, 0.7
    found = relaxed_force(time, time, fractions=[g], times_s=[tau])
    assert found == pytest.approx(time * (1 - g) - g * tau * np.expm1(-time / tau), rel=1e-12)
