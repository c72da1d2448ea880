"""The simulated block (Sections 3.3.2 to 3.3.4): tracked, and what both methods find of it."""

import logging
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.estimate.minimise.fit import fit_moduli
from palpate.estimate.minimise.linear import linear_method
from palpate.estimate.minimise.objective import Objective
from palpate.estimate.minimise.options import Minimise
from palpate.estimate.minimise.problem import Problem
from palpate.estimate.minimise.simulation import pose_simulation, pressed_area_modulus
from palpate.json_fields import read_all, read_one
from palpate.report import outputs, tables
from palpate.solid.support import Support, read_support
from palpate.surface.simulation import SimulatedSteps, read_steps, track_steps
from palpate.surface.tracked import load_tracked, save_tracked
from palpate.workflow.job import naming

from thesis import published
from thesis.chapter3 import simulation_figures, simulation_tables
from thesis.minimum import minimum_files
from thesis.options import LinearMethod, Simulation

MODULI_TITLE = "Sections 3.3.2 to 3.3.4: Lame parameters, E (Pa) and nu of the simulated block"
TRACKER_TITLE = "Simulated block: errors of the tracker (m) and what follows from them (Pa)"
NOISE_TITLE = "Simulated block: Lame parameters (Pa) from exact displacements with noise (m)"
# Of a variant of the tracker's options.
SHOWN = ("cuts", "corners", "data_term", "s_sm", "w_sm_stop")


def make_simulation_tracked(inputs: Any, params: Any) -> dict:
    """The block's own surface through its steps."""
    options, steps = Simulation.read(params.options), read_steps(inputs.steps)
    with naming(inputs.steps):
        tracked = track_steps(steps, options.tracking, cuts=options.cuts, corners=options.corners)
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.4f mm", k, residual * 1e3)
    return {"tracked": partial(save_tracked, tracked=tracked)}


def read_problem(inputs: Any, support: Mapping) -> tuple[NDArray, Problem]:
    """The loaded nodes and the inverse problem, on tracked data where the rule gives any."""
    read = read_steps(inputs.steps)
    surface = load_tracked(inputs.tracked) if inputs.tracked else None
    with naming(inputs.tracked, "tracked"), naming(inputs.steps, "support", "contact"):
        return read.triangle, pose_simulation(read, read_support(support), tracked=surface)


def _support(options: Simulation) -> Support:
    return read_support(options.support.written())


def make_linear_method(inputs: Any, params: Any) -> dict:
    """The linear method from every start, with its traces."""
    _, problem = read_problem(inputs, params.options["support"])
    with naming(inputs.steps):
        found = from_every_start(problem, Simulation.read(params.options).linear)
    return {"result": {"data": params.data, "estimates": found}}


def from_every_start(problem: Problem, linear: LinearMethod) -> list[dict]:
    """Estimates of the linear method, as they are to be written."""
    found = []
    for start in linear.starts_pa:
        estimate = linear_method(
            problem.mesh,
            problem.sets,
            problem.measurement,
            start=start,
            iterations=linear.iterations,
            tolerance=linear.tolerance,
        )
        found.append(asdict(estimate) | {"start_pa": start})
        logging.info("from %s Pa: %d iterations", start, estimate.iterations)
    return found


def make_simulation_minimise(inputs: Any, params: Any) -> dict:
    """The minimum with its trace, and tracked and computed displacement of each node."""
    triangle, problem = read_problem(inputs, params.support)
    with naming(inputs.steps):
        full = Objective(problem.mesh, problem.sets, problem.measurement, option=params.error)
    E_star = pressed_area_modulus(problem, triangle)
    found = fit_moduli(full, E_star, Minimise.read(params.options), nodes_m=problem.mesh.nodes_m)
    known = {"data": params.data, "start_reduced_modulus_pa": E_star}
    known |= {"nodes": len(problem.mesh.nodes_m)}
    return minimum_files(full, found, problem.mesh, known)


def make_simulation_table(inputs: Any, params: Any) -> dict:
    """Moduli of the block by method and data."""
    linear = dict(zip(params.data, read_all(inputs.linear), strict=True))
    found = simulation_tables.simulation_table(
        linear, read_all(inputs.minima), pd.read_csv(inputs.published), read_one(inputs.truth)
    )
    return published.table(tables.rounded(found), title=MODULI_TITLE)


def make_simulation_tracking(inputs: Any, params: Any) -> dict:
    """What the estimates owe to the tracker: each variant of its options."""
    options, steps = Simulation.read(params.options), read_steps(inputs.steps)
    variants = {"chosen": {}} | {name: one.written() for name, one in options.variants.items()}
    search, rows = Minimise.read(params.search), []
    for name, changes in variants.items():
        logging.info("%s: %s", name, changes)
        with naming(inputs.steps):
            found = row_of(steps, _changed(options, changes), search)
        rows.append({"variant": name} | found)
    truth, table = read_one(inputs.truth), pd.DataFrame(rows)
    for key in ("lambda_pa", "mu_pa"):
        table[f"true_lame_{key}"] = truth[key] if truth else None
    table = tables.rounded(table.assign(provenance="simulated"))
    return outputs.table(table, title=TRACKER_TITLE)


def _changed(options: Simulation, changes: Mapping) -> Simulation:
    """Options with those of a variant."""
    points = {name: value for name, value in changes.items() if name in ("cuts", "corners")}
    tracking = {name: value for name, value in changes.items() if name not in points}
    return options.changed(tracking=options.tracking.changed(**tracking), **points)


def row_of(steps: SimulatedSteps, options: Simulation, search: Minimise) -> dict:
    """Tracking errors of one variant, and the moduli that both methods find."""
    tracked = track_steps(steps, options.tracking, cuts=options.cuts, corners=options.corners)
    errors = simulation_tables.tracking_errors(steps, tracked)
    problem = pose_simulation(steps, _support(options), tracked=tracked)
    found = simulation_tables.every_method(
        problem, steps.triangle, linear=options.linear, search=search
    )
    moduli = {
        f"{method}_{name}": getattr(found[key], name)
        for method, key in (("linear", "linear_method"), ("minimise", "minimise_displacement"))
        for name in simulation_tables.MODULI
    }
    every = options.tracking.written() | {"cuts": options.cuts, "corners": options.corners}
    shown = {key: every[key] for key in SHOWN}
    return shown | {key: round(value, 7) for key, value in errors.items()} | moduli


def make_simulation_noise(inputs: Any, params: Any) -> dict:
    """What noise on exact displacements does to the linear method and both error options."""
    options, steps = Simulation.read(params.options), read_steps(inputs.steps)
    truth = read_one(inputs.truth)
    with naming(inputs.steps):
        problem = pose_simulation(steps, _support(options))
        rng = np.random.default_rng(params.seed)
        found = drawn(problem, steps.triangle, options, Minimise.read(params.search), rng)
    table = simulation_tables.noise_table(found, truth)
    made = outputs.table(tables.rounded(table), title=NOISE_TITLE)
    return made | {"figure": simulation_figures.noise_figure(table)}


def drawn(
    problem: Problem,
    triangle: NDArray,
    options: Simulation,
    search: Minimise,
    rng: np.random.Generator,
) -> list[dict]:
    """Lame parameters by every method, for each draw of each noise."""
    found = []
    for std in options.noise.std_m:
        for _ in range(options.noise.repeats):
            noisy = simulation_tables.with_noise(problem, std, rng)
            estimates = simulation_tables.every_method(
                noisy, triangle, linear=options.linear, search=search
            )
            found += [
                {
                    "method": method,
                    "std_m": std,
                    "lame_lambda_pa": estimate.lame_lambda_pa,
                    "lame_mu_pa": estimate.lame_mu_pa,
                }
                for method, estimate in estimates.items()
            ]
    return found
