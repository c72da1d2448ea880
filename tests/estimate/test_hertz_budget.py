"""Interval of the fit with relaxation, each of its terms against its first order by hand."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import Indentation
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.relaxation import fit_relaxation
from scipy.stats import norm

R, E, COUNT = 0.006, 25e3, 8
LAW = contact_law("parabola", "half_space", radius_m=R, thickness_m=1.0, nu=0.3)
DEPTH_M = np.linspace(0.0003, 0.007, COUNT)
UNIT = 4 / 3 * np.sqrt(R) * DEPTH_M**1.5
RISE = 1.5 * UNIT / DEPTH_M
# Of 95 %.
NORMAL = norm.ppf(0.975)


SURE = Indentation(
    time_s=np.arange(COUNT) / 6,
    depth_m=DEPTH_M,
    force_n=E * UNIT,
    magnitude_n=E * UNIT,
    onset=0,
    radius_m=R,
    thickness_m=1.0,
    deepest=COUNT - 1,
    frame_std_m=1e-9,
    contact_std_m=1e-9,
    force_std_n=0.05,
)
BELIEFS = Beliefs(share=0.3, none=1 - 1e-9, law_std=1e-6, law_growth_std=1e-6)


@pytest.mark.parametrize(
    ("name", "std"),
    [
        ("contact_std_m", 3e-4),
        ("frame_std_m", 3e-4),
        ("force_std_n", 0.1),
        ("law_std", 0.06),
        ("law_growth_std", 0.1),
    ],
)
def test_what_the_interval_holds(name, std):
    """Here it hardly may: E*, the contact, the law's growth and the baseline are found."""
    record, beliefs = SURE, BELIEFS
    if hasattr(record, name):
        record = replace(record, **{name: std})
    else:
        beliefs = beliefs.changed(**{name: std})
    fit = fit_relaxation(record, {0.3: LAW}, times_s=np.array([0.5, 2.0]), beliefs=beliefs)
    noise = np.hypot(record.force_std_n, E * RISE * record.frame_std_m)
    columns = [E * UNIT, -E * RISE, E * UNIT * np.sqrt(DEPTH_M / R), np.ones(COUNT)]
    slopes = np.stack(columns, axis=1) / noise[:, None]
    stds = [record.contact_std_m, beliefs.law_growth_std, record.force_std_n]
    known = np.diag([0, *np.power(stds, -2.0)])
    learnt = np.linalg.inv(slopes.T @ slopes + known)[0, 0]
    expected = np.hypot(np.sqrt(learnt), beliefs.law_std)
    ends = np.log(np.array(fit.reduced_modulus_interval_pa) / fit.reduced_modulus_pa)
    assert ends == pytest.approx(np.array([-1, 1]) * NORMAL * expected, rel=0.03)
