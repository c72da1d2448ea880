"""Fast objective, least squares, profile: against the full objective and known answers."""

import numpy as np
import pytest
from full_solves import largest_error
from indented_block import BOUNDS, LAM, MU, indented_block
from indented_block import MINIMISE as OPTIONS
from palpate.estimate.direct.deviations import error_clusters
from palpate.solid.laws import engineering_from_lame, lame_from_engineering, reduced_modulus
from palpate.solid.mesh import solid_mesh
from skfem import MeshTet
from thesis.minimise.fit import fit_moduli
from thesis.minimise.least_squares import fit_least_squares
from thesis.minimise.profile import poisson_profile
from thesis.minimise.reduced_objective import ReducedObjective
from thesis.minimise.scatter import correlation_length
from thesis.minimise.search import minimise_error

TRUE = engineering_from_lame(LAM, MU)
PLACES = [(1e4, 0.0), (2e4, 0.13), (3e4, 0.3), (26e3, 0.45), (2e4, 0.498)]
BOTH = ["displacement", "force_displacement"]
NUS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48, 0.499]


def surface_of(pressed_block):
    return {"nodes_m": pressed_block.mesh.nodes_m, "least_patch_m": 0.02}


@pytest.fixture(scope="module")
def noisy(exact):
    return exact.noisy(1e-4)


@pytest.mark.parametrize("option", BOTH)
def test_fast_objective_is_the_full_one(noisy, option):
    full = noisy.objective(option)
    fast = ReducedObjective(full)
    for place in PLACES:
        moduli = lame_from_engineering(*place)
        assert fast(*moduli) == pytest.approx(full(*moduli), rel=1e-6)
        assert largest_error(fast, *moduli) <= fast.error_bounds([moduli])[0] < 1e-5


def test_moduli_outside_of_the_range_are_solved_in_full(noisy):
    full = noisy.objective("displacement")
    fast = ReducedObjective(full, poisson_ratios=(0.2, 0.4))
    outside = lame_from_engineering(2e4, 0.49)
    assert not fast.holds(*outside)
    assert fast(*outside) == full(*outside)


def test_a_solid_without_interior_nodes():
    grid = MeshTet.init_tensor(*(np.linspace(0, 0.1, n) for n in (2, 3, 3)))
    full = indented_block(solid_mesh(grid.p.T, grid.t.T), [0.05, 0.05, 0.1]).objective(BOTH[1])
    assert not len(full.interior_dofs)
    fast = ReducedObjective(full)
    for place in PLACES:
        moduli = lame_from_engineering(*place)
        assert fast(*moduli) == pytest.approx(full(*moduli), rel=1e-6)


@pytest.mark.parametrize("option", BOTH)
def test_derivatives_of_the_gaps(noisy, option):
    fast = ReducedObjective(noisy.objective(option))
    place, step = np.array(lame_from_engineering(2e4, 0.33)), 1.0
    for axis, e in enumerate(np.eye(2)):
        ahead, behind = (fast.gaps(*(place + side * step * e)) for side in (1, -1))
        for (_, _, slope), (_, one, _), (_, other, _) in zip(
            fast.gaps(*place), ahead, behind, strict=True
        ):
            assert np.allclose(slope[..., axis], (one - other) / (2 * step), rtol=1e-5, atol=1e-14)


@pytest.mark.parametrize("norm", ["length", "square"])
@pytest.mark.parametrize("option", BOTH)
def test_least_squares_on_exact_data(exact, option, norm):
    fast = ReducedObjective(exact.objective(option))
    found = fit_least_squares(fast, (3e4, 0.3), norm=norm, **surface_of(exact), **BOUNDS)
    assert found.converged and not found.at_bound
    assert (found.youngs_modulus_pa, found.poisson_ratio) == pytest.approx(TRUE, rel=1e-6)


@pytest.mark.parametrize("option", BOTH)
def test_least_squares_and_nelder_mead_meet(noisy, option):
    """The norm of lengths is the study's objective itself."""
    fast = ReducedObjective(noisy.objective(option))
    simplex = minimise_error(fast, (2e4, 0.3), OPTIONS)
    found = fit_least_squares(fast, (2e4, 0.3), **surface_of(noisy), **BOUNDS)
    assert found.youngs_modulus_pa == pytest.approx(simplex.youngs_modulus_pa, rel=1e-4)
    assert found.poisson_ratio == pytest.approx(simplex.poisson_ratio, abs=1e-4)
    assert found.evaluations < simplex.evaluations / 2


def test_rounding_does_not_depend_on_the_start(noisy):
    fast = ReducedObjective(noisy.objective("displacement"))
    moduli = [
        fit_least_squares(fast, start, **surface_of(noisy), **BOUNDS).youngs_modulus_pa
        for start in ((2e4, 0.3), (200.0, 0.1), (9e5, 0.45))
    ]
    assert moduli == pytest.approx([moduli[0]] * 3, rel=1e-5)


def fit_of(pressed_block, norm="length"):
    fast = ReducedObjective(pressed_block.objective("displacement"))
    return fit_least_squares(fast, TRUE, norm=norm, **surface_of(pressed_block), **BOUNDS)


@pytest.mark.long
@pytest.mark.parametrize("norm", ["length", pytest.param("square", marks=pytest.mark.long)])
def test_standard_errors_are_those_of_repeated_noise(exact, norm):
    found = [fit_of(exact.noisy(3e-5, seed), norm) for seed in range(40)]
    logs = [np.log(f.youngs_modulus_pa) for f in found]
    log_stds = [f.youngs_modulus_std_pa / f.youngs_modulus_pa for f in found]
    nus, nu_stds = ([getattr(f, n) for f in found] for n in ("poisson_ratio", "poisson_ratio_std"))
    # A deviation of 40 draws is itself known to 11 %.
    assert np.mean(log_stds) / np.std(logs, ddof=1) == pytest.approx(1, abs=0.3)
    assert np.mean(nu_stds) / np.std(nus, ddof=1) == pytest.approx(1, abs=0.3)


def profile_of(pressed_block, option="displacement"):
    fast = ReducedObjective(pressed_block.objective(option))
    fit = fit_least_squares(fast, TRUE, **surface_of(pressed_block), **BOUNDS)
    limits = BOUNDS["youngs_modulus_bounds_pa"]
    return poisson_profile(fast, NUS, youngs_modulus_bounds_pa=limits, fit=fit)


def test_profile_tells_whether_nu_is_known(exact):
    clear, vague = profile_of(exact.noisy(2e-5)), profile_of(exact.noisy(2e-3, 7))
    assert clear.verdict == "identified"
    assert vague.verdict == "not identified"
    assert min(clear.errors_m) < clear.errors_m[0]


def test_the_force_term_is_not_judged(exact):
    """Noise of the displacement biases it: far from the truth, and sure of it."""
    vague = profile_of(exact.noisy(1e-4), "force_displacement")
    assert vague.verdict == "not judged"
    assert vague.interval is None


def covered(exact, noise):
    intervals = [profile_of(exact.moved(noise(seed))).interval for seed in range(20)]
    judged = [interval for interval in intervals if interval is not None]
    return len(judged), sum(low <= TRUE[1] <= high for low, high in judged)


def test_intervals_of_nu_cover_it_as_often_as_they_say(exact):
    judged, inside = covered(exact, lambda seed: exact.noise(3e-5, seed))
    assert judged == 20
    assert inside >= 17


@pytest.mark.long
def test_correlated_gaps_widen_the_intervals(exact):
    def smooth(seed):
        return exact.noise(3e-5, seed, length_m=0.02)

    # Few patches make standard errors small: four of five, where 95 % are stated.
    judged, inside = covered(exact, smooth)
    assert judged >= 15
    assert inside >= 0.7 * judged
    assert fit_of(exact.moved(smooth(0))).patch_m > 0.04
    assert fit_of(exact.noisy(3e-5)).patch_m == pytest.approx(0.02)


def test_an_offset_of_all_gaps_is_not_taken_for_knowledge(exact):
    shifted = exact.moved(np.broadcast_to([0, 0, 3e-4], exact.mesh.nodes_m.shape))
    assert profile_of(shifted).verdict == "not identified"
    assert fit_of(shifted).unknown == "gaps agree over the surface"


def test_no_standard_error_at_a_bound(exact):
    fit = fit_of(exact.noisy(2e-3, 6))
    assert fit.at_bound
    assert (fit.poisson_ratio_std, fit.unknown) == (None, "at a bound")


def test_correlation_length():
    rng = np.random.default_rng(0)
    points = rng.uniform(0, [0.6, 0.15, 0.0], (500, 3))
    alone = rng.normal(size=(500, 3))
    assert correlation_length(points, alone, bin_m=0.02) == 0
    wave = np.column_stack(
        [np.cos(points[:, 0] / 0.05), np.sin(points[:, 0] / 0.05), 0 * alone[:, 0]]
    )
    # Directions turn by one radian in 5 cm: their cosine falls to 0.2 after about 7 cm.
    assert 0.06 <= correlation_length(points, wave, bin_m=0.02) <= 0.12
    assert len(np.unique(error_clusters(points, size_m=0.1))) <= 14


def test_the_whole_fit(exact):
    options = OPTIONS.changed(start_poisson_ratios=(0.05, 0.25, 0.45), profile_poisson_ratios=NUS)
    found = fit_moduli(
        exact.objective("displacement"),
        1.3 * reduced_modulus(*TRUE),
        options,
        nodes_m=exact.mesh.nodes_m,
    )
    assert found.minimum.youngs_modulus_pa == pytest.approx(TRUE[0], rel=1e-4)
    accuracy = found.reduced_model
    assert accuracy.relative_error_bound <= accuracy.largest_error_bound < 1e-5
    assert found.profile.verdict == "identified"


def test_a_wider_range_takes_more_ratios(exact):
    options = OPTIONS.changed(
        poisson_ratio_bounds=(0.0, 0.4999999),
        start_poisson_ratios=(0.3,),
        profile_poisson_ratios=(0.0, 0.3, 0.4, 0.45, 0.49, 0.4999999),
    )
    objective = exact.noisy(1e-5).objective("displacement")
    found = fit_moduli(objective, 3e4, options, nodes_m=exact.mesh.nodes_m)
    assert found.reduced_model.shifts > 3
    assert found.reduced_model.largest_error_bound <= 1e-5
    assert found.profile.verdict == "identified"


def test_bad_input(exact):
    fast = ReducedObjective(exact.objective("displacement"))
    surface = surface_of(exact)
    with pytest.raises(ValueError, match="norm: expected one of length, square, found cubic"):
        fit_least_squares(fast, (2e4, 0.3), norm="cubic", **surface, **BOUNDS)
    with pytest.raises(ValueError, match=r"start: expected nu within \(0.0, 0.499\), found 0.4999"):
        fit_least_squares(fast, (2e4, 0.4999), **surface, **BOUNDS)
    fit = fit_of(exact)
    with pytest.raises(ValueError, match="poisson_ratios: expected three or more, increasing"):
        poisson_profile(fast, [0.3, 0.2, 0.1], youngs_modulus_bounds_pa=(1e2, 1e8), fit=fit)
