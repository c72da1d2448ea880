"""Estimates of curves of force and position, as the summary has them."""

from collections.abc import Mapping, Sequence

import pandas as pd

from palpate.modulus import BOUNDED, Modulus, columns
from palpate.report.tables import CAPTURE

# Hertz's E*; and E by the indentation table of the object's own shape.
BY_HERTZ, BY_TABLE = "curve_hertz", "curve_table"
DOUBTABLE = ("youngs_modulus_pa", "reduced_modulus_pa")
UNTOLD = "a curve does not tell it"


def curve_rows(curves: Sequence[Mapping], found: Sequence[Mapping]) -> pd.DataFrame:
    """Two rows of each curve: E* by Hertz, and E for the declared Poisson's ratio.

    Parameters
    ----------
    curves : sequence of mapping
        Described curves.
    found : sequence of mapping
        Their curve.json.
    """
    rows = []
    for curve, one in zip(curves, found, strict=True):
        known = {name: curve[name] for name in [*CAPTURE, "provenance"]}
        hertz, moduli = one["hertz"], one["moduli"]
        low, high = hertz["reduced_modulus_interval_pa"]
        interval = {"reduced_modulus_low_pa": low, "reduced_modulus_high_pa": high}
        by_hertz = {"method": BY_HERTZ, "reduced_modulus_pa": hertz["reduced_modulus_pa"]}
        rows.append(known | by_hertz | interval)
        by_table = {"method": BY_TABLE, "recommended": True, "captures": 1}
        for name, judged in moduli.items():
            by_table |= Modulus(**judged).cells(name)
        by_table |= {"poisson_ratio_reason": UNTOLD, "doubts": "; ".join(one["doubts"])}
        if one["doubts"]:
            # Of what may have been read or fitted otherwise an interval says too little.
            by_table |= {columns(name)[-1]: BOUNDED for name in DOUBTABLE}
        by_table |= {name: one[name] for name in ("force_law", "force_law_std")}
        rows.append(known | by_table)
    return pd.DataFrame(rows)
