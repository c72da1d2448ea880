"""What was measured beside what is true: one row a quantity, of which all tables are views."""

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
from palpate.modulus import LABELS, columns

# Errors of moduli are relative, those of all else in its unit.
PASCALS = "Pa"
ONE_SECOND_S = 1.0
NEO_HOOKEAN = "neo_hookean"


def quantity(name: str, value: float, unit: str = "", truth: float | None = None) -> dict:
    """One row: a quantity, its value and unit, and the true value where that is not 0."""
    return {"quantity": name, "value": value, "unit": unit, "truth": truth}


def judged(table: pd.DataFrame) -> pd.DataFrame:
    """Add the error, and whether the interval covers the truth, to measured quantities.

    Parameters
    ----------
    table : DataFrame
        ``value``, ``low``, ``high``, ``truth`` and ``unit``.

    Returns
    -------
    DataFrame
        With ``error``, relative in pascals and absolute in other units, and ``covered``, not known
        without interval or truth.
    """
    value, low, high, true = (
        pd.to_numeric(table[name]).to_numpy(float) for name in ("value", "low", "high", "truth")
    )
    scale = np.where(table["unit"] == PASCALS, true, 1.0)
    error = value / scale - true / scale
    covered = pd.array((low <= true) & (true <= high), dtype="boolean")
    covered[~(np.isfinite(low) & np.isfinite(true))] = pd.NA
    return table.assign(value=value, low=low, high=high, truth=true, error=error, covered=covered)


def measured_moduli(
    rows: pd.DataFrame, materials: Mapping[str, Mapping], *, keys: Iterable[str]
) -> pd.DataFrame:
    """Moduli of a summary beside the true ones, one row each, judged.

    Parameters
    ----------
    rows : DataFrame
        Columns of `palpate.report.estimate_rows.summary`.
    materials : mapping
        material.json by object.
    keys : iterable of str
        Columns that say what each row is of.

    Returns
    -------
    DataFrame
        Indexed as ``rows``, modulus by modulus.
    """
    truths = pd.DataFrame([truth_of(materials[name]) for name in rows["object"]], index=rows.index)
    parts = []
    for name in LABELS:
        ends = dict(zip(("value", "low", "high", "verdict"), columns(name), strict=True))
        cells = {end: rows[column] for end, column in ends.items()}
        unit = PASCALS if name.endswith("_pa") else ""
        known = {"quantity": name, "truth": truths[name], "unit": unit}
        parts.append(rows[[*keys]].assign(**known, **cells))
    return judged(pd.concat(parts))


def truth_of(material: Mapping) -> dict[str, float]:
    """True moduli of a material of the lab; material.json.

    ``youngs_modulus_pa`` is the instantaneous one, which no relaxation has lowered yet;
    ``youngs_modulus_1s_pa`` is what a step of strain leaves after a second;
    ``effective_reduced_modulus_pa`` is what is then left of E*, of a neo-Hookean material; not a
    number of others.
    """
    if {"skin", "gradient"} & set(material):
        # What is not the same everywhere has no one modulus.
        return dict.fromkeys(LABELS, float("nan"))
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    star, left = E / (1 - nu**2), relaxed_part(material, ONE_SECOND_S)
    neo_hookean = material.get("law", NEO_HOOKEAN) == NEO_HOOKEAN
    return {
        "youngs_modulus_pa": E,
        "poisson_ratio": nu,
        "reduced_modulus_pa": star,
        "effective_reduced_modulus_pa": star * left if neo_hookean else float("nan"),
        "youngs_modulus_1s_pa": E * left,
    }


def relaxed_part(material: Mapping, after_s: float = np.inf) -> float:
    """Part of a modulus that is left some time after a step, or in the end; material.json."""
    series = material.get("relaxation") or {"fractions": [], "times_s": []}
    fractions, times_s = (np.array(series[name], dtype=float) for name in ("fractions", "times_s"))
    return 1 - float(fractions @ -np.expm1(-after_s / times_s))
