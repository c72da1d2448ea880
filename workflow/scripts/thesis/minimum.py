"""What an error minimisation found, as it goes to files."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial

import numpy as np
from numpy.typing import NDArray
from palpate.solid.mesh import SolidMesh, write_solid

from thesis.minimise.fit import ModuliFit
from thesis.minimise.objective import Objective
from thesis.minimise.search import Minimum


def minimum_files(full: Objective, found: ModuliFit, mesh: SolidMesh, known: Mapping) -> dict:
    """The minimum with its trace (``result``) and the mismatch of each node (``mismatch``).

    ``known`` are fields of the result beside those of the fit.
    """
    fitted = {
        "least_squares": {norm: asdict(fit) for norm, fit in found.least_squares.items()},
        "profile": asdict(found.profile),
        "reduced_model": asdict(found.reduced_model),
    }
    result = asdict(found.minimum) | {"error_option": full.option} | dict(known) | fitted
    data = _compared(full, found.minimum)
    return {"result": result, "mismatch": partial(write_solid, mesh=mesh, point_data=data)}


def _compared(objective: Objective, minimum: Minimum) -> dict[str, NDArray]:
    """Tracked and computed displacement of each node and, on the surface, their distance."""
    computed = objective.displacement(minimum.lame_lambda_pa, minimum.lame_mu_pa)
    tracked, gap = np.nan_to_num(objective.u), np.zeros(len(computed))
    gap[objective.surface] = np.linalg.norm((computed - tracked)[objective.surface], axis=1)
    return {
        "tracked_displacement_m": tracked,
        "computed_displacement_m": computed,
        "mismatch_m": gap,
    }
