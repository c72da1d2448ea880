"""Verdicts, warnings and exclusions just inside and just outside of each of their limits."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_indentation import OPTIONS, RADIUS_M, indentation_of, judged, parameters
from palpate.estimate.direct.deviations import Scales
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import FORCE_LAW, MOTION_LAW, NU
from palpate.estimate.direct.prior import FARTHEST_LAW
from palpate.estimate.direct.warnings import Estimated, exclusions, warnings_of
from palpate.modulus import LABELS, Modulus


def exact(**changes):
    return indentation_of(25e3, 0.3, 1, noise=0.0, amplitudes=(0.0, 0.0), **changes)


CAPTURE = exact()
TRUTH = parameters(25e3, 0.3)


def at_truth(capture=CAPTURE, options=OPTIONS, truth=TRUTH, **changes):
    return Solution((capture,), options, truth.vector, (Scales(),), **changes)


def verdicts(best):
    return {name.removesuffix("_pa"): one.verdict for name, one in judged(best)[2].items()}


def warnings(best):
    return list(warnings_of(best))


@pytest.mark.parametrize(
    ("frames", "changes", "modulus", "ratio"),
    [
        (None, {}, "identified", "identified"),
        (None, {"converged": False}, "not judged", "not judged"),
        # Two moduli and two relaxation amplitudes.
        (4, {}, "identified", "identified"),
        (3, {}, "bounded", "not identified"),
    ],
)
def test_frames_and_convergence(frames, changes, modulus, ratio):
    best = at_truth(exact(kept=frames), **changes)
    found = verdicts(best)
    assert found.pop("poisson_ratio") == ratio
    # Where nu is not identified, neither are G and K; K of a few frames is wider than E.
    shear, bulk = found.pop("shear_modulus"), found.pop("bulk_modulus")
    assert shear == (ratio if ratio == "not identified" else modulus)
    assert bulk == (shear if frames != 4 else "bounded")
    assert set(found.values()) == {modulus}
    assert len(warnings(best)) == len(changes)


@pytest.mark.parametrize(("off", "verdict"), [(0.5e-6, "bounded"), (2e-6, "identified")])
@pytest.mark.parametrize("end", [0, 1])
def test_a_modulus_at_an_end_of_its_range(off, verdict, end):
    E = TRUTH.youngs_modulus_pa
    bounds = (E * (1 - off), 1e8) if end == 0 else (100.0, E * (1 + off))
    options = OPTIONS.changed(youngs_modulus_bounds_pa=bounds)
    best = at_truth(options=options)
    assert set(verdicts(best).values()) == {verdict}
    assert len(warnings(best)) == (verdict == "bounded")


@pytest.mark.parametrize(("part", "verdict"), [(0.72, "assumed"), (0.78, "identified")])
def test_a_ratio_of_which_a_press_leaves_four_fifths_is_assumed(part, verdict):
    """Two deviations leave their product over their hypotenuse: at 3/4 that is 4/5."""
    free = at_truth().std[NU]
    options = OPTIONS.changed(poisson_ratio=0.3, poisson_ratio_std=part * free)
    assert verdicts(at_truth(options=options))["poisson_ratio"] == verdict


def depths_of(times):
    return {"depth_root_m": times * CAPTURE.tip_std_m * np.eye(len(CAPTURE.frames))}


@pytest.mark.parametrize(
    ("change", "warned"),
    [
        ({}, False),
        ({"frames_beyond": 1}, True),
        (depths_of(7.9), False),
        (depths_of(8.1), True),
        ({"oblique_rad": np.deg2rad(9.8)}, False),
        ({"oblique_rad": np.deg2rad(10.2)}, True),
    ],
)
def test_warnings_of_a_capture(change, warned):
    assert len(warnings(at_truth(replace(CAPTURE, **change)))) == warned


@pytest.mark.parametrize("warned", [False, True])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_ratio_pulled_from_the_one_given_and_a_law_far_from_its_prior_or_at_its_bound(
    side, warned
):
    given = 0.3 + side * (2.05 if warned else 1.95) * 0.02
    options = OPTIONS.changed(poisson_ratio=given, poisson_ratio_std=0.02)
    assert bool(warnings(at_truth(options=options))) is warned
    for law, at in (("force_law", FORCE_LAW), ("motion_law", MOTION_LAW)):
        of_all = np.ones(4)
        of_all[at] = 0.1 / (3.05 if warned else 2.95)
        laws = (side * 0.1 * (law == "force_law"), side * 0.1 * (law == "motion_law"))
        best = at_truth(exact(laws=laws), truth=parameters(25e3, 0.3, **{law: side * 0.1}))
        # As if captures determined it so well.
        vars(best)["covariance"] = np.diag(of_all**2)
        assert len(warnings(best)) == warned
    best = at_truth(truth=parameters(25e3, 0.3, side * (FARTHEST_LAW - (5e-7 if warned else 2e-6))))
    # Wide enough for it not to be far from its prior.
    vars(best)["covariance"] = np.eye(4)
    assert len(warnings(best)) == warned


@pytest.mark.parametrize(
    ("where", "times", "warned"),
    [("loaded", 2.95, 0), ("loaded", 3.05, 1), ("far", 5.0, 0), ("unloaded", 5.0, 0)],
)
def test_residuals_under_load_over_the_noise_at_rest(where, times, warned):
    loaded = (CAPTURE.load >= 0.7)[:, None]
    near = np.linalg.norm(CAPTURE.cell_m - CAPTURE.contact_m, axis=1) < 0.045
    at = {"loaded": loaded & near, "far": loaded & ~near, "unloaded": ~loaded & near}[where]
    moved = CAPTURE.moved_m + times * CAPTURE.noise_std_m * at
    assert len(warnings(at_truth(replace(CAPTURE, moved_m=moved)))) == warned


@pytest.mark.parametrize(("law", "verdict"), [(0.0, "identified"), (-0.8, "bounded")])
def test_nothing_is_identified_where_the_law_is_far_from_its_prior(law, verdict):
    capture = indentation_of(25e3, 0.3, 1, laws=(law, law))
    found = estimate_direct([capture], OPTIONS, radius_m=RADIUS_M)
    names = "youngs_modulus_pa", "poisson_ratio"
    assert {found.moduli[name].verdict for name in names} == {verdict}
    assert bool(found.warnings) == (verdict == "bounded")
    if law:
        capture = indentation_of(25e3, 0.3, 1, laws=(-2.8, 0.0), noise=0.3)
        options = OPTIONS.changed(force_law_std=5.0)
        found = estimate_direct([capture], options, radius_m=RADIUS_M)
        assert found.solution.parameters[0].force_law == -FARTHEST_LAW
        assert found.to_dict()["warnings"]
        assert "identified" not in {one.verdict for one in found.moduli.values()}


WIDE = {name: Modulus(30e3, 10e3, 90e3, "bounded", "Pa") for name in LABELS}


def of(low, high, whose="all captures by the Kinect", *, joint=True, verdict="identified"):
    E = Modulus((low + (high or 2 * low)) / 2, low, high, verdict, "Pa")
    return Estimated(whose, WIDE | {"youngs_modulus_pa": E}, joint)


def single(low, high, number=1):
    return of(low, high, f"capture {number:02d} by the Bumblebee2", joint=False)


@pytest.mark.parametrize(
    ("other", "warned"),
    [
        (of(26.3e3, 29.4e3), True),
        (of(26.3e3, 30.8e3), False),
        (of(37e3, 40e3), True),
        # Without an upper end, and one that is not to be trusted.
        (of(36e3, None), False),
        (of(37e3, None), True),
        (of(26.3e3, 29.4e3, verdict="not judged"), False),
    ],
)
def test_two_sensors(other, warned):
    lines = exclusions([of(30.7e3, 36.1e3), other])
    assert [len(one) for one in lines] == [warned, warned] and lines[0] == lines[1]


@pytest.mark.parametrize(
    ("excluded", "captures", "joint"), [(1, 5, 0), (2, 5, 1), (4, 36, 0), (5, 36, 1)]
)
def test_single_captures_miss_by_chance_once_in_twenty(excluded, captures, joint):
    singles = [single(24e3, 35e3, k) for k in range(captures - excluded)]
    singles += [single(20e3, 29e3, 90 + k) for k in range(excluded)]
    said, *of_singles = exclusions([of(30e3, 36e3), *singles])
    assert len(said) == joint
    assert [len(one) for one in of_singles] == [0] * (captures - excluded) + [1] * excluded
    # They are not compared with each other.
    assert exclusions([single(10e3, 11e3), single(20e3, 21e3)]) == [[], []]
