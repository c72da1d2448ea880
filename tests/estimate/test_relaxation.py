"""Relaxation of a press, forward and back."""

import numpy as np
import pytest
from palpate.estimate.relaxation import (
    elastic_force,
    elastic_force_derivatives,
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


def test_derivatives_are_those_of_finite_differences():
    time, force = history(5)
    found, step = elastic_force_derivatives(time, force, **PRONY), 1e-5
    for term in range(3):
        ends = []
        for sign in (1, -1):
            fractions = np.array(PRONY["fractions"])
            fractions[term] += sign * step
            ends.append(elastic_force(time, force, fractions=fractions, times_s=PRONY["times_s"]))
        assert found[:, term] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-8)
    with pytest.raises(ValueError, match="force_n: expected shape"):
        elastic_force_derivatives([0, 1], np.ones((2, 2)), fractions=[0.1], times_s=[1])


@pytest.mark.parametrize(
    ("changed", "line"),
    [
        ({"time_s": [0, 2, 1]}, "time_s: expected increasing times"),
        ({"force_n": [0, 1]}, r"force_n: expected one row for each of 3, found \(2,\)"),
        ({"force_n": [0, 1, np.nan]}, "force_n: expected finite forces"),
        ({"times_s": [0]}, "times_s: expected positive times"),
        ({"fractions": [0.1, 0.2]}, "fractions: expected one for each of 1 times"),
        ({"fractions": [1]}, "fractions: expected a sum below 1, found 1"),
    ],
)
def test_bad_input_is_named(changed, line):
    given = {"time_s": [0, 1, 2], "force_n": [0, 1, 1], "fractions": [0.1], "times_s": [1]}
    given |= changed
    with pytest.raises(ValueError, match=line):
        elastic_force(given.pop("time_s"), given.pop("force_n"), **given)
