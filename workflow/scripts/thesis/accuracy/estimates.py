"""E and nu of every method against the lab's true materials."""

from typing import Any

import pandas as pd
from palpate.json_fields import read_by_folder
from palpate.report import moduli_table, outputs, tables

TITLE = "E and nu against the virtual lab's truth"
SHORT_TITLE = "Errors and coverage of the intervals, by object, sensor and method"
NOTES = (
    "true_youngs_modulus_pa is the instantaneous modulus; true_youngs_modulus_1s_pa is what a step"
    " of strain leaves of it after a second, as the material relaxes while it is pressed.",
    "Errors of moduli are relative, those of Poisson's ratio absolute; intervals are at 95 %.",
)


def make_accuracy(inputs: Any, params: Any) -> dict:
    """All rows, and their errors by object, sensor and method."""
    materials = read_by_folder(inputs.materials)
    rows = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    whole = moduli_table.accuracy_table(rows[rows["object"].isin(materials)], materials)
    short = moduli_table.coverage_table(whole)
    long = outputs.table(tables.rounded(whole), title=TITLE, more_notes=NOTES)
    summed = outputs.table(short, title=SHORT_TITLE, more_notes=NOTES)
    return long | {"summary": summed["csv"], "summary_md": summed["md"]}
