"""Tables of Chapter 3: node sets, and the moduli found on the simulated block."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.report import outputs
from palpate.solid.laws import engineering_from_lame
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import read_solid, refine_near
from palpate.surface.tracked import Tracked
from palpate.workflow.object_inputs import read_declared

from thesis.minimise.linear import LinearEstimate, linear_method
from thesis.minimise.objective import Objective, Problem, node_sets
from thesis.minimise.options import Minimise, Solid
from thesis.minimise.problem import pressed_area_modulus
from thesis.minimise.search import Minimum, hertz_start, minimise_error
from thesis.options import LinearMethod
from thesis.tracker.simulation import SimulatedSteps

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
