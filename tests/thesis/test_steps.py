"""Options of the error minimisation: its reduced form, and what is left out."""

import numpy as np
import pytest
from palpate.solid.laws import lame_from_engineering
from thesis.minimise.objective import Objective
from thesis.minimise.reduced_objective import ReducedObjective

BOTH = ["displacement", "force_displacement"]


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
