"""The simulated block (Sections 3.3.2 to 3.3.4): tracked, and what both methods find of it."""

import logging
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.json_fields import read_all, read_one
from palpate.report import outputs, tables
from palpate.solid.support import read_support
from palpate.surface.tracked import load_tracked, save_tracked
from palpate.workflow.job import naming

from thesis.chapter3 import simulation_figures, simulation_tables
from thesis.minimise.fit import fit_moduli, minimum_files
from thesis.minimise.linear import linear_method
from thesis.minimise.objective import Objective, Problem
from thesis.minimise.options import Minimise
from thesis.minimise.problem import pose_simulation, pressed_area_modulus
from thesis.options import Simulation
from thesis.tracker.simulation import SimulatedSteps, read_steps, track_steps

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


def make_linear_method(inputs: Any, params: Any) -> dict:
    """The linear method from every start, with its traces."""
    _, problem = read_problem(inputs, params.options["support"])
    linear, found = Simulation.read(params.options).linear, []
    limits = {"iterations": linear.iterations, "tolerance": linear.tolerance}
    for start in linear.starts_pa:
        with naming(inputs.steps):
            estimate = linear_method(problem, start=start, **limits)
        found.append(asdict(estimate) | {"start_pa": start})
        logging.info("from %s Pa: %d iterations", start, estimate.iterations)
    return {"result": {"data": params.data, "estimates": found}}


def make_simulation_minimise(inputs: Any, params: Any) -> dict:
    """The minimum with its trace, and tracked and computed displacement of each node."""
    triangle, problem = read_problem(inputs, params.support)
    with naming(inputs.steps):
        objective = Objective(problem, params.error)
    E_star = pressed_area_modulus(problem, triangle)
    found = fit_moduli(objective, E_star, Minimise.read(params.options))
    known = {"data": params.data, "start_reduced_modulus_pa": E_star}
    known |= {"nodes": len(problem.mesh.nodes_m)}
    return minimum_files(objective, found, problem.mesh, known)


def make_simulation_table(inputs: Any, params: Any) -> pd.DataFrame:
    """Moduli of the block by method and data."""
    linear = dict(zip(params.data, read_all(inputs.linear), strict=True))
    found = simulation_tables.simulation_table(
        linear, read_all(inputs.minima), pd.read_csv(inputs.published), read_one(inputs.truth)
    )
    return tables.rounded(found)


def make_simulation_tracking(inputs: Any, params: Any) -> pd.DataFrame:
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
    return tables.rounded(table.assign(provenance="simulated"))


def _changed(options: Simulation, changes: Mapping) -> Simulation:
    """Options with those of a variant."""
    points = {name: value for name, value in changes.items() if name in ("cuts", "corners")}
    tracking = {name: value for name, value in changes.items() if name not in points}
    return options.changed(tracking=options.tracking.changed(**tracking), **points)


def row_of(steps: SimulatedSteps, options: Simulation, search: Minimise) -> dict:
    """Tracking errors of one variant, and the moduli that both methods find."""
    tracked = track_steps(steps, options.tracking, cuts=options.cuts, corners=options.corners)
    errors = simulation_tables.tracking_errors(steps, tracked)
    problem = pose_simulation(steps, read_support(options.support.written()), tracked=tracked)
    methods = {"linear": options.linear, "search": search}
    found = simulation_tables.every_method(problem, steps.triangle, **methods)
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
    methods = {"linear": options.linear, "search": Minimise.read(params.search)}
    rng, found = np.random.default_rng(params.seed), []
    with naming(inputs.steps):
        problem = pose_simulation(steps, read_support(options.support.written()))
        for std in np.repeat(options.noise.std_m, options.noise.repeats):
            noisy = simulation_tables.with_noise(problem, std, rng)
            estimates = simulation_tables.every_method(noisy, steps.triangle, **methods)
            found += [
                {"method": method, "std_m": std}
                | {name: getattr(estimate, name) for name in simulation_tables.LAME}
                for method, estimate in estimates.items()
            ]
    table = simulation_tables.noise_table(found, read_one(inputs.truth))
    made = outputs.table(tables.rounded(table), **params.table)
    return made | {"figure": simulation_figures.noise_figure(table)}
