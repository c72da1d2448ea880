"""Linear method on exact data of an independent solver."""

from dataclasses import replace

import numpy as np
import pytest
from floor import floor
from palpate.estimate.minimise.linear import LinearSystem, linear_method
from palpate.estimate.minimise.objective import Measurement, node_sets
from palpate.solid.mesh import solid_mesh
from virtual_lab.block import load_block

# Section 3.3.2: the study's simulated block.
LAM, MU = 80685.0, 8965.0
STARTS = [(1e3, 1e3), (1e4, 5e4), (5e4, 1e4), (2e5, 2e4), (1e6, 1e6)]
LIMITS = {"iterations": 500, "tolerance": 1e-9}
NONE = np.array([], dtype=int)


@pytest.fixture(scope="module")
def exact(root):
    """Mesh, node sets, measurement of the last step, and all its displacements."""
    steps = load_block(
        root / "config/meshes/simulated_block.vtu",
        lambda_pa=LAM,
        mu_pa=MU,
        traction_pa=-50000,
        steps=2,
    )
    mesh = solid_mesh(steps["nodes_m"], steps["tetrahedra"])
    sets = node_sets(
        mesh,
        floor(1e-6),
        contact_nodes=steps["triangle"],
    )
    f, whole = steps["force_n"][-1], steps["displacement_m"][-1]
    u = whole.copy()
    u[sets.interior] = np.nan
    return mesh, sets, Measurement(u, f, float(np.linalg.norm(f.sum(axis=0)))), whole


@pytest.mark.parametrize("start", STARTS)
def test_exact_data_give_the_moduli_from_every_start(exact, start):
    mesh, sets, measurement, _ = exact
    found = linear_method(mesh, sets, measurement, start=start, **LIMITS)
    assert found.converged
    assert found.lame_lambda_pa == pytest.approx(LAM, rel=1e-6)
    assert found.lame_mu_pa == pytest.approx(MU, rel=1e-6)
    assert found.poisson_ratio == pytest.approx(0.45, abs=1e-6)
    assert found.residual_n < 1e-6
    residuals = [step["residual_n"] for step in found.trace]
    assert all(np.diff(residuals) < 1e-9), "each half of an iteration can only lower it"
    assert [step["iteration"] for step in found.trace] == list(range(found.iterations + 1))


def test_unknown_displacements_and_support_forces_are_filled_in(exact):
    mesh, sets, measurement, whole = exact
    u, f = LinearSystem(mesh, sets, measurement).fill_in(LAM, MU)
    assert np.abs(u - whole).max() < 1e-9
    reaction = f[sets.support].sum(axis=0)
    assert reaction == pytest.approx(-measurement.force_n.sum(axis=0), abs=1e-6)
    assert np.array_equal(f[sets.contact], measurement.force_n[sets.contact])


def test_moduli_grow_with_the_force(exact):
    mesh, sets, measurement, _ = exact
    twice = replace(measurement, force_n=2 * measurement.force_n)
    found = linear_method(mesh, sets, twice, start=STARTS[2], **LIMITS)
    assert found.lame_mu_pa == pytest.approx(2 * MU, rel=1e-6)


def test_noise_takes_the_stiffness_away(exact):
    mesh, sets, measurement, _ = exact
    shaken = measurement.displacement_m + np.random.default_rng(3).normal(0, 1e-3, (265, 3))
    found = linear_method(
        mesh, sets, replace(measurement, displacement_m=shaken), start=(LAM, MU), **LIMITS
    )
    assert abs(found.lame_lambda_pa) < 0.5 * LAM
    assert abs(found.lame_mu_pa) < 0.5 * MU


def test_what_has_not_converged_says_so(exact):
    mesh, sets, measurement, _ = exact
    found = linear_method(mesh, sets, measurement, start=STARTS[0], iterations=3, tolerance=1e-9)
    assert not found.converged
    assert found.iterations == 3


@pytest.mark.parametrize("start", [(-1.0, 1e4), (1e4, 0.0), (np.nan, 1e4)])
def test_start_must_be_positive(exact, start):
    with pytest.raises(ValueError, match="start: expected positive lambda and mu, found"):
        linear_method(*exact[:3], start=start, **LIMITS)


@pytest.mark.parametrize("name", ["interior", "support", "contact"])
def test_no_set_may_be_empty(exact, name):
    mesh, sets, measurement, _ = exact
    with pytest.raises(ValueError, match=f"{name}: expected at least one node, found none"):
        LinearSystem(mesh, replace(sets, **{name: NONE}), measurement)


def test_known_values_must_be_numbers(exact):
    mesh, sets, measurement, _ = exact
    u, f = measurement.displacement_m.copy(), measurement.force_n.copy()
    u[sets.free[0]] = np.nan
    with pytest.raises(ValueError, match="displacement: expected numbers at contact and free"):
        LinearSystem(mesh, sets, replace(measurement, displacement_m=u))
    f[sets.contact[0], 2] = np.nan
    with pytest.raises(ValueError, match="force: expected numbers at all nodes, found NaN"):
        LinearSystem(mesh, sets, replace(measurement, force_n=f))


def test_there_must_be_a_load(exact):
    mesh, sets, measurement, _ = exact
    still = replace(measurement, force_n=np.zeros_like(measurement.force_n))
    with pytest.raises(ValueError, match="force: expected a load on the contact nodes"):
        LinearSystem(mesh, sets, still)
