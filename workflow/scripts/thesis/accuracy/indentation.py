"""Indentation tables against the lab's own contact solutions, which share no code with them."""

from typing import Any

import numpy as np
import pandas as pd
from palpate.estimate.direct.table import force_table
from palpate.npz import read_npz
from palpate.report import outputs
from palpate.run.read_files import read_by_folder
from palpate.solid.indentation import load_indentation
from palpate.solid.laws import LAW_NAMES
from palpate.units import MILLIMETRES

TITLE = "Force of indentation tables over that of the lab's contact solutions"
NOTES = (
    "At the true moduli and under the lab's law; depths count from each solution's own first touch."
    " The two share no code: other elements, contact, laws and solvers.",
)
DEPTHS_M = np.array([0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004, 0.006, 0.008])


def make_indentation_accuracy(inputs: Any, params: Any) -> dict:
    """Force of each table over the lab's, at the true moduli and the lab's law."""
    materials = read_by_folder(inputs.materials)
    rows = []
    for known, table, ladder in zip(params.captures, inputs.tables, inputs.ladders, strict=True):
        material = materials[known["object"]]
        if material["law"] not in LAW_NAMES or {"skin", "gradient"} & set(material):
            continue  # The table knows no other solid to be held to.
        arrays = read_npz(ladder, what="load steps of the lab")
        model = force_table(load_indentation(table))
        deepest = min(model.depth_m[-1], arrays["depth_m"][-1])
        row = {"object": known["object"], "point": known["point"]}
        for depth in DEPTHS_M[deepest >= DEPTHS_M]:
            lab = float(np.interp(depth, arrays["depth_m"], arrays["force_n"] ** (2 / 3))) ** 1.5
            law = LAW_NAMES.index(material["law"])
            ours = material["youngs_modulus_pa"] * model.force(
                depth, material["poisson_ratio"], law
            )
            row[f"force_ratio_{depth * MILLIMETRES:g}_mm"] = float(ours) / lab
        rows.append(row | {"provenance": "simulated"})
    return outputs.table(pd.DataFrame(rows), title=TITLE, more_notes=NOTES)
