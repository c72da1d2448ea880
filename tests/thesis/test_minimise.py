"""Objective and minimisation on exact data of the solid itself."""

import numpy as np
import pytest
from indented_block import LAM, MU
from indented_block import MINIMISE as OPTIONS
from palpate.solid.laws import (
    engineering_from_lame,
    lame_from_engineering,
    reduced_modulus,
)
from thesis.minimise.objective import Measurement, Objective
from thesis.minimise.search import hertz_start, minimise_error


def test_moduli():
    E, nu = engineering_from_lame(LAM, MU)
    assert (round(E), round(nu, 3)) == (25998, 0.45)
    assert lame_from_engineering(E, nu) == pytest.approx((LAM, MU))
    # Table 5.3, Bumblebee, point 8.
    assert reduced_modulus(19165, 0.3460) == pytest.approx(21771, abs=1)


@pytest.mark.parametrize("option", ["displacement", "force_displacement"])
def test_objective_vanishes_at_the_truth_and_only_there(exact, option):
    cost = exact.objective(option)
    at_truth = cost(LAM, MU)
    assert at_truth < 1e-9
    assert cost(1.1 * LAM, MU) > 1e-7 > 100 * at_truth
    assert cost(LAM, 0.9 * MU) > 1e-7


@pytest.mark.parametrize("option", ["displacement", "force_displacement"])
def test_minimisation_finds_the_truth(exact, option):
    cost = exact.objective(option)
    E, nu = engineering_from_lame(LAM, MU)
    start = hertz_start(cost, reduced_modulus(E, nu) * 1.3, [0.05, 0.25, 0.45])
    found = minimise_error(cost, start, OPTIONS)
    assert found.youngs_modulus_pa == pytest.approx(E, rel=1e-4)
    assert found.poisson_ratio == pytest.approx(nu, abs=1e-4)
    assert found.converged and not found.at_bound
    errors = [step["error_m"] for step in found.trace]
    assert all(np.diff(errors) <= 0)


def test_the_printed_parametrisation_finds_it_too(exact):
    cost = exact.objective("displacement")
    options = OPTIONS.changed(parametrisation="lame", iterations=400)
    found = minimise_error(cost, (33000.0, 0.4), options)
    assert found.youngs_modulus_pa == pytest.approx(25998, rel=1e-3)


def test_the_printed_parametrisation_stays_with_real_solids():
    """Also where the start has no lambda, and where the cost would lead beyond."""

    def cost(lam, mu):
        E, nu = engineering_from_lame(lam, mu)
        return abs(np.log(E / 25e3)) + abs(nu - 0.3)

    options = OPTIONS.changed(parametrisation="lame", iterations=400)
    found = minimise_error(cost, (20e3, 0.0), options)
    assert found.youngs_modulus_pa == pytest.approx(25e3, rel=1e-3)
    assert found.poisson_ratio == pytest.approx(0.3, abs=1e-3)
    astray = minimise_error(lambda lam, mu: (lam + 1e4) ** 2 + (mu + 1e4) ** 2, (2e4, 0.3), options)
    assert astray.lame_mu_pa > 0
    assert astray.at_bound


def test_a_start_on_a_bound_comes_away_from_it():
    def cost(lam, mu):
        E, nu = engineering_from_lame(lam, mu)
        return abs(np.log(E / 25e3)) + abs(nu - 0.3)

    for start in ((100.0, 0.499), (1e8, 0.0)):
        found = minimise_error(cost, start, OPTIONS)
        assert found.youngs_modulus_pa == pytest.approx(25e3, rel=1e-3)
        assert not found.at_bound


def test_bad_input(exact):
    mesh, sets, measurement = exact.mesh, exact.sets, exact.measurement
    with pytest.raises(ValueError, match="error: expected one of"):
        Objective(mesh, sets, measurement, option="all")
    spoiled = measurement.displacement_m.copy()
    spoiled[sets.free[0]] = np.nan
    with pytest.raises(ValueError, match="displacement: expected numbers at all surface nodes"):
        Objective(mesh, sets, Measurement(spoiled, measurement.force_n, 2.0), option="displacement")
    still = Measurement(np.zeros_like(measurement.displacement_m), measurement.force_n, 2.0)
    with pytest.raises(ValueError, match="measurement: expected a deformation and a force"):
        Objective(mesh, sets, still, option="displacement")
    with pytest.raises(ValueError, match="start: expected nu within"):
        minimise_error(lambda lam, mu: 0.0, (1e4, 0.4999), OPTIONS)
