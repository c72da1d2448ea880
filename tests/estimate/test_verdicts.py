"""Verdicts and doubts just inside and just outside of each of their limits."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_press import OPTIONS, RADIUS_M, START, press_of
from palpate.estimate.direct.blocks import Scales, blocks_of
from palpate.estimate.direct.budget import budget_of, covariance_of
from palpate.estimate.direct.doubts import doubts_of
from palpate.estimate.direct.estimate import estimate_direct
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
    told = quantities_of(best, options, radius_m=RADIUS_M)
    budget = budget_of(best, covariance, told, options, radius_m=RADIUS_M)
    found = intervals(best, covariance, told, budget, options)
    return {name.removesuffix("_pa"): one.verdict for name, one in found.items()}


def doubts(best, options=OPTIONS, std=None):
    std = np.sqrt(np.diag(covariance_of(best, options))) if std is None else std
    return list(doubts_of(best, options, std))


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
    assert doubts(best) == ["the fit did not converge"] * len(changes)


@pytest.mark.parametrize(("off", "verdict"), [(0.5e-6, "bounded"), (2e-6, "identified")])
@pytest.mark.parametrize("end", [0, 1])
def test_a_modulus_at_an_end_of_its_range(off, verdict, end):
    E = TRUTH.youngs_modulus_pa
    bounds = (E * (1 - off), 1e8) if end == 0 else (100.0, E * (1 + off))
    options = OPTIONS.changed(youngs_modulus_bounds_pa=bounds)
    best = at_truth()
    assert set(verdicts(best, options).values()) == {verdict}
    line = f"E lies at an end of its range, {bounds[0]:g} to {bounds[1]:g} Pa"
    assert doubts(best, options) == [line] * (verdict == "bounded")


@pytest.mark.parametrize(("part", "verdict"), [(0.72, "assumed"), (0.78, "identified")])
def test_a_ratio_of_which_a_press_leaves_four_fifths_is_the_one_that_was_given(part, verdict):
    """Two deviations leave their product over their hypotenuse: at 3/4 that is 4/5."""
    free = covariance_of(at_truth(), OPTIONS)[NU, NU] ** 0.5
    options = OPTIONS.changed(poisson_ratio=0.3, poisson_ratio_std=part * free)
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
    found = doubts(at_truth(replace(PRESS, **change)))
    assert [one[: len(doubt or "")] for one in found] == ([doubt] if doubt else [])


@pytest.mark.parametrize(("deviations", "doubted"), [(1.95, False), (2.05, True)])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_ratio_that_is_pulled_from_the_one_given(deviations, doubted, side):
    given = 0.3 + side * deviations * 0.02
    options = OPTIONS.changed(poisson_ratio=given, poisson_ratio_std=0.02)
    assert bool(doubts(at_truth(), options)) is doubted


@pytest.mark.parametrize(("deviations", "warned"), [(2.95, False), (3.05, True)])
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize(
    ("name", "law"), [("force", "force_law"), ("surface displacement", "motion_law")]
)
def test_a_material_law_parameter_far_from_its_prior(name, law, side, deviations, warned):
    std = np.ones(4)
    std[NU + 1 + (law == "motion_law")] = 0.1 / deviations
    laws = (side * 0.1 * (law == "force_law"), side * 0.1 * (law == "motion_law"))
    best = at_truth(pressed(laws=laws), truth=replace(TRUTH, **{law: side * 0.1}))
    line = f"material-law parameter of the {name} {side * 0.1:+.2f} +- 0.03, 3 deviations from"
    assert [one[: len(line)] for one in doubts(best, std=std)] == [line] * warned


@pytest.mark.parametrize(
    ("axis", "where", "times", "warned"),
    [
        (0, "loaded", 2.95, False),
        (0, "loaded", 3.05, True),
        (1, "loaded", 1.45, False),
        (1, "loaded", 1.55, True),
        (0, "far", 5.0, False),
        (0, "unloaded", 5.0, False),
    ],
)
def test_residuals_under_load_over_the_noise_at_rest(axis, where, times, warned):
    loaded = (PRESS.load >= 0.7)[:, None]
    near = np.linalg.norm(PRESS.cell_m - PRESS.contact_m, axis=1) < 0.045
    at = {"loaded": loaded & near, "far": loaded & ~near, "unloaded": ~loaded & near}[where]
    moved = PRESS.moved_m + times * PRESS.noise_std_m * at
    seen = f"displacements in {('clouds', 'pictures')[axis]} are, under load"
    best = at_truth(replace(PRESS, moved_m=moved, axis=np.full(PRESS.axis.shape, axis)))
    assert sum(seen in one for one in doubts(best)) == warned
    assert any("intervals may be too narrow" in one for one in doubts(best)) == (axis > 0)


@pytest.mark.parametrize(("law", "verdict"), [(0.0, "identified"), (-0.8, "bounded")])
def test_nothing_is_identified_where_the_law_is_far_from_its_prior(law, verdict):
    press = press_of(25e3, 0.3, 1, laws=(law, law))
    found = estimate_direct([press], OPTIONS, radius_m=RADIUS_M)
    assert {found.moduli[name].verdict for name in ("youngs_modulus_pa", "poisson_ratio")} == {
        verdict
    }
    assert any("material-law" in one for one in found.doubts) == (verdict == "bounded")
