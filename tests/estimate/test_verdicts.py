"""Verdicts and doubts just inside and just outside of each of their limits."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_press import OPTIONS, RADIUS_M, START, press_of
from palpate.estimate.direct.blocks import Scales, blocks_of
from palpate.estimate.direct.budget import budget_of, covariance_of
from palpate.estimate.direct.doubts import doubts_of
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import linearised
from palpate.estimate.direct.interval import intervals
from palpate.estimate.direct.quantities import NU, quantities_of


def pressed(**press):
    return press_of(25e3, 0.3, 1, noise=0.0, shares=(0.0, 0.0), **press)


PRESS = pressed()
TRUTH = replace(START, youngs_modulus_pa=25e3, poisson_ratio=0.3)


def at_truth(press=PRESS, options=OPTIONS, truth=TRUTH, **changes):
    line = linearised(press, truth, times_s=np.array(options.relaxation_times_s))
    blocks = blocks_of(press, line, Scales())
    return replace(Solution((truth,), 0.0, (Scales(),), (blocks,), (press,), True), **changes)


def verdicts(best, options=OPTIONS):
    covariance = covariance_of(best, options)
    told = quantities_of(best, covariance, options, radius_m=RADIUS_M)
    budget = budget_of(best, covariance, told, options, radius_m=RADIUS_M)
    found = intervals(best, covariance, told, budget, options)
    return {name.removesuffix("_pa"): one.verdict for name, one in found.items()}


@pytest.mark.parametrize(
    ("frames", "changes", "modulus", "ratio"),
    [
        (None, {}, "identified", "identified"),
        (None, {"converged": False}, "not judged", "not judged"),
        # Two moduli and two relaxing shares.
        (4, {}, "identified", "identified"),
        (3, {}, "bounded", "not identified"),
    ],
)
def test_frames_and_convergence(frames, changes, modulus, ratio):
    best = at_truth(pressed(kept=frames), **changes)
    found = verdicts(best)
    assert found.pop("poisson_ratio") == ratio
    # What is not told of nu is not of G and K; K of a few frames is wider than E.
    shear, bulk = found.pop("shear_modulus"), found.pop("bulk_modulus")
    assert shear == (ratio if ratio == "not identified" else modulus)
    assert bulk == (shear if frames != 4 else "bounded")
    assert set(found.values()) == {modulus}
    assert list(doubts_of(best, OPTIONS)) == ["the fit did not converge"] * len(changes)


@pytest.mark.parametrize(("off", "verdict"), [(0.5e-6, "bounded"), (2e-6, "identified")])
@pytest.mark.parametrize("end", [0, 1])
def test_a_modulus_at_an_end_of_its_range(off, verdict, end):
    E = TRUTH.youngs_modulus_pa
    bounds = (E * (1 - off), 1e8) if end == 0 else (100.0, E * (1 + off))
    options = replace(OPTIONS, youngs_modulus_bounds_pa=bounds)
    best = at_truth()
    assert set(verdicts(best, options).values()) == {verdict}
    line = f"E lies at an end of its range, {bounds[0]:g} to {bounds[1]:g} Pa"
    assert list(doubts_of(best, options)) == [line] * (verdict == "bounded")


@pytest.mark.parametrize(("part", "verdict"), [(0.72, "assumed"), (0.78, "identified")])
def test_a_ratio_of_which_a_press_leaves_four_fifths_is_the_one_that_was_given(part, verdict):
    """Two deviations leave their product over their hypotenuse: at 3/4 that is 4/5."""
    free = covariance_of(at_truth(), OPTIONS)[NU, NU] ** 0.5
    options = replace(OPTIONS, poisson_ratio=0.3, poisson_ratio_std=part * free)
    assert verdicts(at_truth(options=options), options)["poisson_ratio"] == verdict


def depths_of(times):
    return {"depth_root_m": times * PRESS.tip_std_m * np.eye(len(PRESS.frames))}


@pytest.mark.parametrize(
    ("change", "doubt"),
    [
        ({}, None),
        (
            {"frames_beyond": 1},
            f"1 of {len(PRESS.frames) + 1} frames are deeper than the table's 9.0 mm",
        ),
        (depths_of(7.9), None),
        (depths_of(8.1), "depths scatter by 8 times"),
        ({"oblique_rad": np.deg2rad(9.8)}, None),
        ({"oblique_rad": np.deg2rad(10.2)}, "the tip went 10 degrees beside"),
    ],
)
def test_doubts_of_a_press(change, doubt):
    found = list(doubts_of(at_truth(replace(PRESS, **change)), OPTIONS))
    assert [one[: len(doubt or "")] for one in found] == ([doubt] if doubt else [])


@pytest.mark.parametrize(("deviations", "doubted"), [(1.95, False), (2.05, True)])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_ratio_that_is_pulled_from_the_one_given(deviations, doubted, side):
    given = 0.3 + side * deviations * 0.02
    options = replace(OPTIONS, poisson_ratio=given, poisson_ratio_std=0.02)
    assert bool(list(doubts_of(at_truth(), options))) is doubted
