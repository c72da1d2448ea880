"""The direct estimate on solids of laws that it does not know, from tables alone.

A block of each law of `laws_of_solids` is pressed by finite elements; force and surface of that
press, with noise, are three captures. Their estimate is held to what was pressed.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from laws_of_solids import POPULATION
from numpy.typing import NDArray
from palpate.capture.files import whole_file
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.table import SampleTable, sample_table
from palpate.estimate.relaxation import relaxed_share
from palpate.solid import laws
from palpate.solid.indentation_setup import IndentationOptions
from palpate.solid.indentation_table import IndentationModel
from palpate.solid.load_steps import indentation_model
from palpate.solid.mesh import read_solid
from palpate.solid.support import Support

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/estimate"))
from made_up_indentation import AMPLITUDES, RELAXATION_TIMES_S, indentation_of  # noqa: E402

TABLE = ROOT / "results/law_population.csv"
POINT_M, DOWN, RADIUS_M = np.array([-0.05, 0, 0.0475]), np.array([0, 0, -1.0]), 0.00622
RATIOS, DEPTHS_RADII, E = (0.1, 0.3, 0.45, 0.499), (0.3, 0.6, 1.0), 25e3
CAPTURES, SAMPLES = 3, 400
# What is pressed and the table have the same elements: what these are wrong by cancels.
ELEMENTS = IndentationOptions(edge_m=0.004, growth=1.2)
# As a stereo head and a marker of 20 mm have them [m].
MOTION_STD_M, OFFSET_STD_M = 1e-4, 3e-4
STEMS = {
    "reduced_modulus_pa": "E_star",
    "effective_reduced_modulus_pa": "effective",
    "youngs_modulus_pa": "E",
    "poisson_ratio": "nu",
}


def law_rows() -> list[tuple]:
    """Rows (name, value, unit, against) of coverage and width; the table of all estimates."""
    table = population_table()
    with whole_file(TABLE) as part:
        table.to_csv(part, index=False)
    rows = []
    for stem in STEMS.values():
        half = 100 * float(table[f"{stem}_half"].median())
        rows += [
            (f"{stem} within its interval", 100 * table[f"{stem}_holds"].mean(), "%", "truth"),
            (f"{stem}, half its interval, median", half, "%", ""),
            (f"{stem}, error, median", 100 * table[f"{stem}_error"].abs().median(), "%", "truth"),
        ]
    return rows


def population_table() -> pd.DataFrame:
    """One row for each law, Poisson's ratio and depth."""
    laws.LAWS.update(POPULATION)
    known = pressed(laws.LAW_NAMES, None)
    top = known.surface_rest_m[np.abs(known.surface_rest_m[:, 2] - POINT_M[2]) < 1e-9]
    away = np.linalg.norm(top - POINT_M, axis=1)
    places = top[(away > 0.015) & (away < 0.08)]
    cell = np.random.default_rng(1).permutation(places)[:SAMPLES]
    normal = np.tile(-DOWN, (len(cell), 1))
    table, rows = sample_table(known, cell, normal), []
    for law in POPULATION:
        for nu in RATIOS:
            try:
                alone = pressed((law,), (nu,))
            except ValueError as error:
                print(f"{law}, nu {nu:g}: {error}", flush=True)
                continue
            truth = sample_table(twice(alone), cell, normal)
            for radii in DEPTHS_RADII:
                if radii * RADIUS_M <= truth.depth_m[-1]:
                    case = law, nu, radii, CAPTURES * len(rows)
                    rows.append(row_of(*case, cell - POINT_M, truth, table))
                    print(rows[-1], flush=True)
    return pd.DataFrame(rows)


def pressed(names: tuple[str, ...], ratios: tuple[float, ...] | None) -> IndentationModel:
    """Indentation table of the study's block under laws of the population."""
    mesh = read_solid(ROOT / "config/meshes/foam_block.vtu")
    support = Support(np.zeros(3), -DOWN, 1e-3, "bonded")
    given = {} if ratios is None else {"poisson_ratios": ratios}
    given |= {"radius_m": RADIUS_M, "deepest_m": 0.007, "laws": names, "options": ELEMENTS}
    return indentation_model(mesh, support, POINT_M, DOWN, **given)


def twice(model: IndentationModel) -> IndentationModel:
    """A law's table as that of both laws, between which nothing is to be found."""
    parts = {
        name: np.concatenate([getattr(model, name)] * 2)
        for name in ("force_per_modulus_m2", "surface_displacement_m")
    }
    return IndentationModel(**vars(model) | parts | {"laws": laws.LAW_NAMES})


def row_of(
    law: str,
    nu: float,
    radii: float,
    seed: int,
    cell: NDArray,
    truth: SampleTable,
    table: SampleTable,
) -> dict:
    """Estimate of three captures, with noise of their own, against the truth."""
    deepest = radii * RADIUS_M
    of = {"maximum_depth_m": deepest, "least_m": deepest / 15, "solid": (cell, truth, table)}
    of |= {"motion_std_m": MOTION_STD_M, "offset_std_m": OFFSET_STD_M}
    captures = [indentation_of(E, nu, seed + k, **of) for k in range(CAPTURES)]
    found = estimate_direct(captures, Fit(shift_std_m=2e-5), radius_m=RADIUS_M)
    told = np.array([found.quantities.depth_m])
    harder = float((truth.force(told, nu, 0.0) / table.force(told, nu, 0.0))[0])
    star = E / (1 - nu**2)
    left = 1 - float(relaxed_share(1.0, fractions=AMPLITUDES, times_s=np.array(RELAXATION_TIMES_S)))
    truths = dict(zip(STEMS, (star, star * harder * left, E, nu), strict=True))
    p = found.solution.parameters[0]
    row = {"law": law, "nu": nu, "depth_over_radius": radii}
    for name, stem in STEMS.items():
        one, true = found.moduli[name], truths[name]
        unit = 1.0 if stem == "nu" else true
        row |= {
            f"{stem}_error": (one.value - true) / unit,
            f"{stem}_half": (one.high - one.low) / 2 / unit,
            f"{stem}_holds": one.low <= true <= one.high,
        }
    return row | {"force_law": p.force_law, "motion_law": p.motion_law}
