"""The joint cost of captures and its normal equations, held to differences; a curve's fit too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_press import OPTIONS, RADIUS_M, STANDING, START, model_of, press_of
from palpate.estimate.curve import BASELINE, CONTACT, LAW, LOG_E, NU, _Fit, _moduli, _rig_std
from palpate.estimate.direct.blocks import Scales
from palpate.estimate.direct.deviations import ROBUST
from palpate.estimate.direct.fit import _joined, _Joint, split
from palpate.estimate.direct.indentation import depth_noise, residuals
from palpate.estimate.direct.options import Fit, ModelStd, Rig
from scipy.stats import t

TIMES_S = np.array(OPTIONS.relaxation_times_s)


@pytest.fixture(scope="module")
def joint():
    captures = [press_of(25e3, 0.3, seed, support=STANDING) for seed in (1, 2)]
    return _Joint(captures, OPTIONS)


@pytest.fixture(scope="module")
def place(joint):
    """Unknowns of both captures, near the truth."""
    start = replace(START, youngs_modulus_pa=24e3, poisson_ratio=0.28, fractions=np.full(2, 0.05))
    vector = _joined((start, start))
    vector[joint.shared :] = 1e-6 * np.arange(len(vector) - joint.shared)
    return vector


def test_what_all_share_comes_first_then_each_captures_own(joint, place):
    first, second = split(place, joint)
    assert first.youngs_modulus_pa == second.youngs_modulus_pa == pytest.approx(24e3)
    own = (joint.size - joint.shared) // 2
    assert joint.places(1).tolist() == [
        *range(joint.shared),
        *range(joint.shared + own, joint.size),
    ]
    assert second.offset_m == pytest.approx(place[joint.shared + own])
    assert _joined((first, second)) == pytest.approx(place)


def test_normal_equations_are_slopes_of_the_cost(joint, place):
    """Robust weights make the first derivative exact."""
    scales = (Scales((1.3, 1.0), (2.0, 1.0)), Scales((0.8, 1.0), (1.0, 1.0)))
    parameters = split(place, joint)
    blocks = joint.blocks_at(parameters, scales)
    matrix, slope = joint.normal_equations(parameters, blocks)
    assert matrix == pytest.approx(matrix.T)
    deviations = 1 / np.sqrt(np.diag(matrix))
    for k, deviation in enumerate(deviations):
        step = 1e-3 * min(deviation, 1.0) * np.eye(len(place))[k]
        ends = [joint.cost(split(place + sign * step, joint), scales) for sign in (1, -1)]
        found = (ends[0] - ends[1]) / (2 * step[k])
        assert found * deviation == pytest.approx(2 * slope[k] * deviation, rel=5e-3, abs=0.02)


def test_cost_by_hand(joint, place):
    scales = (Scales((1.3, 1.0), (2.0, 1.0)), Scales((0.8, 1.0), (1.0, 1.0)))
    parameters = split(place, joint)
    expected = (joint.prior.gaps(place) ** 2).sum()
    lacking = 0.0
    for one, p, scale in zip(joint.indentations, parameters, scales, strict=True):
        gaps = residuals(one, p, times_s=TIMES_S)
        soft = np.sqrt(1 + (gaps.motion / (ROBUST * scale.motion[0])) ** 2) - 1
        expected += (gaps.depth**2).sum() + 2 * ROBUST**2 * soft.sum() / scale.sharing[0]
        covariance = one.depth_root_m @ one.depth_root_m.T
        lacking += np.linalg.slogdet(covariance)[1]
        lacking += (np.log((one.moved_std_m * scale.motion[0]) ** 2)).sum() / scale.sharing[0]
    assert joint.cost(parameters, scales) == pytest.approx(expected)
    assert joint.log_determinant(scales) == pytest.approx(lacking)


def test_noise_of_the_depths_is_that_of_tip_and_force(joint, place):
    one, p = joint.indentations[0], split(place, joint)[0]
    found = depth_noise(one, p, times_s=TIMES_S)
    more = replace(
        one, force_n=one.force_n + 1e-3 * (np.arange(len(one.force_n)) == one.frames[-1])
    )
    ends = [
        residuals(replace(c, depth_root_m=np.eye(len(c.frames))), p, times_s=TIMES_S).depth[-1]
        for c in (one, more)
    ]
    softness = (ends[1] - ends[0]) / 1e-3
    # The force of a frame alone, which has had no time to relax.
    expected = np.hypot(one.tip_std_m, one.force_std_n * softness)
    assert found[-1] == pytest.approx(expected, rel=0.02)
    sure = replace(one, force_std_n=0.0)
    assert depth_noise(sure, p, times_s=TIMES_S) == pytest.approx(one.tip_std_m)


def curve(**hertz):
    """A curve of half a millimetre of approach and 2 mm of press."""
    depth = np.linspace(0, 0.0025, 40)
    table = model_of(np.array([[0.03, 0, 0]]))
    force = 20e3 * table.force(depth - 5e-4, 0.3, 0.2) + 0.05
    known = {"depth_m": depth, "force_n": force, "press_m": 0.002, "baseline": True}
    return SimpleNamespace(**(known | {"weights": None} | hertz)), table


def test_gaps_of_a_curve_are_in_deviations():
    hertz, table = curve()
    options = Fit(force_law_std=0.4, rig=Rig(force_zero_std_n=0.002))
    peak = np.ptp(hertz.force_n)
    x = np.zeros(5)
    x[[LOG_E, CONTACT, BASELINE, NU, LAW]] = np.log(20e3), 0.25, 0.05 / peak, 0.3, 0.2
    fit = _Fit(hertz, table, (0.2, 0.44), options, std_n=0.01)
    assert fit.force(x) == pytest.approx(hertz.force_n)
    gaps = fit._gaps(x)
    assert gaps[:40] == pytest.approx(0, abs=1e-9)
    # 0.3 of a range from 0.2 to 0.44, whose deviation is its width over the root of 12.
    assert gaps[40:] == pytest.approx([-0.02 / (0.24 / np.sqrt(12)), 0.5])
    x[BASELINE] += 0.02 / peak
    assert fit._gaps(x)[:40] == pytest.approx(2.0)
    bare = _Fit(curve(baseline=False)[0], table, (0.2, 0.44), options, std_n=0.01)
    assert bare._gaps(x)[42] == pytest.approx(0.07 / 0.002)


def test_a_curves_moduli_and_their_ends():
    x = np.array([np.log(20e3), 0.0, 0.0, 0.3, 0.0])
    covariance = np.diag([0.04**2, 1, 1, 0.05**2, 1])
    covariance[0, 3] = covariance[3, 0] = -0.0005
    found = _moduli(SimpleNamespace(x=x), covariance, 0.03, (0.2, 0.4), 12)
    quantile = t.ppf(0.975, 12)
    E, star = found["youngs_modulus_pa"], found["reduced_modulus_pa"]
    width = quantile * np.hypot(0.04, 0.03)
    assert (E.value, E.low, E.high) == pytest.approx(
        (20e3, 20e3 * np.exp(-width), 20e3 * np.exp(width))
    )
    slope = 0.6 / 0.91
    variance = 0.04**2 + slope**2 * 0.05**2 - 2 * slope * 0.0005
    width = quantile * np.sqrt(variance + 0.03**2)
    value = 20e3 / 0.91
    assert (star.value, star.low, star.high) == pytest.approx(
        (value, value * np.exp(-width), value * np.exp(width))
    )
    nu = found["poisson_ratio"]
    assert (nu.value, nu.low, nu.high, nu.verdict) == (pytest.approx(0.3), 0.2, 0.4, "assumed")


def test_what_the_rig_adds_to_a_curves_modulus():
    rig = Rig(force_scale_std=0.01, radius_std_m=0.04 * RADIUS_M, compliance_std_m_n=1e-5)
    options = Fit(rig=rig, model_std=ModelStd(log_youngs_modulus=0.02))
    hertz = SimpleNamespace(fitted_n=np.array([0.1, 2.1]), setup=SimpleNamespace(radius_m=RADIUS_M))
    # 2 N bend it by 20 um of 3 mm, with the power 1.5; the radius counts with its root.
    expected = np.linalg.norm([0.01, 0.02, 1.5 * 2e-5 / 0.003, 0.02])
    assert _rig_std(hertz, 0.003, options) == pytest.approx(expected)
