"""Error minimisations in tables: rows of a summary, and Tables 5.3 to 5.5 beside the printed."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd
from palpate.json_fields import minima_by_key, read_one
from palpate.modulus import Modulus
from palpate.report import tables
from palpate.report.estimate_rows import row

E, NU, STAR = TRUE = ["youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa"]
VALUES = [*TRUE, "hertz_reduced_modulus_pa"]
VERDICT = ["poisson_ratio_low", "poisson_ratio_high", "poisson_ratio_verdict"]


def make_moduli_table(inputs: Any, params: Any) -> pd.DataFrame:
    """Moduli of an object from its minima, the true material and the published table."""
    minima = minima_by_key(params.captures, params.errors, inputs.results)
    ours = pd.DataFrame(minimum_rows(params.captures, minima))
    material = read_one(inputs.material)
    printed = pd.read_csv(inputs.published)
    return tables.rounded(moduli_table(ours, printed, name=params.name, material=material))


def moduli_table(
    minima: pd.DataFrame,
    published: pd.DataFrame,
    *,
    name: str,
    material: Mapping | None = None,
) -> pd.DataFrame:
    """E, nu and E* of an object's points per error option, beside the study's table.

    Parameters
    ----------
    minima : DataFrame
        Of `minimum_rows`.
    published : DataFrame
        config/published/table_5_3.csv, table_5_4.csv or table_5_5.csv. The latter two name no
        point: they stand beside every point of the object.
    name : str
        Name of the object; others have no row here.
    material : mapping, optional
        material.json: with it the true values stand in columns ``true_*``.

    Returns
    -------
    DataFrame
        One row for each sensor, error option and capture that is the only one of its point.
    """
    ours = minima[(minima["object"] == name) & (minima["capture"] == minima["point"])].copy()
    if "point" in published:
        ours["point"] = ours["point"].astype(int)
    keys = [key for key in ("sensor", "point", "error") if key in published]
    printed = {value: f"published_{value}" for value in VALUES if value in published}
    merged = ours.merge(published.rename(columns=printed), on=keys, how="left")
    true = [] if material is None else [f"true_{value}" for value in TRUE]
    for value, column in zip(TRUE, true, strict=False):
        merged[column] = material[value]
    columns = ["sensor", "point", "error", *VALUES, "at_bound", *VERDICT, "poisson_ratio_reason"]
    columns += [*printed.values(), *true, "provenance"]
    return merged.sort_values(["sensor", "error", "point"])[columns].reset_index(drop=True)


def minimum_rows(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> Iterator[dict]:
    """Minima of all captures and error options.

    Parameters
    ----------
    captures : sequence of mapping
    minima : mapping
        minimise-<error>.json by (object, sensor, capture, error).
    """
    for known, error, found in _known(captures, minima):
        profile, derived = found["profile"], found["least_squares"]["length"]
        ends = profile["interval"] or (None, None)
        yield row(
            known,
            f"minimise_{error}",
            _moduli(found) | {NU: Modulus(found[NU], *ends, profile["verdict"], "1")},
            error=error,
            hertz_reduced_modulus_pa=found["hertz_reduced_modulus_pa"],
            at_bound=found["at_bound"],
            youngs_modulus_std_pa=derived["youngs_modulus_std_pa"],
            poisson_ratio_std=derived["poisson_ratio_std"],
            poisson_ratio_reason=derived["unknown"],
        )


def least_squares_rows(
    captures: Sequence[Mapping], minima: Mapping[tuple[str, str, str, str], Mapping]
) -> Iterator[dict]:
    """Least squares of the same gaps."""
    for known, error, minimum in _known(captures, minima):
        found = minimum["least_squares"]["square"]
        more = {name: found[name] for name in ("youngs_modulus_std_pa", "poisson_ratio_std")}
        more["at_bound"] = found["at_bound"]
        yield row(known, f"least_squares_{error}", _moduli(found), **more)


def _known(captures: Sequence[Mapping], minima: Mapping) -> Iterator[tuple]:
    """Described capture, error option and minimum of each."""
    described = {(c["object"], c["sensor"], c["capture"]): c for c in captures}
    for (*capture, error), minimum in minima.items():
        yield described[tuple(capture)], error, minimum


def _moduli(found: Mapping) -> dict[str, Modulus]:
    units = {E: "Pa", NU: "1", STAR: "Pa"}
    return {name: Modulus(found[name], None, None, None, unit) for name, unit in units.items()}
