"""Options of the error minimisation: what is left out, and co-rotational strain."""

import numpy as np
import pytest
from full_solves import largest_error
from made_up_indentation import MINIMISE as OPTIONS
from palpate.estimate.minimise.objective import Measurement, Objective
from palpate.estimate.minimise.problem import Problem, tracked_rotations
from palpate.estimate.minimise.reduced_objective import ReducedObjective
from palpate.estimate.minimise.search import minimise_error
from palpate.solid.boundary import node_sets
from palpate.solid.log_neo_hookean import LogNeoHookean
from palpate.solid.mesh import solid_mesh
from palpate.solid.moduli import lame_from_engineering
from palpate.solid.solve import factorise
from palpate.solid.support import Support
from skfem import MeshTet

BOTH = ["displacement", "force_displacement"]
PLACES = [(1e4, 0.0), (3e4, 0.3), (26e3, 0.45), (2e4, 0.498)]
E, NU = 25e3, 0.3


def newton(elastic, f, free):
    """Places of the nodes of a neo-Hookean solid under dead loads."""
    x = elastic.mesh.nodes_m.copy()
    for part in np.linspace(0.1, 1, 10):
        for _ in range(12):
            forces, blocks = elastic.forces_and_blocks(x)
            right = (part * f - forces).ravel()[free]
            step = np.zeros(x.size)
            step[free] = factorise(elastic.matrix(blocks)[free][:, free])(right)
            x = x + step.reshape(-1, 3)
            if np.abs(step).max() < 1e-9:
                break
    return x


@pytest.fixture(scope="module")
def beam():
    """Slender beam on the plane x = 0, bent by a third of its length at small strain."""
    ends = ((0.3, 16), (0.03, 3), (0.03, 3))
    grid = MeshTet.init_tensor(*(np.linspace(0, size, n) for size, n in ends))
    mesh = solid_mesh(grid.p.T, grid.t.T)
    tip = np.flatnonzero(mesh.nodes_m[:, 0] > 0.3 - 1e-9)
    f = np.zeros_like(mesh.nodes_m)
    f[tip] = [0, 0, -0.05 / len(tip)]
    wall = Support(np.zeros(3), np.array([1.0, 0, 0]), 1e-6)
    sets = node_sets(mesh, wall, contact_nodes=tip)
    free = np.repeat(mesh.nodes_m[:, 0] > 1e-9, 3)
    x = newton(LogNeoHookean(mesh, *lame_from_engineering(E, NU)), f, np.flatnonzero(free))
    u = x - mesh.nodes_m
    u[sets.interior] = np.nan
    return Problem(mesh, sets, Measurement(u, f, 0.05))


@pytest.fixture(scope="module")
def turned(beam):
    rotations = tracked_rotations(beam.mesh, beam.sets, beam.measurement)
    return Problem(beam.mesh, beam.sets, beam.measurement, None, rotations)


def recovered(problem, option):
    return minimise_error(ReducedObjective(problem.objective(option)), (2e4, 0.2), OPTIONS)


@pytest.mark.parametrize("option", BOTH)
def test_a_beam_that_turns_is_right_with_corotational_strain_alone(beam, turned, option):
    u = beam.measurement.displacement_m
    assert np.nanmin(u[:, 2]) < -0.09
    linear, better = (recovered(problem, option) for problem in (beam, turned))
    assert abs(better.youngs_modulus_pa / E - 1) < 0.02
    assert abs(linear.youngs_modulus_pa / E - 1) > 0.08
    assert better.error_m < 0.1 * linear.error_m


@pytest.mark.parametrize("option", BOTH)
def test_the_reduced_objective_is_the_full_one(turned, option):
    full = turned.objective(option)
    fast = ReducedObjective(full)
    for place in PLACES:
        moduli = lame_from_engineering(*place)
        assert fast(*moduli) == pytest.approx(full(*moduli), rel=1e-5)
        assert largest_error(fast, *moduli) <= fast.error_bounds([moduli])[0] < 1e-5


@pytest.mark.parametrize("option", BOTH)
def test_derivatives_of_the_gaps(turned, option):
    fast = ReducedObjective(turned.objective(option))
    place, step = np.array(lame_from_engineering(2e4, 0.33)), 1.0
    for axis, e in enumerate(np.eye(2)):
        ahead, behind = (fast.gaps(*(place + side * step * e)) for side in (1, -1))
        for (_, _, slope), (_, one, _), (_, other, _) in zip(
            fast.gaps(*place), ahead, behind, strict=True
        ):
            assert np.allclose(slope[..., axis], (one - other) / (2 * step), rtol=1e-4, atol=1e-13)


def test_more_completions_change_nothing(beam, turned):
    more = tracked_rotations(beam.mesh, beam.sets, beam.measurement, completions=5)
    assert np.abs(more - turned.rotations).max() < 1e-3


@pytest.mark.parametrize("reduced", [False, True])
def test_what_is_left_out_changes_the_displacement_term_alone(exact, reduced):
    noisy = exact.noisy(1e-4)
    out = np.concatenate([noisy.sets.contact, noisy.sets.free[:20]])
    parts = noisy.mesh, noisy.sets, noisy.measurement
    moduli = lame_from_engineering(2e4, 0.3)

    def errors(left_out, option):
        full = Objective(*parts, option=option, left_out=left_out)
        return (ReducedObjective(full) if reduced else full)(*moduli)

    whole = Objective(*parts, option=BOTH[0])
    kept = ~np.isin(whole.surface, out)
    left = errors(out, BOTH[0])
    assert left == pytest.approx(whole.displacement_errors(*moduli)[kept].mean(), rel=1e-6)
    force = [errors(nodes, BOTH[1]) - errors(nodes, BOTH[0]) for nodes in (None, out)]
    assert force[1] == pytest.approx(force[0], rel=1e-9)
    assert left != pytest.approx(errors(None, BOTH[0]), rel=1e-3)


def test_both_options_share_one_objective(exact):
    noisy, moduli = exact.noisy(1e-4), lame_from_engineering(2e4, 0.3)
    first = noisy.objective(BOTH[0])
    for option in BOTH:
        shared = ReducedObjective(first.with_option(option))
        alone = ReducedObjective(noisy.objective(option))
        assert shared(*moduli) == alone(*moduli)
    assert len(first.displacement_models) == len(first.interior_models) == 1


def test_bad_input(exact):
    with pytest.raises(ValueError, match="left_out: expected surface nodes to compare off"):
        Objective(
            exact.mesh,
            exact.sets,
            exact.measurement,
            option=BOTH[0],
            left_out=exact.mesh.surface_nodes(),
        )
    with pytest.raises(ValueError, match="error: expected one of"):
        exact.objective(BOTH[0]).with_option("all")
