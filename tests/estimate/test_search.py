"""Fast objective, least squares, profile: against the full objective and known answers."""

import numpy as np
import pytest
from palpate.estimate.fit import fit_moduli
from palpate.estimate.least_squares import fit_least_squares, surface_patches
from palpate.estimate.minimise import minimise_error
from palpate.estimate.moduli import (
    engineering_from_lame,
    lame_derivatives,
    lame_from_engineering,
    reduced_modulus,
)
from palpate.estimate.profile import poisson_profile
from palpate.estimate.reduced_objective import ReducedObjective
from palpate.solid.mesh import solid_mesh
from pressed import BOUNDS, LAM, MU, OPTIONS, pressed
from skfem import MeshTet

TRUE = engineering_from_lame(LAM, MU)
PLACES = [(1e4, 0.0), (2e4, 0.13), (3e4, 0.3), (26e3, 0.45), (2e4, 0.498)]
BOTH = ["displacement", "force_displacement"]
NUS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.45, 0.48, 0.499]


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
        assert fast.true_error(*moduli) <= fast.error_bound(*moduli) < 1e-5


def test_moduli_outside_of_the_range_are_solved_in_full(noisy):
    full = noisy.objective("displacement")
    fast = ReducedObjective(full, poisson_ratios=(0.2, 0.4))
    outside = lame_from_engineering(2e4, 0.49)
    assert not fast.holds(*outside)
    assert fast(*outside) == full(*outside)


def test_a_solid_without_interior_nodes():
    grid = MeshTet.init_tensor(*(np.linspace(0, 0.1, n) for n in (2, 3, 3)))
    full = pressed(solid_mesh(grid.p.T, grid.t.T), [0.05, 0.05, 0.1]).objective(BOTH[1])
    assert not len(full.interior_dofs)
    fast = ReducedObjective(full)
    for place in PLACES:
        moduli = lame_from_engineering(*place)
        assert fast(*moduli) == pytest.approx(full(*moduli), rel=1e-6)


def test_derivatives_of_the_moduli():
    E, nu, step = 2e4, 0.33, 1e-6
    for axis, (by_log, by_nu) in enumerate(((step, 0), (0, step))):
        ahead = lame_from_engineering(E * np.exp(by_log), nu + by_nu)
        behind = lame_from_engineering(E * np.exp(-by_log), nu - by_nu)
        slope = (np.array(ahead) - behind) / (2 * step)
        assert lame_derivatives(E, nu)[:, axis] == pytest.approx(slope, rel=1e-7)


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
    patches = surface_patches(exact.mesh.nodes_m, size_m=0.02)
    found = fit_least_squares(fast, (3e4, 0.3), patches=patches, norm=norm, **BOUNDS)
    assert (found.youngs_modulus_pa, found.poisson_ratio) == pytest.approx(TRUE, rel=1e-6)


@pytest.mark.parametrize("option", BOTH)
def test_least_squares_and_nelder_mead_meet(noisy, option):
    """The norm of lengths is the study's objective itself."""
    fast = ReducedObjective(noisy.objective(option))
    patches = surface_patches(noisy.mesh.nodes_m, size_m=0.02)
    simplex = minimise_error(fast, (2e4, 0.3), OPTIONS)
    found = fit_least_squares(fast, (2e4, 0.3), patches=patches, **BOUNDS)
    assert found.youngs_modulus_pa == pytest.approx(simplex.youngs_modulus_pa, rel=1e-4)
    assert found.poisson_ratio == pytest.approx(simplex.poisson_ratio, abs=1e-4)
    assert found.evaluations < simplex.evaluations / 2


def test_standard_errors_are_those_of_repeated_noise(exact):
    patches = surface_patches(exact.mesh.nodes_m, size_m=0.02)
    found = [
        fit_least_squares(
            ReducedObjective(exact.noisy(5e-5, seed).objective("displacement")),
            TRUE,
            patches=patches,
            **BOUNDS,
        )
        for seed in range(24)
    ]
    for value, std in (
        ([f.poisson_ratio for f in found], [f.poisson_ratio_std for f in found]),
        (
            [np.log(f.youngs_modulus_pa) for f in found],
            [f.youngs_modulus_std_pa / f.youngs_modulus_pa for f in found],
        ),
    ):
        assert 0.6 < np.mean(std) / np.std(value, ddof=1) < 1.7


def profile_of(pressed_block):
    fast = ReducedObjective(pressed_block.objective("displacement"))
    patches = surface_patches(pressed_block.mesh.nodes_m, size_m=0.02)
    rise = fit_least_squares(fast, TRUE, patches=patches, **BOUNDS).rise
    limits = BOUNDS["youngs_modulus_bounds_pa"]
    return poisson_profile(fast, NUS, youngs_modulus_bounds_pa=limits, rise_m=rise)


def test_profile_tells_whether_nu_is_known(exact):
    clear, vague = profile_of(exact.noisy(2e-5)), profile_of(exact.noisy(2e-3, 7))
    assert clear.verdict == "identified"
    assert vague.verdict == "not identified"
    assert min(clear.errors_m) < clear.errors_m[0]


def test_intervals_of_nu_cover_it_as_often_as_they_say(exact):
    found = [profile_of(exact.noisy(3e-5, seed)).interval for seed in range(20)]
    assert sum(low <= TRUE[1] <= high for low, high in found) >= 17
    assert np.median(np.ptp(found, axis=1)) < 0.03


def test_the_whole_fit(exact):
    options = OPTIONS | {
        "start_poisson_ratios": [0.05, 0.25, 0.45],
        "profile_poisson_ratios": NUS,
        "patch_m": 0.02,
    }
    found = fit_moduli(
        exact.objective("displacement"),
        1.3 * reduced_modulus(*TRUE),
        options,
        nodes_m=exact.mesh.nodes_m,
    )
    assert found.minimum.youngs_modulus_pa == pytest.approx(TRUE[0], rel=1e-4)
    assert found.reduced_model.relative_error <= found.reduced_model.relative_error_bound < 1e-5
    assert found.profile.verdict == "identified"


def test_bad_input(exact):
    fast = ReducedObjective(exact.objective("displacement"))
    patches = surface_patches(exact.mesh.nodes_m, size_m=0.02)
    with pytest.raises(ValueError, match="norm: expected one of length, square, found cubic"):
        fit_least_squares(fast, (2e4, 0.3), patches=patches, norm="cubic", **BOUNDS)
    with pytest.raises(ValueError, match=r"start: expected nu within \(0.0, 0.499\), found 0.4999"):
        fit_least_squares(fast, (2e4, 0.4999), patches=patches, **BOUNDS)
    with pytest.raises(ValueError, match="poisson_ratios: expected three or more, increasing"):
        poisson_profile(fast, [0.3, 0.2, 0.1], youngs_modulus_bounds_pa=(1e2, 1e8), rise_m=1e-6)
