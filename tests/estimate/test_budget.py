"""Each term of the uncertainty budget alone, against its first order by hand."""

from dataclasses import fields, replace

import numpy as np
import pytest
from made_up_indentation import (
    EXACT_TABLE,
    OPTIONS,
    RADIUS_M,
    RELAXATION_TIMES_S,
    SIX_ERRORS,
    UNBONDED,
    indentation_of,
    made_up_table,
    parameters,
    support_axes,
)
from palpate.estimate.direct import quantities
from palpate.estimate.direct.budget import budget_of
from palpate.estimate.direct.deviations import Scales, with_depth_errors
from palpate.estimate.direct.fit import Solution, held_at
from palpate.estimate.direct.indentation import OWN, DirectIndentation
from palpate.estimate.direct.options import (
    BASE_SOURCE,
    TIP_SOURCE,
    UNSTATED,
    Fit,
    ModelStd,
    ProbeUncertainty,
    Rig,
)
from palpate.report.budget_bars import SOURCES
from scipy.integrate import quad
from scipy.stats import chi2, halfnorm, t

# A ratio of the made-up solid's table: between them its derivatives are interpolated.
E, NU = 25e3, 0.35
# Noise of depths and motions beside which each term stands, and as good as none.
NOISE_M, TINY = 5e-5, 1e-10
NOISES, APART = ("noise of the depth", "noise of the motion"), "captures apart"
TAU_S, SHARE_STD = RELAXATION_TIMES_S, 0.1
OF_FIT = {name for name in Fit.model_fields if "_std" in name} - {"model_std"}
NOTHING = OPTIONS.changed(
    **dict.fromkeys(OF_FIT - {"poisson_ratio_std"}, TINY)
    | {"fraction_step_std": 10.0, "sinking_std_m": 0.0, "rocking_std_rad": 0.0}
)
# Samples on one side of the contact, as a camera sees them.
SIDE_M = np.array([[x, y, 0.0] for x in np.linspace(0.016, 0.08, 9) for y in np.linspace(-x, x, 7)])


def as_options_say(capture, options):
    """A capture whose priors are those of the options."""
    return replace(
        capture,
        offset_std_m=options.offset_std_m,
        place_std_m=options.place_std_m,
        support_axes=support_axes(capture.cell_m, UNBONDED, options),
    )


CAPTURE = indentation_of(
    *(E, NU, 1),
    noise=0.0,
    amplitudes=(0.0, 0.0),
    motion_std_m=NOISE_M,
    solid=(SIDE_M, made_up_table(SIDE_M), made_up_table(SIDE_M)),
)
NO_SLIDING = np.zeros_like(CAPTURE.table.force_per_modulus_m2)
CAPTURE = replace(
    as_options_say(CAPTURE, NOTHING),
    tip_std_m=NOISE_M,
    force_std_n=TINY,
    clock_std_s=TINY,
    table=replace(made_up_table(SIDE_M), softer=NO_SLIDING),
)
TRUTH = parameters(E, NU)
FORCE_N, TIME_S = CAPTURE.force_n[CAPTURE.frames], CAPTURE.time_s[CAPTURE.frames]
SPEED_M_S = CAPTURE.speed_m_s
LOAD = FORCE_N / FORCE_N.max()
JUDGED = [quantities.NAMES.index(f"{name}_pa") for name in ("reduced_modulus", "youngs_modulus")]
JUDGED += [
    quantities.NAMES.index(name) for name in ("poisson_ratio", quantities.SHEAR, quantities.BULK)
]
# Of those by log E and nu, and E, G and K by nu at the same E*.
E_BY_NU = 2 * NU / (1 - NU**2)
G_BY_NU, K_BY_NU = 1 / (1 + NU), 2 / (1 - 2 * NU)
SLOPES = np.array([[1.0, E_BY_NU], [1.0, 0.0], [0.0, 1.0], [1.0, -G_BY_NU], [1.0, K_BY_NU]])
WITH_NU = E_BY_NU + G_BY_NU, K_BY_NU - E_BY_NU


def hertz(force_n=FORCE_N, stiffer=0.0, nu=NU):
    modulus = E * np.exp(stiffer) / (1 - nu**2)
    return (3 * force_n / (4 * modulus * np.sqrt(RADIUS_M))) ** (2 / 3)


DEPTH_M = hertz()


def surface(depth_m=DEPTH_M, nu=NU, place_m=(0.0, 0.0)):
    r = np.linalg.norm(CAPTURE.cell_m[:, :2] - place_m, axis=1)
    return -RADIUS_M * np.outer(depth_m, 1 / r - (5 + 20 * nu**2))


def stacked(depth_m, motion_m):
    """Depths and motions, one after the other."""
    shape = CAPTURE.moved_m.shape
    parts = np.broadcast_to(depth_m, shape[0]), np.broadcast_to(motion_m, shape).ravel()
    return np.concatenate(parts)


def slope(seen, step):
    return (seen(step) - seen(-step)) / (2 * step)


def by_moduli(stiffer=0.0, nu=0.0):
    depth = hertz(stiffer=stiffer, nu=NU + nu)
    return stacked(depth, surface(depth, NU + nu))


MODULI = [slope(by_moduli, 1e-4), slope(lambda x: by_moduli(nu=x), 1e-4)]


def by_force(error_n):
    """What an error of the force makes of depths and motions."""

    def seen(part):
        depth = hertz(FORCE_N + part * error_n)
        return stacked(depth, surface(depth))

    return slope(seen, 1e-4)


def by_place(way):
    return slope(lambda x: stacked(0.0, surface(place_m=x * way)), 1e-5)


def by_share(tau_s):
    """A share that relaxes: the elastic force is larger by what it has taken."""
    fine = np.linspace(0, CAPTURE.time_s[-1], 2001)
    rise = np.diff(np.interp(fine, CAPTURE.time_s, CAPTURE.force_n))
    since = np.maximum(TIME_S[:, None] - (fine[1:] + fine[:-1]) / 2, 0)
    return by_force(-np.expm1(-since / tau_s) @ rise)


def softer():
    """The second law's force over the first's, as a part of it."""
    return (0.4 - 0.4 * NU) * np.sqrt(DEPTH_M / 0.009)


def stiffer_alone():
    """What a law that is stiffer at the contact does to the depth; a force moves the rest alike."""
    depth, _ = np.split(by_force(-softer() * FORCE_N), [len(DEPTH_M)])
    return stacked(depth, 0.0)


def second_law():
    part = (RADIUS_M / np.linalg.norm(CAPTURE.cell_m, axis=1)) ** 2
    return -0.2 * np.outer(softer() * DEPTH_M, part)


def divided(change, depth_covariance, motion_std_m):
    depth, motion = np.split(change, [len(DEPTH_M)])
    root = np.linalg.cholesky(depth_covariance)
    return np.concatenate([np.linalg.solve(root, depth), motion / motion_std_m])


ALONE = np.eye(len(DEPTH_M)) * NOISE_M**2


def covariance_by_hand(learnt=(), known=0.0, depth_covariance=ALONE, motion_std_m=NOISE_M):
    """Of log E, nu and what else is learnt, of which `known` is the inverse beforehand."""
    changes = [*MODULI, *learnt]
    design = np.stack([divided(one, depth_covariance, motion_std_m) for one in changes], axis=1)
    return np.linalg.inv(design.T @ design + known), design


def by_hand(error=0.0, added=0.0, **of):
    """Deviations of those judged, with an error that is learnt of no capture, and what is added."""
    covariance, design = covariance_by_hand(**of)
    variance = np.diag(SLOPES @ covariance[:2, :2] @ SLOPES.T) + np.square(added)
    if np.ndim(error):
        moved = SLOPES @ covariance @ design.T @ divided(error, ALONE, NOISE_M)
        variance = variance + moved**2
    return np.sqrt(variance)


def learnt(*changes):
    """An unknown of the fit, or several of one deviation, by what a unit of each changes."""

    def of(std):
        return {"learnt": changes, "known": np.diag([0, 0] + [std**-2] * len(changes))}

    return of


def shares(std):
    """Known each by itself, and from one to the next."""
    known = np.eye(4) / SHARE_STD**2
    known[:2] = 0
    known[2:, 2:] += np.array([[1, -1], [-1, 1]]) / std**2
    return {"learnt": [by_share(tau) for tau in TAU_S], "known": known}


def error_of(change):
    return lambda std: {"error": std * change}


def added(*moves):
    """By how much a unit moves E*, E, nu, G and K."""
    return lambda std: {"added": std * np.array(moves)}


def depths(variance):
    return lambda std: {"depth_covariance": ALONE + variance(std)}


def alike(std_m):
    """Errors of depths of the same place and time: within 2 mm and 2 s."""
    way, time = np.subtract.outer(DEPTH_M, DEPTH_M), np.subtract.outer(TIME_S, TIME_S)
    return std_m**2 * np.exp(-((way / 0.002) ** 2) / 2 - np.abs(time / 2))


PART, CURVED = TIME_S / CAPTURE.time_s[-1], FORCE_N * RADIUS_M / 2
PLACES = learnt(*map(by_place, np.eye(2)))
# The base lies under the contact.
ROCKING = learnt(*(stacked(0.0, np.outer(LOAD, across)) for across in CAPTURE.cell_m.T[:2]))
OF_FORCE = depths(lambda std: np.diag((2 / 3 * DEPTH_M / FORCE_N * std) ** 2))
OF_TIP = depths(lambda std: ALONE * ((std / NOISE_M) ** 2 - 1))
# By field: its line of the budget, a deviation, and what that does.
TERMS = {
    "force_scale_std": ("scale of the force", 0.02, error_of(by_force(FORCE_N))),
    "force_zero_std_n": ("zero of the force", 0.02, error_of(by_force(np.ones_like(FORCE_N)))),
    "force_drift_std_n": ("drift of the force", 0.05, error_of(by_force(PART))),
    "radius_std_m": ("radius of the sphere", 3e-4, error_of(by_force(FORCE_N / (2 * RADIUS_M)))),
    "curvature_std_per_m": ("curvature of the template", 8.0, error_of(by_force(CURVED))),
    "compliance_std_m_n": ("compliance of the probe", 2e-4, error_of(stacked(FORCE_N, 0.0))),
    "log_youngs_modulus": ("indentation table: force", 0.03, added(1.0, 1.0, 0.0, 1.0, 1.0)),
    "nu": ("indentation table: motion", 0.03, added(0.0, E_BY_NU, 1.0, *WITH_NU)),
    "fraction_std": ("relaxing shares", 0.05, learnt(*map(by_share, TAU_S))),
    "fraction_step_std": ("relaxing shares of neighbouring times", 0.1, shares),
    "gain_std": ("scale of the camera", 0.005, learnt(stacked(0.0, surface()))),
    "force_law_std": ("law of the force", 0.3, learnt(stiffer_alone())),
    "motion_law_std": ("law of the motion", 0.5, learnt(stacked(0.0, second_law()))),
    "sphere_friction": ("friction at the sphere", 0.03, added(1.0, 1.0, 0.0, 1.0, 1.0)),
    "nu_loose": ("indentation table: base friction", 0.08, added(0.0, E_BY_NU, 1.0, *WITH_NU)),
    "poisson_ratio_std": ("Poisson's ratio", 0.01, lambda std: {"known": np.diag([0, std**-2])}),
    "offset_std_m": ("zero of the depth", 2e-4, learnt(stacked(1.0, 0.0))),
    # The surface is seen at the other moment too.
    "clock_std_s": ("clocks", 0.1, learnt(stacked(SPEED_M_S, surface(SPEED_M_S)))),
    # Where the poses' clock is off, force and surface still belong together.
    "camera_clock_std_s": ("clock of the camera", 0.1, learnt(stacked(SPEED_M_S, 0.0))),
    "shift_std_m": ("zero of the motion", 1e-4, learnt(stacked(0.0, 1.0))),
    "place_std_m": ("place of the contact", 3e-3, PLACES),
    # Tip and surface go down together.
    "sinking_std_m": ("sinking", 2e-4, learnt(stacked(LOAD, -LOAD[:, None]))),
    "rocking_std_rad": ("rocking", 3e-3, ROCKING),
    "tip_std_m": ("noise of the depth", 2e-4, OF_TIP),
    "force_std_n": ("noise of the depth", 0.05, OF_FORCE),
    "depth_pattern_std_m": ("noise of the depth", 2e-4, depths(alike)),
    "moved_std_m": ("noise of the motion", 2e-4, lambda std: {"motion_std_m": std}),
}
BESIDE = {
    "fraction_step_std": {"fraction_std": SHARE_STD},
    "poisson_ratio_std": {"poisson_ratio": NU},
}
# What is measured; options have another name for one, and of the noise comes what is divided by.
MEASURED = {one.name for one in fields(DirectIndentation) if "_std" in one.name}
MEASURED -= {"noise_std_m"}
FIELDS = OF_FIT | {*Rig.model_fields, *ModelStd.model_fields} | MEASURED


def with_term(field, std):
    """A capture and options with noise and this term alone."""
    options, capture = NOTHING.changed(**BESIDE.get(field, {})), CAPTURE
    for name in ("rig", "model_std"):
        if hasattr(block := getattr(options, name), field):
            options = options.changed(**{name: block.changed(**{field: std})})
    if hasattr(options, field):
        options = options.changed(**{field: std})
    elif hasattr(capture, field):
        capture = replace(capture, **{field: np.zeros_like(getattr(capture, field)) + std})
    return options, as_options_say(capture, options)


def estimate(options, *captures, known=UNSTATED):
    """What the estimate says of captures at the truth, without a fit."""
    captures = tuple(with_depth_errors(one, TRUTH, options, likeliest=False) for one in captures)
    shared, own = np.split(TRUTH.vector, [-OWN])
    vector, scales = np.r_[shared, np.tile(own, len(captures))], (Scales(),) * len(captures)
    best = Solution(captures, options, vector, scales)
    moduli = quantities.quantities_of(best, radius_m=RADIUS_M)
    budget = budget_of(best, moduli, known, radius_m=RADIUS_M)
    # Of captures that are apart the truth is not where the cost is least.
    profile = quantities.Profile.of(held_at(best, NU), moduli, budget)
    return budget, quantities.intervals(best, moduli, budget, profile)


def budget(options, *captures, known=UNSTATED):
    return estimate(options, *captures, known=known)[0]


def line(budget, name):
    (found,) = (one for one in budget.sources if one.name == name)
    return found


# Errors that each capture has anew; of all others a further capture says next to nothing.
ANEW = {"force_zero_std_n", "force_drift_std_n", "depth_pattern_std_m", "shift_std_m", *MEASURED}


@pytest.mark.parametrize("field", sorted(FIELDS))
def test_a_term_alone_is_what_its_first_order_says(field):
    """And of two captures, which have the support and the camera's place in common.

    A new field has no case, and fails.
    """
    source, std, does = TERMS[field]
    alone = budget(*with_term(field, std))
    options, capture = with_term(field, std / 100)
    hardly, both = (budget(options, *[capture] * count) for count in (1, 2))
    assert alone.std[JUDGED] == pytest.approx(by_hand(**does(std)), rel=0.02)
    assert hardly.std[JUDGED] == pytest.approx(by_hand(**does(std / 100)), rel=0.02)
    assert (alone.std[JUDGED] > 1.1 * hardly.std[JUDGED]).any()
    assert line(alone, source).std > 0
    one, two = (line(found, source).contributions for found in (hardly, both))
    fewer, largest = np.sqrt(2) if field in ANEW else 1, int(np.argmax(one))
    assert two[largest] == pytest.approx(one[largest] / fewer, rel=0.08)


@pytest.mark.parametrize("count", [2, 6])
@pytest.mark.parametrize(("source", "errors"), [(TIP_SOURCE, np.eye(3)), (BASE_SOURCE, SIX_ERRORS)])
def test_tip_and_base_are_one_for_all_captures(source, errors, count):
    """Their error does not fall with their number, and what is left of the contact's place does."""
    root = {source: np.diag([0.0, 1e-6, 1e-6]) @ errors}
    capture = replace(CAPTURE, place_std_m=1e-6, shared_roots_m=root)
    one, all_of = budget(NOTHING, capture), budget(NOTHING, *[capture] * count)
    for name, fewer in ((source, 1), ("place of the contact", np.sqrt(count))):
        parts = [line(found, name).contributions[JUDGED] for found in (one, all_of)]
        at = int(np.argmax(parts[0]))
        assert parts[1][at] == pytest.approx(parts[0][at] / fewer, rel=0.08)
        assert line(all_of, name).std == pytest.approx(1e-6)


def test_the_base_adds_what_an_error_of_the_depth_and_of_the_place_add():
    """Of one capture; each of six errors moves both."""
    std_m = np.array([2e-4, 3e-3, 3e-3])
    base = {BASE_SOURCE: np.diag(std_m) @ SIX_ERRORS}
    found = budget(NOTHING, replace(CAPTURE, shared_roots_m=base))
    changes = [stacked(1.0, 0.0), *map(by_place, np.eye(2))]
    expected = by_hand(learnt=changes, known=np.diag([0, 0, *std_m**-2]))
    assert found.std[JUDGED] == pytest.approx(expected, rel=0.02)
    assert (expected > 1.1 * budget(NOTHING, CAPTURE).std[JUDGED]).any()


def test_the_report_explains_every_source():
    """Of two captures on an unbonded base, at a ratio that is given, with every error there is."""
    moving = {"sinking_std_m": 1e-4, "rocking_std_rad": 1e-3}
    options = Fit(relaxation_times_s=TAU_S, poisson_ratio=NU, **moving)
    capture = replace(
        CAPTURE,
        clock_std_s=0.01,
        support_axes=support_axes(CAPTURE.cell_m, UNBONDED, options),
        camera_clock_std_s=0.02,
        shared_roots_m={name: 5e-4 * np.eye(3) for name in (TIP_SOURCE, BASE_SOURCE)},
    )
    apart = replace(capture, force_n=1.2 * capture.force_n)
    found = budget(options, capture, apart).sources
    assert {one.name for one in found} == set(SOURCES)


@pytest.mark.parametrize(
    "field", ["offset_std_m", "clock_std_s", "camera_clock_std_s", "shift_std_m", "place_std_m"]
)
def test_what_each_capture_has_for_itself_scatters_between_them(field):
    source, std, _ = TERMS[field]
    options, capture = with_term(field, 0.03 * std)
    assert APART not in {one.name for one in budget(options, capture).sources}
    found, without = budget(options, *[capture] * 3), budget(NOTHING, *[CAPTURE] * 3)
    noises = sum(line(without, name).contributions ** 2 for name in NOISES)
    factor = line(without, APART).contributions ** 2 / noises
    assert factor == pytest.approx(likely_excess(0.0, 2), rel=0.05)
    own = sum(line(found, name).contributions ** 2 for name in (source, *NOISES))
    assert line(found, APART).contributions ** 2 == pytest.approx(factor * own, rel=0.005)


def likely_excess(scatter, freedom):
    """Mean of tau^2: a half-normal prior of 0.5, and variances that scatter like chi squared."""

    def weight(tau):
        spread = 1 + tau**2
        likely = chi2.pdf(freedom * scatter / spread, freedom) / spread if scatter else 1.0
        return halfnorm.pdf(tau, scale=0.5) * (likely if scatter else spread ** (-freedom / 2))

    whole, _ = quad(weight, 0, 10, points=[0.5, 2])
    return quad(lambda tau: tau**2 * weight(tau), 0, 10, points=[0.5, 2])[0] / whole


def test_an_interval_is_student_s_quantile_of_what_the_budget_holds():
    """Each part of the data that errs by itself is a degree of freedom, as far as it counts."""
    budget, moduli = estimate(NOTHING, CAPTURE)
    covariance, design = covariance_by_hand()
    parts = (SLOPES @ covariance @ design.T) ** 2
    of_depths, of_motions = np.split(parts, [len(DEPTH_M)], axis=1)
    patches = np.broadcast_to(CAPTURE.cluster, CAPTURE.moved_m.shape).ravel()
    of_patches = np.stack([of_motions[:, patches == k].sum(1) for k in np.unique(patches)], axis=1)
    fourth = 0.0
    for shares in (of_depths, of_patches):
        count = np.maximum(shares.sum(axis=1) ** 2 / (shares**2).sum(axis=1), 4)
        fourth = fourth + shares.sum(axis=1) ** 2 / (count - 1)
    freedom = parts.sum(axis=1) ** 2 / fourth
    assert budget.freedom[JUDGED] == pytest.approx(freedom, rel=0.01)
    half = t.ppf(0.975, freedom) * np.sqrt(parts.sum(axis=1))
    star, nu = (moduli[name] for name in ("reduced_modulus_pa", "poisson_ratio"))
    assert np.log([star.value / star.low, star.high / star.value]) == pytest.approx(
        half[0], rel=0.01
    )
    assert [nu.value - nu.low, nu.high - nu.value] == pytest.approx([half[2]] * 2, rel=0.01)


def test_what_is_stated_of_a_probe_counts():
    found = budget(NOTHING, CAPTURE, known=ProbeUncertainty(compliance_std_m_n=2e-4))
    assert found.std[JUDGED] == pytest.approx(by_hand(2e-4 * stacked(FORCE_N, 0.0)), rel=0.02)
    rows = np.diag([1e-8, 1e-8, 4e-8]).tolist()
    said = ProbeUncertainty.of({"tip_covariance_m2": rows, "compliance_std_m_n": 1e-6})
    assert np.array_equal(said.tip_covariance_m2, rows) and said.compliance_std_m_n == 1e-6
    assert ProbeUncertainty.of({}) == UNSTATED


def test_base_friction():
    """None of a bonded or small base; of another uniform between sliding and sticking.

    A twelfth of the squared difference of log forces.
    """
    for softer in (NO_SLIDING, None, NO_SLIDING - 0.2 * CAPTURE.table.poisson_ratios[:, None]):
        std = 0.08 if softer is None or not softer.any() else 1e-6
        options = NOTHING.changed(model_std=EXACT_TABLE.changed(nu_loose=std))
        capture = replace(CAPTURE, table=replace(CAPTURE.table, softer=softer))
        found = budget(options, capture)
        names = {one.name for one in found.sources}
        assert (TERMS["nu_loose"][0] in names) == (softer is not None)
    contributions = line(found, TERMS["nu_loose"][0]).contributions
    assert contributions == pytest.approx(0.2 * NU / np.sqrt(12) * quantities.LOG_MODULI, abs=1e-4)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_captures_that_are_apart(count):
    """Forces of other scales: E* is their mean, and knows it by their scatter.

    With as many degrees of freedom as captures less one (JCGM 100:2008, Eq. G.2b).
    """
    errors = np.linspace(-0.05, 0.05, count)
    apart = [replace(CAPTURE, force_n=CAPTURE.force_n * (1 + e)) for e in errors]
    for captures, variance in (([CAPTURE] * count, 0.0), (apart, errors.var(ddof=1) / count)):
        found, moduli = estimate(NOTHING, *captures)
        stated = sum(line(found, noise).contributions[0] ** 2 for noise in NOISES)
        expected = stated * likely_excess(variance / stated, count - 1)
        part = line(found, APART)
        assert part.contributions[0] ** 2 == pytest.approx(expected, rel=0.05)
        assert part.freedom == count - 1
    others = sum(one.contributions**4 / one.freedom for one in found.sources if one is not part)
    freedom = found.std**4 / (others + part.contributions**4 / (count - 1))
    star, modulus = quantities.NAMES.index("reduced_modulus_pa"), moduli["reduced_modulus_pa"]
    half = t.ppf(0.975, freedom[star]) * found.std[star]
    ends = np.log([modulus.value / modulus.low, modulus.high / modulus.value])
    assert ends == pytest.approx([half] * 2, rel=0.01)
    # Without them noise alone would have degrees of freedom.
    assert half > 1.03 * t.ppf(0.975, found.std[star] ** 4 / others[star]) * found.std[star]
