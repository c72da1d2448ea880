"""The simulated block: the linear method, its frames, the tracker on them, and its tables."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from floor import floor
from thesis.chapter3 import block
from thesis.minimise.linear import linear_method
from thesis.minimise.objective import Objective
from thesis.minimise.options import Minimise
from thesis.minimise.problem import pose_simulation
from thesis.minimise.search import minimise_error
from thesis.options import Simulation
from thesis.tracker.simulation import read_steps, track_steps
from virtual_lab.block import load_block

# Section 3.3.2: the study's simulated block.
LAM, MU, YOUNG = 80685.0, 8965.0, 25998.5
TRUTH = {"lambda_pa": LAM, "mu_pa": MU}
SUPPORT = floor(1e-6)
STARTS = [(1e3, 1e3), (1e4, 5e4), (5e4, 1e4), (2e5, 2e4), (1e6, 1e6)]
LIMITS = {"iterations": 500, "tolerance": 1e-9}
# Section 3.3.4: E of the study's lambda 85252, mu 9472 over the true one.
PUBLISHED_ERROR = 0.0566


@pytest.fixture(scope="module")
def written(root, tmp_path_factory):
    path = tmp_path_factory.mktemp("simulation") / "steps.npz"
    mesh = root / "config/meshes/simulated_block.vtu"
    np.savez(path, **load_block(mesh, lambda_pa=LAM, mu_pa=MU, traction_pa=-50000, steps=24))
    return path


@pytest.fixture(scope="module")
def steps(written):
    return read_steps(written)


@pytest.fixture(scope="module")
def exact(steps):
    """Problem of the last step."""
    return pose_simulation(steps, SUPPORT)


@pytest.fixture(scope="module")
def tracked(steps):
    return track_steps(steps, Simulation().tracking, cuts=6)


def youngs_error(problem):
    cost = Objective(problem, "displacement")
    return minimise_error(cost, (2e4, 0.3), Minimise()).youngs_modulus_pa / YOUNG - 1


def test_tracker_finds_the_vertices_among_the_points(steps, tracked):
    assert tracked.vertices_m.shape == (25, 204, 3)
    errors = block.tracking_errors(steps, tracked)
    assert errors["tracking_error_m"] < 2e-5
    largest = np.linalg.norm(steps.displacement_m[-1], axis=1).max()
    assert errors["loaded_along_m"] < 0.03 * largest
    assert np.abs(tracked.vertices_m[0] - tracked.rest_m).max() < 1e-9
    shifted = tracked.vertices_m.copy()
    loaded = np.isin(steps.mesh.surface_nodes(), steps.triangle)
    shifted[-1, loaded] += [3e-3, 4e-3, 0]
    errors = block.tracking_errors(steps, replace(tracked, vertices_m=shifted))
    assert errors["loaded_across_m"] == pytest.approx(5e-3, rel=0.02)
    assert errors["loaded_along_m"] < 2e-4
    with pytest.raises(ValueError, match="tracked: expected 204 vertices, found 203"):
        other = replace(tracked, template_m=tracked.template_m[:-1])
        pose_simulation(steps, SUPPORT, tracked=other)


@pytest.mark.long
def test_minimisation_on_tracked_data_does_better_than_the_study(steps):
    """Points as dense as the workflow's: loaded vertices slide over their facets (Figure 3.10)."""
    options = Simulation()
    dense = track_steps(steps, options.tracking, cuts=options.cuts, corners=options.corners)
    assert block.tracking_errors(steps, dense)["loaded_across_m"] > 5e-4
    assert abs(youngs_error(pose_simulation(steps, SUPPORT, tracked=dense))) < PUBLISHED_ERROR


def test_motion_along_the_normal_alone_is_not_enough(steps):
    options = Simulation().tracking.changed(data_term="plane")
    dragged = track_steps(steps, options, cuts=6)
    assert youngs_error(pose_simulation(steps, SUPPORT, tracked=dragged)) > 0.1


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"triangle": None}, "expected nodes_m, .*found no triangle"),
        ({"displacement_m": np.zeros((24, 9, 3))}, r"displacement_m: expected shape \(24, 265, 3"),
        ({"force_n": np.full((24, 265, 3), np.nan)}, "force_n: expected numbers, found NaN"),
        ({"force_n": np.array(["a"])}, r"force_n: expected shape \(1, 265, 3\), found \(1,\)"),
        ({"triangle": np.array([0, 1, 265])}, r"triangle: expected .* 0 to 264, found \[0, 1, 265"),
        ({"triangle": np.array([0, 7, 7])}, r"triangle: expected three different nodes"),
        ({"triangle": np.array([0.5, 1, 2])}, "triangle: expected integers, found float64"),
        ({"tetrahedra": np.zeros((9, 4), int)}, "bad.npz: nodes_m: expected each in an element"),
        ({"triangle": np.array([0, 1, 2], object)}, "expected an NPZ of plain arrays, found none"),
    ],
)
def test_steps_are_checked(written, tmp_path, change, line):
    with np.load(written) as data:
        fields = dict(data) | change
    path = tmp_path / "bad.npz"
    np.savez(path, **{name: value for name, value in fields.items() if value is not None})
    with pytest.raises(ValueError, match=line):
        read_steps(path)
    path.write_bytes(b"no archive")
    with pytest.raises(ValueError, match="bad.npz: file: expected an NPZ of plain arrays"):
        read_steps(path)


def estimate(lam, mu):
    moduli = dict(zip(block.MODULI, (lam, mu, YOUNG, 0.45), strict=True))
    return moduli | {"iterations": 4, "converged": True, "trace": [], "start_pa": [1e3, 1e4]}


def test_simulation_table(root):
    published = pd.read_csv(root / "config/published/simulation.csv")
    minimum = estimate(LAM, MU) | {"youngs_modulus_pa": 1.02 * YOUNG, "data": "tracked"}
    minimum |= {"error_option": "displacement", "evaluations": 99, "at_bound": False}
    linear = {name: {"estimates": [estimate(LAM, MU)]} for name in ("exact", "tracked")}
    table = block.simulation_table(linear, [minimum], published, TRUTH)
    rows = table.set_index(["method", "data"])
    assert rows.loc[("linear_method", "tracked"), "published_lame_lambda_pa"] == -21504
    ours = rows.loc[("minimise_displacement", "tracked")]
    assert ours["youngs_modulus_ratio"] == pytest.approx(1.02, abs=1e-4)
    printed = ours["published_youngs_modulus_pa"] / ours["true_youngs_modulus_pa"] - 1
    assert printed == pytest.approx(PUBLISHED_ERROR, abs=1e-4)
    unknown = block.simulation_table(linear, [minimum], published, None)
    assert unknown["youngs_modulus_ratio"].isna().all()


def test_noise_spares_the_forces_and_biases_their_term(steps, exact):
    """As it does the linear method; the displacement alone stays within a few percent."""
    noisy = block.with_noise(exact, 3e-4, np.random.default_rng(3))
    gap = noisy.displacement_m - exact.displacement_m
    assert np.nanstd(gap) == pytest.approx(3e-4, rel=0.1)
    assert noisy.force_n is exact.force_n
    options = {"linear": Simulation().linear, "search": Minimise()}
    found = block.every_method(noisy, steps.triangle, **options)
    part = {method: estimate.lame_lambda_pa / LAM for method, estimate in found.items()}
    assert part["linear_method"] < 0.4
    assert part["minimise_force_displacement"] < 0.7
    assert part["minimise_displacement"] == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("start", STARTS)
def test_exact_data_give_the_moduli_from_every_start(exact, start):
    found = linear_method(exact, start=start, **LIMITS)
    assert found.converged
    assert (found.lame_lambda_pa, found.lame_mu_pa) == pytest.approx((LAM, MU), rel=1e-6)
    assert found.poisson_ratio == pytest.approx(0.45, abs=1e-6)
    residuals = [step["residual_n"] for step in found.trace]
    assert all(np.diff(residuals) < 1e-9), "each half of an iteration can only lower it"
