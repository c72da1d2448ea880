"""Repeated indentations and the block's points: Tables 5.1 and 5.2."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from palpate.json_fields import read_all
from palpate.report import outputs, tables
from palpate.report.tables import CAPTURE

ROWS_OF_BLOCK = 3
# Table 5.1 is of one sensor and point.
PUBLISHED_ATTEMPTS = {"sensor": "kinect", "point": "11"}
KINDS = ("free_contact", "recommended")
MODULI = ["reduced_modulus_pa", *(f"{kind}_reduced_modulus_pa" for kind in KINDS)]
SPREAD = {"mean": lambda x: x.mean(), "standard deviation (n-1)": lambda x: x.std(ddof=1)}
FEWEST_FOR_CORRELATION = 3
HOMOGENEOUS_NOTE = (
    "The virtual lab's block is homogeneous, and its edges make it at most 1 to 2 % softer: the"
    " published pattern of stiff centre and soft border cannot come from simulated captures."
)


def make_table_5_1(inputs: Any, params: Any) -> pd.DataFrame:
    """Reduced modulus of repeated indentations of one point."""
    hertz = hertz_table(params.captures, read_all(inputs.fits))
    return tables.rounded(table_5_1(hertz, pd.read_csv(inputs.published)))


def make_table_5_2(inputs: Any, params: Any) -> dict:
    """Reduced modulus at the block's points, and its correlation with the published one."""
    hertz = hertz_table(params.captures, read_all(inputs.fits))
    table = table_5_2(hertz, pd.read_csv(inputs.published), block=params.block)
    table = tables.rounded(table)
    pattern = pattern_correlation(table)
    both = outputs.table(table, more_notes=_notes(table, pattern), **params.table)
    return both | {"pattern": pattern}


def hertz_table(captures: Sequence[Mapping], fits: Sequence[Mapping]) -> pd.DataFrame:
    """Hertz fits of all captures, one row each.

    Parameters
    ----------
    captures : sequence of mapping
        ``object, sensor, capture, point, provenance`` of each capture.
    fits : sequence of mapping
        hertz.json of each capture.

    Returns
    -------
    DataFrame
        Reduced moduli [Pa] of the study's fit, of the fit with the contact point free and of the
        recommended model, the latter two with their 95 % intervals.
    """
    rows = []
    for capture, fit in zip(captures, fits, strict=True):
        row = {name: capture[name] for name in CAPTURE}
        row["reduced_modulus_pa"] = fit["study"]["reduced_modulus_pa"]
        for name in KINDS:
            low, high = fit[name]["reduced_modulus_interval_pa"]
            row[f"{name}_reduced_modulus_pa"] = fit[name]["reduced_modulus_pa"]
            row |= {f"{name}_low_pa": low, f"{name}_high_pa": high}
        rows.append(row | {"provenance": capture["provenance"]})
    return pd.DataFrame(rows)


def table_5_1(hertz: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """Reduced modulus of each attempt, with mean and standard deviation, beside Table 5.1.

    Parameters
    ----------
    hertz : DataFrame
        Of `hertz_table`, attempts alone.
    published : DataFrame
        config/published/table_5_1.csv.

    Returns
    -------
    DataFrame
        One row for each attempt, then ``mean`` and ``standard deviation (n-1)``, per sensor and
        point.
    """
    ours = hertz.copy()
    ours["attempt"] = ours["capture"].str.extract(r"(\d+)$", expand=False).astype(int)
    printed = published.rename(columns={"reduced_modulus_pa": "published_reduced_modulus_pa"})
    printed = printed.assign(**PUBLISHED_ATTEMPTS)
    ours = ours.merge(printed, on=["sensor", "point", "attempt"], how="left")
    values = [*MODULI, "published_reduced_modulus_pa"]
    columns = ["sensor", "point", "attempt", *values, "provenance"]
    parts = []
    for (sensor, point), group in ours.sort_values("attempt").groupby(["sensor", "point"]):
        known = {"sensor": sensor, "point": point, "provenance": group["provenance"].iloc[0]}
        ends = [
            known | {"attempt": name} | {column: spread(group[column]) for column in values}
            for name, spread in SPREAD.items()
        ]
        parts += [group[columns].astype(object), pd.DataFrame(ends)[columns].astype(object)]
    return pd.concat(parts, ignore_index=True)


def table_5_2(hertz: pd.DataFrame, published: pd.DataFrame, *, block: str) -> pd.DataFrame:
    """Reduced modulus at the block's points beside Table 5.2.

    Parameters
    ----------
    hertz : DataFrame
        Of `hertz_table`.
    published : DataFrame
        config/published/table_5_2.csv.
    block : str
        Name of the study's block; other objects have no row here.

    Returns
    -------
    DataFrame
        One row for each capture that is the only one of its point.
    """
    ours = hertz[(hertz["object"] == block) & (hertz["capture"] == hertz["point"])].copy()
    ours["point"] = ours["point"].astype(int)
    ours["row"] = (ours["point"] - 1) % ROWS_OF_BLOCK + 1
    ours["column"] = (ours["point"] - 1) // ROWS_OF_BLOCK + 1
    printed = published[["sensor", "point", "reduced_modulus_pa"]].rename(
        columns={"reduced_modulus_pa": "published_reduced_modulus_pa"}
    )
    merged = ours.merge(printed, on=["sensor", "point"], how="left")
    first = ["sensor", "point", "row", "column", "reduced_modulus_pa"]
    ends = "reduced_modulus_pa", "low_pa", "high_pa"
    middle = [f"{name}_{end}" for name in KINDS for end in ends]
    last = ["published_reduced_modulus_pa", "provenance"]
    return merged.sort_values(["sensor", "point"])[first + middle + last].reset_index(drop=True)


def pattern_correlation(table: pd.DataFrame) -> pd.DataFrame:
    """How far the points' moduli go up and down with the published ones.

    Parameters
    ----------
    table : DataFrame
        Of `table_5_2`.

    Returns
    -------
    DataFrame
        Pearson's and Spearman's correlation of each kind of modulus, per sensor and for both;
        empty cells where fewer than three points have a published value.
    """
    known = table.dropna(subset=["published_reduced_modulus_pa"])
    groups = [*known.groupby("sensor"), ("all", known)]
    rows = []
    for sensor, group in groups:
        for name in MODULI:
            row = {"sensor": sensor, "modulus": name.removesuffix("_pa"), "points": len(group)}
            for method in ("pearson", "spearman"):
                found = correlation(group, name, method)
                row[method] = None if found is None else round(found, 3)
            rows.append(row | {"provenance": "/".join(sorted(set(group["provenance"])))})
    return pd.DataFrame(rows)


def _notes(table: pd.DataFrame, pattern: pd.DataFrame) -> list[str]:
    """How far the pattern agrees with the published one, and why it need not."""
    found = pattern.dropna(subset=["pearson"])
    said = [
        f"{row.modulus}, {row.sensor}: {row.pearson:.2f} ({row.points} points)"
        for row in found.itertuples()
    ]
    lines = [f"Correlation with the published values: {'; '.join(said)}."] if said else []
    simulated = (table["provenance"] == "simulated").any()
    return lines + [HOMOGENEOUS_NOTE] * bool(simulated)


def correlation(table: pd.DataFrame, name: str, method: str = "pearson") -> float | None:
    """Correlation of a column of Table 5.2 with the published values; None where it has none."""
    group = table.dropna(subset=["published_reduced_modulus_pa"])
    one, other = (group[column].astype(float) for column in (name, "published_reduced_modulus_pa"))
    if len(group) < FEWEST_FOR_CORRELATION or np.ptp(one) == 0 or np.ptp(other) == 0:
        return None
    if method == "spearman":
        one, other = one.rank(), other.rank()
    return float(np.corrcoef(one, other)[0, 1])
