"""E of a curve by an indentation table: made-up solids whose moduli are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_indentation import NO_RIG, RADIUS_M, made_up_table
from palpate import hertz
from palpate.estimate.curve import estimate_curve
from palpate.estimate.direct.options import Fit, ModelStd
from palpate.estimate.direct.prior import FARTHEST_LAW
from palpate.solid.indentation_table import IndentationModel

E_PA, NU, NOISE_N = 40e3, 0.4, 0.004
OPTIONS = Fit(rig=NO_RIG, model_std=ModelStd(log_youngs_modulus=0.0, nu=0.0, sphere_friction=0.0))


@pytest.fixture(scope="module")
def model():
    table = made_up_table(np.array([[0.03, 0, 0]]))
    force = table.force_per_modulus_m2
    return IndentationModel(
        point_m=np.zeros(3),
        direction=np.array([0.0, 0, -1]),
        radius_m=RADIUS_M,
        laws=("neo_hookean", "blatz_ko"),
        poisson_ratios=table.poisson_ratios,
        depth_m=table.depth_m,
        force_per_modulus_m2=np.stack([force, force * np.exp(table.stiffening)]),
        surface_rest_m=np.eye(3),
        surface_faces=np.array([[0, 1, 2]]),
        surface_displacement_m=np.zeros((2, *force.shape, 3, 3), np.float32),
    )


def fitted(seed, *, law=0.0, deepest_m=0.006, contact_m=0.002, level_n=0.05, wrong=None, **options):
    """A curve of a material that stiffens by a law, with an approach and a constant force.

    Some samples are wrong by 0.2 N.
    """
    rng = np.random.default_rng(seed)
    table = made_up_table(np.array([[0.03, 0, 0]]))
    depth = np.linspace(0, contact_m + deepest_m, 300)
    force = E_PA * table.force(depth - contact_m, NU, law) + level_n
    noise = NOISE_N * rng.normal(size=300)
    if wrong is not None:
        noise[wrong] += 0.2
    return hertz.fit(depth, force + noise, radius_m=RADIUS_M, **options)


@pytest.mark.parametrize("law", [0.0, 0.7, -0.4])
def test_the_truth_lies_in_the_interval_whatever_the_law(model, law):
    found = estimate_curve(fitted(3, law=law), model, (NU, NU), OPTIONS)
    E, nu = found.moduli["youngs_modulus_pa"], found.moduli["poisson_ratio"]
    assert E.low < E_PA < E.high
    assert (nu.value, nu.low, nu.high, nu.verdict) == (pytest.approx(NU), NU, NU, "assumed")
    assert abs(found.force_law - law) < 2.5 * found.force_law_std
    assert found.contact_m == pytest.approx(0.002, abs=1e-4)
    assert found.baseline_n == pytest.approx(0.05, abs=0.003)
    assert found.rms_n == pytest.approx(NOISE_N, rel=0.15)


@pytest.mark.parametrize("law", [1.2, 3.0, -3.0])
def test_a_law_beyond_the_range_is_warned_of(model, law):
    """Where the force might fall with depth, the direct estimate does not look either."""
    found = estimate_curve(fitted(3, law=law), model, (NU, NU), OPTIONS.changed(force_law_std=5.0))
    assert abs(found.force_law) <= FARTHEST_LAW
    assert any("an end of its range" in line for line in found.warnings) is (
        abs(law) > FARTHEST_LAW
    )


def test_intervals_hold_the_truth_as_often_as_they_say(model):
    moduli = [
        estimate_curve(fitted(seed, law=law), model, (NU, NU), OPTIONS).moduli["youngs_modulus_pa"]
        for seed, law in enumerate(np.random.default_rng(5).normal(0, 0.5, 40))
    ]
    held = sum(one.low < E_PA < one.high for one in moduli)
    assert held >= 34


def test_weights_of_the_curve_are_those_of_the_fit(model):
    wrong = slice(200, 220)
    weights = np.ones(300)
    weights[wrong] = 1e-6
    E = [
        estimate_curve(fitted(3, wrong=wrong, weights=one), model, (NU, NU), OPTIONS).moduli[
            "youngs_modulus_pa"
        ]
        for one in (weights, None)
    ]
    assert E[0].low < E_PA < E[0].high
    assert abs(E[0].value / E_PA - 1) < 0.5 * abs(E[1].value / E_PA - 1)


def test_what_is_not_known_of_nu_and_the_rig_widens_e(model):
    curve = fitted(3)
    known, bounded = (
        estimate_curve(curve, model, ratios, OPTIONS).moduli["youngs_modulus_pa"]
        for ratios in ((NU, NU), (0.2, 0.49))
    )
    assert bounded.low < known.low and known.high < bounded.high
    real = estimate_curve(curve, model, (NU, NU), Fit()).moduli["youngs_modulus_pa"]
    assert real.value == pytest.approx(known.value)
    # 1 % of the force, 1.5 % of the table and 0.6 % by friction at the sphere, at 95 %.
    narrow, wider = (np.log(one.high / one.low) / 2 for one in (known, real))
    added = 1.96 * np.hypot(0.018, 0.006)
    assert np.sqrt(wider**2 - narrow**2) == pytest.approx(added, rel=0.05)


def test_what_the_table_does_not_hold_is_refused(model):
    short = replace(
        model,
        depth_m=model.depth_m[:7],
        force_per_modulus_m2=model.force_per_modulus_m2[..., :7],
        surface_displacement_m=model.surface_displacement_m[:, :, :7],
    )
    with pytest.raises(ValueError, match=r"deepest_m: expected at least the curve's [56]\."):
        estimate_curve(fitted(3), short, (NU, NU), OPTIONS)
    with pytest.raises(ValueError, match=r"poisson_ratio: expected from 0 to 0.4999, low"):
        estimate_curve(fitted(3), model, (0.49, 0.3), OPTIONS)
