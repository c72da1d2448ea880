"""Intervals of the Hertz fits, each of their terms against its first order by hand."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.hertz.fit import effective_samples, fit_free_contact, fit_known_contact
from palpate.estimate.hertz.indentation import Record
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.relaxation import fit_relaxation
from scipy.stats import norm, t

R, E, COUNT = 0.006, 25e3, 8
LAW = contact_law("parabola", "half_space", radius_m=R, thickness_m=1.0, nu=0.3)
DEPTH_M = np.linspace(0.0003, 0.007, COUNT)
UNIT = 4 / 3 * np.sqrt(R) * DEPTH_M**1.5
RISE = 1.5 * UNIT / DEPTH_M
# To and fro: samples that err independently.
SCATTER_N = 0.01 * (-1.0) ** np.arange(COUNT)
# Of 95 %.
NORMAL = norm.ppf(0.975)


def width(interval):
    """Half of it in the logarithm."""
    return float(np.log(interval[1] / interval[0])) / 2


@pytest.mark.parametrize("depth_std_m", [0.0, 3e-4])
@pytest.mark.parametrize("scatter_n", [0.0, 0.01])
def test_a_known_contact(depth_std_m, scatter_n):
    """Student's quantile of the scatter, and the zero that all depths share: E* as its -3/2."""
    force = E * UNIT + scatter_n * SCATTER_N / 0.01
    fit = fit_known_contact(DEPTH_M, force, LAW, depth_std_m=depth_std_m)
    of_scatter = np.sqrt(COUNT / (COUNT - 1)) * scatter_n / np.linalg.norm(E * UNIT)
    of_depth = depth_std_m * (UNIT @ RISE) / (UNIT @ UNIT)
    quantile = t.ppf(0.975, COUNT - 1)
    stated = np.hypot(quantile * of_scatter, NORMAL * of_depth)
    assert width(fit.reduced_modulus_interval_pa) == pytest.approx(stated, rel=0.02, abs=1e-9)
    assert fit.reduced_modulus_std_pa / E == pytest.approx(
        np.hypot(of_scatter, of_depth), rel=0.02, abs=1e-9
    )


@pytest.mark.parametrize("depth_std_m", [None, 1e-4, 1e-5])
def test_a_contact_that_is_found_with_the_modulus(depth_std_m):
    """Weighted, it is known beforehand as well as is stated."""
    fit = fit_free_contact(DEPTH_M, E * UNIT + SCATTER_N, LAW, depth_std_m=depth_std_m)
    slopes = np.stack([E * UNIT, -E * RISE], axis=1) / (0.01 * np.sqrt(COUNT / (COUNT - 2)))
    known = np.diag([0, 0 if depth_std_m is None else depth_std_m**-2])
    std = np.sqrt(np.linalg.inv(slopes.T @ slopes + known)[0, 0])
    assert fit.reduced_modulus_std_pa / E == pytest.approx(std, rel=0.03)
    stated = t.ppf(0.975, COUNT - 2) * std
    assert width(fit.reduced_modulus_interval_pa) == pytest.approx(stated, rel=0.03)


def test_samples_that_count():
    """By hand: pairs of one sign have 1/20 of lag 1, of a short series 0.11."""
    pairs = np.tile([1.0, 1, -1, -1], 5)
    assert effective_samples(pairs) == pytest.approx(20 * 0.89 / 1.11)
    assert effective_samples(np.tile([1.0, -1], 10)) == 20
    # Of a record that goes one way and then the other a correlation of 0.9 or five are left.
    assert effective_samples(np.repeat([1.0, -1], 10)) == pytest.approx(20 * 0.1 / 1.9)
    assert effective_samples(np.repeat([1.0, -1], 1000)) == pytest.approx(5)


SURE = Record(
    time_s=np.arange(COUNT) / 6,
    depth_m=DEPTH_M,
    force_n=E * UNIT,
    deepest=COUNT - 1,
    frame_std_m=1e-9,
    contact_std_m=1e-9,
    force_std_n=0.05,
)
BELIEFS = Beliefs(share=0.3, none=1 - 1e-9, law_std=1e-6)


@pytest.mark.parametrize(
    ("name", "std"),
    [("contact_std_m", 3e-4), ("frame_std_m", 3e-4), ("force_std_n", 0.1), ("law_std", 0.06)],
)
def test_a_press_that_may_relax(name, std):
    """Here it hardly may: E*, the contact, the law's growth and the force's zero are found."""
    record, beliefs = SURE, BELIEFS
    if hasattr(record, name):
        record = replace(record, **{name: std})
    else:
        beliefs = beliefs.changed(**{name: std})
    fit = fit_relaxation(record, {0.3: LAW}, times_s=np.array([0.5, 2.0]), beliefs=beliefs)
    noise = np.hypot(record.force_std_n, E * RISE * record.frame_std_m)
    columns = [E * UNIT, -E * RISE, E * UNIT * (DEPTH_M / DEPTH_M[-1] - 0.5), np.ones(COUNT)]
    slopes = np.stack(columns, axis=1) / noise[:, None]
    known = np.diag([0, record.contact_std_m**-2, beliefs.law_std**-2, record.force_std_n**-2])
    learnt = np.linalg.inv(slopes.T @ slopes + known)[0, 0]
    expected = np.hypot(np.sqrt(learnt), beliefs.law_std)
    assert fit.reduced_modulus_std_pa / E == pytest.approx(expected, rel=0.03)
    ends = np.array(fit.reduced_modulus_interval_pa) / fit.reduced_modulus_pa - 1
    assert ends == pytest.approx(np.array([-1, 1]) * NORMAL * expected, rel=0.03)
