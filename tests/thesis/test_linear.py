"""Linear method on exact data of an independent solver."""

from dataclasses import replace

import numpy as np
import pytest
from floor import floor
from palpate.solid.mesh import solid_mesh
from thesis.minimise.linear import LinearSystem, linear_method
from thesis.minimise.objective import Problem, node_sets
from virtual_lab.block import load_block

# Section 3.3.2: the study's simulated block.
LAM, MU = 80685.0, 8965.0
STARTS = [(1e3, 1e3), (1e4, 5e4), (5e4, 1e4), (2e5, 2e4), (1e6, 1e6)]
LIMITS = {"iterations": 500, "tolerance": 1e-9}
NONE = np.array([], dtype=int)


@pytest.fixture(scope="module")
def exact(root):
    """Problem of the last step, and all its displacements."""
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
    return Problem(mesh, sets, u, f, float(np.linalg.norm(f.sum(axis=0)))), whole


@pytest.mark.parametrize("start", STARTS)
def test_exact_data_give_the_moduli_from_every_start(exact, start):
    found = linear_method(exact[0], start=start, **LIMITS)
    assert found.converged
    assert (found.lame_lambda_pa, found.lame_mu_pa) == pytest.approx((LAM, MU), rel=1e-6)
    assert found.poisson_ratio == pytest.approx(0.45, abs=1e-6)
    residuals = [step["residual_n"] for step in found.trace]
    assert all(np.diff(residuals) < 1e-9), "each half of an iteration can only lower it"
    assert [step["iteration"] for step in found.trace] == list(range(found.iterations + 1))


def test_unknown_displacements_and_support_forces_are_filled_in(exact):
    problem, whole = exact
    u, f = LinearSystem(problem).fill_in(LAM, MU)
    assert np.abs(u - whole).max() < 1e-9
    given = problem.force_n
    assert f[problem.sets.support].sum(axis=0) == pytest.approx(-given.sum(axis=0), abs=1e-6)
    assert np.array_equal(f[problem.sets.contact], given[problem.sets.contact])


def test_moduli_grow_with_the_force_and_fall_with_noise(exact):
    problem, _ = exact
    twice = replace(problem, force_n=2 * problem.force_n)
    found = linear_method(twice, start=STARTS[2], **LIMITS)
    assert found.lame_mu_pa == pytest.approx(2 * MU, rel=1e-6)
    noise = np.random.default_rng(3).normal(0, 1e-3, (265, 3))
    noisy = replace(problem, displacement_m=problem.displacement_m + noise)
    found = linear_method(noisy, start=(LAM, MU), **LIMITS)
    assert abs(found.lame_lambda_pa) < 0.5 * LAM
    assert abs(found.lame_mu_pa) < 0.5 * MU


def test_what_has_not_converged_says_so(exact):
    found = linear_method(exact[0], start=STARTS[0], iterations=3, tolerance=1e-9)
    assert (found.converged, found.iterations) == (False, 3)


@pytest.mark.parametrize("start", [(-1.0, 1e4), (1e4, 0.0), (np.nan, 1e4)])
def test_start_must_be_positive(exact, start):
    with pytest.raises(ValueError, match="start: expected positive lambda and mu, found"):
        linear_method(exact[0], start=start, **LIMITS)


def test_bad_input(exact):
    problem, _ = exact
    u, f = problem.displacement_m.copy(), problem.force_n.copy()
    u[problem.sets.free[0]] = f[problem.sets.contact[0], 2] = np.nan
    cases = [
        (replace(problem, sets=replace(problem.sets, **{name: NONE})), f"{name}: expected at least")
        for name in ("interior", "support", "contact")
    ]
    cases += [
        (replace(problem, displacement_m=u), "displacement: expected numbers at contact and free"),
        (replace(problem, force_n=f), "force: expected numbers at all nodes, found NaN"),
        (replace(problem, force_n=0 * problem.force_n), "force: expected a load on the contact"),
    ]
    for spoiled, line in cases:
        with pytest.raises(ValueError, match=line):
            LinearSystem(spoiled)
