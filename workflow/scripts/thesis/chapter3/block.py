"""The simulated block (Sections 3.3.2 to 3.3.4): tracked, what methods find of it, its tables."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.json_fields import read_all, read_one
from palpate.report import outputs, tables
from palpate.solid.laws import engineering_from_lame
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import read_solid, refine_near
from palpate.solid.support import read_support
from palpate.surface.tracked import Tracked, load_tracked, save_tracked
from palpate.workflow.job import naming
from palpate.workflow.object_inputs import read_declared

from thesis.chapter3 import simulation_figures
from thesis.minimise.fit import fit_moduli, minimum_files
from thesis.minimise.linear import LinearEstimate, linear_method
from thesis.minimise.objective import Objective, Problem, node_sets
from thesis.minimise.options import Minimise, Solid
from thesis.minimise.problem import pose_simulation, pressed_area_modulus
from thesis.minimise.search import Minimum, hertz_start, minimise_error
from thesis.options import LinearMethod, Simulation
from thesis.tracker.simulation import SimulatedSteps, read_steps, track_steps

# Of a variant of the tracker's options.
SHOWN = ("cuts", "corners", "data_term", "s_sm", "w_sm_stop")
LAME = ["lame_lambda_pa", "lame_mu_pa"]
ERROR_OPTIONS = ("displacement", "force_displacement")
MODULI = [*LAME, "youngs_modulus_pa", "poisson_ratio"]
# Table 3.1: what is known at each kind of node.
KNOWN = {
    "contact": ("tracking", "measured"),
    "free": ("tracking", "0"),
    "support": ("0", "unknown"),
    "interior": ("unknown", "0"),
}


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
    found = simulation_table(
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
    errors = tracking_errors(steps, tracked)
    problem = pose_simulation(steps, read_support(options.support.written()), tracked=tracked)
    methods = {"linear": options.linear, "search": search}
    found = every_method(problem, steps.triangle, **methods)
    moduli = {
        f"{method}_{name}": getattr(found[key], name)
        for method, key in (("linear", "linear_method"), ("minimise", "minimise_displacement"))
        for name in MODULI
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
            noisy = with_noise(problem, std, rng)
            estimates = every_method(noisy, steps.triangle, **methods)
            found += [
                {"method": method, "std_m": std} | {name: getattr(estimate, name) for name in LAME}
                for method, estimate in estimates.items()
            ]
    table = noise_table(found, read_one(inputs.truth))
    made = outputs.table(tables.rounded(table), **params.table)
    return made | {"figure": simulation_figures.noise_figure(table)}


def simulation_table(
    linear: Mapping[str, Mapping],
    minima: Sequence[Mapping],
    published: pd.DataFrame,
    truth: Mapping | None,
) -> pd.DataFrame:
    """Moduli of the simulated block by method and data, beside the true and the printed ones.

    Parameters
    ----------
    linear : mapping
        linear-<data>.json by data; the row shows the first start.
    minima : sequence of mapping
        minimise-<data>-<error>.json.
    published : DataFrame
        config/published/simulation.csv.
    truth : mapping or None
        True ``lambda_pa`` and ``mu_pa``.

    Returns
    -------
    DataFrame
    """
    rows = [_linear_row(data, result["estimates"]) for data, result in linear.items()]
    rows += [
        {name: minimum[name] for name in [*MODULI, "data", "evaluations", "converged", "at_bound"]}
        | {"method": f"minimise_{minimum['error_option']}", "iterations": len(minimum["trace"])}
        for minimum in minima
    ]
    table = pd.DataFrame(rows).merge(_printed(published), on=["method", "data"], how="left")
    true = [np.nan] * 4 if truth is None else _all_moduli(truth["lambda_pa"], truth["mu_pa"])
    for name, value in zip(MODULI, true, strict=True):
        table[f"true_{name}"] = value
    table["youngs_modulus_ratio"] = table["youngs_modulus_pa"] / table["true_youngs_modulus_pa"]
    first = ["method", "data", *MODULI, "youngs_modulus_ratio", "iterations", "evaluations"]
    last = [f"{kind}_{name}" for kind in ("true", "published") for name in MODULI]
    table["evaluations"] = table["evaluations"].astype("Int64")
    table["youngs_modulus_ratio"] = table["youngs_modulus_ratio"].round(6)
    return table[[*first, "converged", "at_bound", *last]].assign(provenance="simulated")


def tracking_errors(steps: SimulatedSteps, tracked: Tracked) -> dict[str, float]:
    """Errors of the tracked last frame against the simulated surface.

    Returns
    -------
    dict
        Root mean squares of the vertices' errors [m]: all, and at the loaded nodes along and
        across the load.
    """
    nodes = steps.mesh.surface_nodes()
    moved = tracked.vertices_m[-1] - tracked.vertices_m[0]
    error = moved - steps.displacement_m[-1, nodes]
    loaded = error[np.isin(nodes, steps.triangle)]
    load = steps.force_n[-1].sum(axis=0)
    along = loaded @ load / np.linalg.norm(load)
    across = np.sqrt(np.maximum((loaded**2).sum(axis=1) - along**2, 0))
    return {
        "tracking_error_m": _rms(np.linalg.norm(error, axis=1)),
        "loaded_along_m": _rms(along),
        "loaded_across_m": _rms(across),
    }


def every_method(
    problem: Problem, triangle: NDArray, *, linear: LinearMethod, search: Minimise
) -> dict[str, LinearEstimate | Minimum]:
    """Linear method from its first start, and error minimisation with either error option.

    Parameters
    ----------
    problem : Problem
    triangle : (3,) int array
        Loaded nodes.
    linear : LinearMethod
    search : Minimise

    Returns
    -------
    dict
        By method, ``linear_method`` or ``minimise_<error option>``.
    """
    limits = {"iterations": linear.iterations, "tolerance": linear.tolerance}
    found = {"linear_method": linear_method(problem, start=linear.starts_pa[0], **limits)}
    E_star, kept = pressed_area_modulus(problem, triangle), {}
    for option in ERROR_OPTIONS:
        cost = Objective(problem, option, kept)
        start = hertz_start(cost, E_star, search.start_poisson_ratios)
        found[f"minimise_{option}"] = minimise_error(cost, start, search)
    return found


def with_noise(problem: Problem, std_m: float, rng: np.random.Generator) -> Problem:
    """The problem with independent normal noise on the displacement of every node."""
    noise = rng.normal(0, std_m, problem.displacement_m.shape)
    return replace(problem, displacement_m=problem.displacement_m + noise)


def noise_table(found: Sequence[Mapping], true: Mapping | None) -> pd.DataFrame:
    """Median and quartiles of the Lame parameters at each noise, by method.

    Parameters
    ----------
    found : sequence of mapping
        ``std_m, method, lame_lambda_pa, lame_mu_pa`` of each draw.
    true : mapping or None
        ``lambda_pa`` and ``mu_pa``.
    """
    groups = pd.DataFrame(found).groupby(["method", "std_m"], sort=True)[LAME]
    table = pd.concat(
        [
            groups.quantile(part).rename(columns=lambda name, k=key: f"{k}_{name}")
            for key, part in (("median", 0.5), ("low", 0.25), ("high", 0.75))
        ],
        axis=1,
    ).reset_index()
    table = table.rename(columns={"std_m": "noise_std_m"})
    for name, key in zip(LAME, ("lambda_pa", "mu_pa"), strict=True):
        table[f"true_{name}"] = np.nan if true is None else float(true[key])
    return table.assign(provenance="simulated")


def _linear_row(data: str, estimates: Sequence[Mapping]) -> dict:
    first = estimates[0]
    row = {name: first[name] for name in [*MODULI, "iterations", "converged"]}
    return row | {"method": "linear_method", "data": data, "evaluations": None, "at_bound": None}


def _printed(published: pd.DataFrame) -> pd.DataFrame:
    values = [_all_moduli(lam, mu) for lam, mu in published[LAME].itertuples(index=False)]
    columns = pd.DataFrame(values, columns=[f"published_{name}" for name in MODULI])
    return pd.concat([published[["method", "data"]], columns], axis=1)


def _all_moduli(lam: float, mu: float) -> list[float]:
    return [lam, mu, *engineering_from_lame(lam, mu)]


def _rms(values: NDArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def make_table_3_1(inputs: Any, params: Any) -> dict:
    """Table 3.1 with the counts of the block's solid at one point."""
    (capture,) = params.captures
    spec, support = read_declared(inputs.object)
    point = np.array(spec["points"][capture["point"]]["position_m"], dtype=float)
    solid, radius = Solid.read(params.solid), params.probe["indenter"]["radius_m"]
    near = {"radius_m": solid.refine_radius_m, "edge_m": solid.refine_edge_m}
    mesh = refine_near(read_solid(inputs.solid), point, **near)
    triangle = contact_triangle(mesh, point, largest_distance_m=radius)
    sets = node_sets(mesh, support, contact_nodes=triangle)
    names = ["nodes", "displacement", "displacement_notation", "force", "force_notation", "count"]
    rows = [
        (name, moved, f"U_{name[0]}", force, f"F_{name[0]}", len(getattr(sets, name)))
        for name, (moved, force) in KNOWN.items()
    ]
    found = pd.DataFrame(rows, columns=names).assign(provenance=capture["provenance"])
    place = f"{capture['object']} at point {capture['point']}"
    return outputs.table(found, title=f"Table 3.1: sets of nodes; counts of {place}")
