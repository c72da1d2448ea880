"""E and nu of every method against the lab's true materials."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from palpate.json_fields import read_by_folder
from palpate.modulus import IDENTIFIED, LABELS
from palpate.report import outputs, tables
from validation.measured import measured_moduli

TITLE = "E and nu against the virtual lab's truth"
SHORT_TITLE = "Errors and coverage of the intervals, by object, sensor and method"
NOTES = (
    "true_youngs_modulus_pa is the instantaneous modulus; true_youngs_modulus_1s_pa is what a step"
    " of strain leaves of it after a second, as the material relaxes while it is pressed.",
    "Errors of moduli are relative, those of Poisson's ratio absolute; intervals are at 95 %.",
)
FIRST = ["object", "sensor", "point", "method", "youngs_modulus_pa", "true_youngs_modulus_pa"]
FIRST += ["poisson_ratio", "true_poisson_ratio"]
KEYS = ["object", "sensor", "method"]
STATISTICS = {
    "median_error": ("error", "median"),
    "rms_error": ("error", lambda errors: (errors**2).mean() ** 0.5),
    "coverage": ("covered", lambda covered: float(covered.astype(float).mean())),
}


def make_accuracy(inputs: Any, params: Any) -> dict:
    """All rows, and their errors by object, sensor and method."""
    materials = read_by_folder(inputs.materials)
    rows = pd.read_csv(inputs.summary, dtype={"capture": str, "point": str})
    rows = rows[rows["object"].isin(materials)]
    whole = tables.rounded(accuracy_table(rows, materials))
    long = outputs.table(whole, title=TITLE, more_notes=NOTES)
    summed = outputs.table(coverage_table(rows, materials), title=SHORT_TITLE, more_notes=NOTES)
    return long | {"summary": summed["csv"], "summary_md": summed["md"]}


def accuracy_table(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> pd.DataFrame:
    """Put the truth beside estimates of simulated captures.

    Parameters
    ----------
    rows : DataFrame
        Estimates of any method, as a summary has them.
    materials : mapping
        material.json by object.

    Returns
    -------
    DataFrame
        For each modulus ``true_<name>``, the error (relative, of nu absolute) and whether the
        interval covers the truth.
    """
    table = rows.copy()
    found = measured_moduli(rows, materials, keys=KEYS)
    for name, part in found.groupby("quantity", sort=False):
        stem = name.removesuffix("_pa")
        table[f"true_{name}"] = part["truth"]
        table[f"{stem}_error"], table[f"{stem}_covered"] = part["error"], part["covered"]
    return table[[*FIRST, *(name for name in table.columns if name not in FIRST)]]


def coverage_table(rows: pd.DataFrame, materials: Mapping[str, Mapping]) -> pd.DataFrame:
    """Errors and coverage of the intervals by object, sensor and method, and over all.

    Parameters
    ----------
    rows, materials : DataFrame and mapping
        As of `accuracy_table`.
    """
    found = measured_moduli(rows, materials, keys=[*KEYS, "provenance"])
    found["identified"] = (
        (found["verdict"] == IDENTIFIED).astype(float).where(found["verdict"].notna())
    )
    alike = {"object": "all"}, {"object": "all", "sensor": "all"}
    levels = [found, *(found.assign(**names) for names in alike)]
    every = pd.concat(levels, keys=range(len(levels)), names=["level"])
    groups = every.groupby(["level", *KEYS, "quantity"])
    statistics = groups.agg(**STATISTICS).unstack("quantity")
    first = every.groupby(["level", *KEYS])
    short = pd.DataFrame({"runs": first.size() // len(LABELS)})
    for name in LABELS:
        for kind in STATISTICS:
            short[f"{name.removesuffix('_pa')}_{kind}"] = statistics[kind, name]
    ratio = every[every["quantity"] == "poisson_ratio"].groupby(["level", *KEYS])
    short["poisson_ratio_identified"] = ratio["identified"].mean()
    short["provenance"] = first["provenance"].first()
    return short.reset_index().drop(columns="level")
