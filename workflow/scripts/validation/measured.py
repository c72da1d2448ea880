"""What was measured beside what is true: rows of quantities, and the true moduli of materials."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.modulus import LABELS

ONE_SECOND_S = 1.0
NEO_HOOKEAN = "neo_hookean"


def quantity(name: str, value: float, unit: str = "", truth: float | None = None) -> dict:
    """One row: a quantity, its value and unit, and the true value where that is not 0."""
    return {"quantity": name, "value": float(value), "unit": unit, "truth": truth}


def rms(errors: NDArray | pd.Series) -> float:
    """Root mean square of errors (n,), or of the lengths of vectors (n, 3)."""
    squares = errors**2 if errors.ndim == 1 else (errors**2).sum(axis=1)
    return float(np.sqrt(squares.mean()))


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
