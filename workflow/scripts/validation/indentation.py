"""Indentation tables against the lab's own contact solutions, which share no code with them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.estimate.direct.table import force_table
from palpate.json_fields import read_by_folder
from palpate.npz import read_npz
from palpate.open3d_core import ClosestPoints
from palpate.report import outputs
from palpate.solid.indentation_table import IndentationModel, load_indentation, ratio_weights
from palpate.solid.laws import LAW_NAMES
from palpate.units import MILLIMETRES
from scipy.interpolate import PchipInterpolator

TITLE = "Force and displacement of indentation tables over those of the lab's contact solutions"
NOTES = (
    "At the true moduli and under the lab's law; depths count from each solution's own first touch."
    " The two share no code: other elements, contact, laws and solvers.",
    "Displacements are the surface's vectors in a ring about the contact, at 6 mm or the maximum"
    " depth: the slope, by least squares, of the table's at its nodes on the lab's there.",
)
DEPTHS_M = np.array([0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004, 0.006, 0.008])
RINGS_M = ((0.008, 0.020), (0.020, 0.030), (0.030, 0.045))
RING_DEPTH_M = 0.006


def make_indentation_accuracy(inputs: Any, params: Any) -> dict:
    """Force and displacement of each table over the lab's, at the true moduli and the lab's law."""
    materials, rows = read_by_folder(inputs.materials), []
    for known, table, steps in zip(params.captures, inputs.tables, inputs.load_steps, strict=True):
        material = materials[known["object"]]
        if material["law"] not in LAW_NAMES or {"skin", "gradient"} & set(material):
            continue  # The table knows no other solid to be held to.
        lab, ours = read_npz(steps, what="load steps of the lab"), load_indentation(table)
        model, law = force_table(ours), LAW_NAMES.index(material["law"])
        E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
        deepest = min(model.depth_m[-1], lab["depth_m"][-1])
        row = {"object": known["object"], "point": known["point"]}
        for depth in DEPTHS_M[deepest >= DEPTHS_M]:
            true_n = float(np.interp(depth, lab["depth_m"], lab["force_n"] ** (2 / 3))) ** 1.5
            name = f"force_ratio_{depth * MILLIMETRES:g}_mm"
            row[name] = E * float(model.force(depth, nu, law)) / true_n
        row |= displacement_ratios(ours, lab, law, nu, min(RING_DEPTH_M, deepest))
        rows.append(row | {"provenance": "simulated"})
    return outputs.table(pd.DataFrame(rows), title=TITLE, more_notes=NOTES)


def displacement_ratios(
    table: IndentationModel, lab: Mapping[str, NDArray], law: int, nu: float, depth_m: float
) -> dict[str, float]:
    """Surface displacement of a table over the lab's at a depth [m], column by column.

    Of the lab's contact solution of the same point, the law's place among the table's, and the true
    Poisson's ratio; by distance from the contact, rings without surface are left out.
    """
    moves = PchipInterpolator(table.depth_m, table.surface_displacement_m[law], axis=1)(depth_m)
    ours = np.tensordot(ratio_weights(table.poisson_ratios, nu)[0], moves, axes=1)
    surface = ClosestPoints(lab["surface_rest_m"], lab["surface_faces"])
    _, *corners = surface(table.surface_rest_m)
    field = PchipInterpolator(lab["depth_m"], lab["surface_displacement_m"], axis=0)(depth_m)
    theirs = surface.interpolate(field, *corners)
    away = np.linalg.norm(table.surface_rest_m - table.point_m, axis=1)
    found = {}
    for low, high in RINGS_M:
        u, v = (x[(away > low) & (away <= high)] for x in (ours, theirs))
        ring = f"{low * MILLIMETRES:g}_{high * MILLIMETRES:g}"
        if v.any():
            found[f"displacement_ratio_{ring}_mm"] = float((u * v).sum() / (v * v).sum())
    return found
