"""Reduced models against full solves."""

import numpy as np
import pytest
from full_solves import energy_error
from palpate.solid.mesh import solid_mesh
from palpate.solid.stiffness import elastic_stiffness
from skfem import MeshTet
from thesis.minimise.reduced import lame_ratio, reduced_model

RATIOS = (0.0, 0.11, 0.23, 0.37, 0.45, 0.48, 0.495, 0.499)


@pytest.fixture(scope="module")
def system():
    """Stiffness of a block held at its base, and two loads."""
    grid = MeshTet.init_tensor(
        *(np.linspace(0, size, n) for size, n in ((0.3, 9), (0.2, 6), (0.05, 4)))
    )
    mesh = solid_mesh(grid.p.T, grid.t.T)
    free = np.repeat(mesh.nodes_m[:, 2] > 1e-9, 3)
    A1, A2 = (K[free][:, free] for K in elastic_stiffness(mesh))
    loads = np.random.default_rng(3).normal(size=(2, free.sum()))
    return A1, A2, *loads


@pytest.mark.parametrize("kind", ["load", "prescribed", "both"])
def test_as_good_as_full_solves(system, kind):
    A1, A2, b1, b2 = system
    loads = {"load": b1} if kind == "load" else {"lam_load": A1 @ b1, "mu_load": A2 @ b1 + b2}
    loads |= {"load": 1e4 * b2} if kind == "both" else {}
    model = reduced_model(A1, A2, **loads)
    for nu in RATIOS:
        for mu in (1.0, 3e4):
            assert energy_error(model, lame_ratio(nu) * mu, mu) < 1e-5


def test_more_derivatives_and_more_ratios_help(system):
    A1, A2, b, _ = system
    place = lame_ratio(0.4), 1.0

    def error(shifts, moments):
        return energy_error(reduced_model(A1, A2, load=b, shifts=shifts, moments=moments), *place)

    assert error(3, 2) > 10 * error(3, 4) > 100 * error(3, 6)
    assert error(2, 4) > 10 * error(4, 4)


@pytest.mark.parametrize("nu", [*RATIOS, -0.3])
def test_bound_holds_and_is_sharp(system, nu):
    A1, A2, b, _ = system
    model = reduced_model(A1, A2, load=b, moments=3)
    lam, mu = 2e4 * lame_ratio(nu), 2e4
    true, bound = energy_error(model, lam, mu), model.error_bounds([(lam, mu)])[0]
    assert true <= bound <= 6 * true + 1e-10


def test_derivatives(system):
    A1, A2, b1, b2 = system
    model = reduced_model(A1, A2, lam_load=b1, mu_load=b2, load=b1 + b2)
    place, step = np.array([5.0, 2.0]), 1e-5
    slope = model.amplitude_derivatives(*place)
    for axis, e in enumerate(np.eye(2)):
        ahead, behind = (model.amplitudes(*(place + side * step * e)) for side in (1, -1))
        assert np.allclose(slope[:, axis], (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-10)


def test_exact_at_its_ratios(system):
    A1, A2, b, _ = system
    model = reduced_model(A1, A2, load=b, moments=1)
    assert energy_error(model, model.shift, 1.0) < 1e-10
    assert energy_error(model, 1.1 * model.shift, 1.0) > 1e-6


def test_bad_input(system):
    A1, A2, b, _ = system
    with pytest.raises(ValueError, match="moduli: expected those of a stable solid"):
        reduced_model(A1, A2, load=b).error_bounds([(1.0, 1.0), (-0.7, 1.0)])
    with pytest.raises(ValueError, match="load: expected a load that is not zero"):
        reduced_model(A1, A2)
    with pytest.raises(ValueError, match="poisson_ratios: expected -0.4 < low < high < 0.5"):
        reduced_model(A1, A2, load=b, poisson_ratios=(0.3, 0.5))
