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
    block, moduli = root / "config/meshes/simulated_block.vtu", {"lambda_pa": LAM, "mu_pa": MU}
    steps = load_block(block, **moduli, traction_pa=-50000, steps=2)
    mesh = solid_mesh(steps["nodes_m"], steps["tetrahedra"])
    sets = node_sets(mesh, floor(1e-6), contact_nodes=steps["triangle"])
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


def test_unknown_displacements_and_support_forces_are_filled_in(exact):
    problem, whole = exact
    u, f = LinearSystem(problem).fill_in(LAM, MU)
    assert np.abs(u - whole).max() < 1e-9
    given = problem.force_n
    assert f[problem.sets.support].sum(axis=0) == pytest.approx(-given.sum(axis=0), abs=1e-6)
    assert np.array_equal(f[problem.sets.contact], given[problem.sets.contact])


def test_bad_input(exact):
    problem, _ = exact
    u, f = problem.displacement_m.copy(), problem.force_n.copy()
    u[problem.sets.free[0]] = f[problem.sets.contact[0], 2] = np.nan
    cases = [
        ({"sets": replace(problem.sets, **{name: NONE})}, f"{name}: expected at least")
        for name in ("interior", "support", "contact")
    ]
    cases += [
        ({"displacement_m": u}, "displacement: expected numbers at contact and free"),
        ({"force_n": f}, "force: expected numbers at all nodes, found NaN"),
        ({"force_n": 0 * problem.force_n}, "force: expected a load on the contact"),
    ]
    for change, line in cases:
        with pytest.raises(ValueError, match=line):
            LinearSystem(replace(problem, **change))
    for start in ((1e4, 0.0), (np.nan, 1e4)):
        with pytest.raises(ValueError, match="start: expected positive lambda and mu, found"):
            linear_method(problem, start=start, **LIMITS)
    found = linear_method(problem, start=STARTS[0], iterations=3, tolerance=1e-9)
    assert (found.converged, found.iterations) == (False, 3)
