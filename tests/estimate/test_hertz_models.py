"""Which model is fitted and recommended by geometry, contact and warnings."""

from dataclasses import replace

import numpy as np
import pytest
from palpate.estimate.hertz.indentation import Indentation
from palpate.estimate.hertz.laws import contact_law
from palpate.estimate.hertz.models import fit_model, fit_models, recommended
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.shape import Shape

R, TRUTH = 0.00622, 27473.0
OPTIONS = Hertz(assumed_poisson_ratio=0.3)


def press(deepest_m=0.008, thickness_m=0.0475, depth_std_m=1e-4, shift_m=0.0):
    depth = np.linspace(-0.003, deepest_m, 23)
    law = contact_law("sneddon", "bonded", radius_m=R, thickness_m=thickness_m, nu=0.3)
    force = TRUTH * law(depth) + np.random.default_rng(5).normal(0, 0.002, depth.size)
    onset = int(np.argmax(depth > 0))
    samples = np.arange(23) / 6, depth + shift_m, force, force, onset, 22
    return Indentation(*samples, R, thickness_m, 1e-5, depth_std_m, 0.002)


def test_the_study_s_model_and_the_recommended_one():
    ours = press()
    studys, chosen = fit_models(ours, OPTIONS)
    assert recommended(ours, [studys, chosen]).items() >= chosen.items()
    known = fit_model(ours, OPTIONS, indenter="parabola", support="half_space", contact="known")
    assert studys["reduced_modulus_pa"] == known.reduced_modulus_pa
    assert (chosen["indenter"], chosen["support"]) == ("sneddon", "bonded")
    assert chosen["reduced_modulus_pa"] == pytest.approx(TRUTH, rel=0.02)
    assert chosen["poisson_ratio"] == 0.3
    assert "poisson_ratio" not in studys
    bonded, halfspace = (
        fit_model(ours, OPTIONS, indenter="sneddon", support=one, contact="known")
        for one in ("bonded", "half_space")
    )
    assert halfspace.reduced_modulus_pa > 1.08 * bonded.reduced_modulus_pa


def test_recommendation_follows_geometry():
    shallow = press(deepest_m=0.0005)
    assert recommended(shallow, list(fit_models(shallow, OPTIONS)))["indenter"] == "parabola"
    thin = press(thickness_m=0.010)
    models = list(fit_models(thin, OPTIONS))
    assert {m["support"] for m in models} == {"half_space"}
    assert recommended(thin, models)["support"] == "half_space"


def test_where_no_law_holds_the_interval_reaches_to_all_of_them():
    """A side that takes a fifth of the force leaves the object softer than it is by as much."""
    ours = press()
    sure = recommended(ours, list(fit_models(ours, OPTIONS)))
    assert not sure["doubts"]
    for part, most in ((0.2, 0.8), (0.99, 0.1)):
        unsure = replace(ours, shape=Shape(doubts=("no law",), side_part=part))
        models = list(fit_models(unsure, OPTIONS))
        low, high = recommended(unsure, models)["reduced_modulus_interval_pa"]
        ends = [m["reduced_modulus_interval_pa"] for m in models if m["contact"] == "weighted"]
        assert low == min(end for end, _ in ends) < sure["reduced_modulus_interval_pa"][0] + 1
        assert high == pytest.approx(max(end for _, end in ends) / most)


@pytest.mark.parametrize(("depth_std_m", "alike"), [(1e-7, "known"), (1.0, "free")])
def test_weighted_contact_lies_between_known_and_free(depth_std_m, alike):
    """At a deviation of 0 or without bound it is one of them; 0.5 mm too shallow a depth."""
    name = {"indenter": "sneddon", "support": "bonded"}
    end = press(depth_std_m=depth_std_m, shift_m=-5e-4)
    found = fit_model(end, OPTIONS, **name, contact="weighted").reduced_modulus_pa
    same = fit_model(end, OPTIONS, **name, contact=alike).reduced_modulus_pa
    assert found == pytest.approx(same, rel=5e-3)
    middle = press(depth_std_m=1e-5, shift_m=-5e-4)
    known, between, free = (
        fit_model(middle, OPTIONS, **name, contact=contact).reduced_modulus_pa
        for contact in ("known", "weighted", "free")
    )
    assert known > between > free
