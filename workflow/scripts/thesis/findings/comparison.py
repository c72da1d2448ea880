"""Every printed number of the study beside ours and, where the lab knows it, the true one."""

from collections.abc import Mapping, Sequence

import pandas as pd
from palpate.report.tables import significant
from palpate.units import MILLIMETRES

from thesis.findings.printed import ESTIMATES, KEYS, MODULI, SIMULATED, numbers

COLUMNS = [*KEYS, "unit", "published", "ours", "ratio", "true", "provenance"]
MINIMISED = "minimise_"
DIGITS = 6
# Lame parameters within this part of their last values have settled.
SETTLED = 0.01


def comparison(
    printed: pd.DataFrame, ours: pd.DataFrame, true: Mapping[tuple[str, str], float]
) -> pd.DataFrame:
    """Put ours beside each printed number.

    Parameters
    ----------
    printed : DataFrame
        Of `printed.published_numbers`.
    ours : DataFrame
        Of `our_numbers`.
    true : mapping
        True value by (object or sensor, quantity), in the printed unit.

    Returns
    -------
    DataFrame
        One row a number; where the study names no sensor or point, one for each of ours.
    """
    places = ["sensor", "point"]
    same = ["object", "error", "quantity"]
    pairs = printed.reset_index(names="number").merge(ours, on=same, suffixes=("", "_ours"))
    alike = (pairs["artefact_ours"] == "") | (pairs["artefact_ours"] == pairs["artefact"])
    for key in places:
        # Nodes and residuals of ours have no sensor either.
        blank = (pairs[key] == "") | (pairs[f"{key}_ours"] == "")
        alike &= blank | (pairs[key] == pairs[f"{key}_ours"])
    mine = pairs[alike].set_index("number")[["sensor_ours", "point_ours", "ours", "provenance"]]
    table = printed.join(mine)
    for key in places:
        table[key] = table[f"{key}_ours"].fillna("").where(lambda name: name != "", table[key])
    table = table.rename_axis("number").sort_values(["number", *places])
    owner = table["object"].where(table["object"] != "", table["sensor"])
    names = table["quantity"].str.removeprefix("hertz_").str.removesuffix("_mean")
    table["true"] = [true.get(key) for key in zip(owner, names, strict=True)]
    table["provenance"] = table["provenance"].fillna("")
    for name in ("published", "ours", "true"):
        table[name] = pd.to_numeric(table[name])
    table["ratio"] = (table["ours"] / table["published"].where(table["published"] != 0)).round(4)
    for name in ("ours", "true"):
        table[name] = significant(table[name], DIGITS)
    return table[COLUMNS].reset_index(drop=True)


def estimates(summary: pd.DataFrame) -> pd.DataFrame:
    """Minima of summary.csv with Hertz's E* beside them, captures that are their point's only one.

    Returns
    -------
    DataFrame
        ``object, sensor, point, error, youngs_modulus_pa, poisson_ratio, reduced_modulus_pa,
        hertz_reduced_modulus_pa, poisson_ratio_verdict, provenance``.
    """
    single = summary[summary["capture"] == summary["point"]]
    keys = ["object", "sensor", "point"]
    hertz = single[single["method"] == "hertz"][[*keys, "reduced_modulus_pa"]]
    hertz = hertz.rename(columns={"reduced_modulus_pa": "hertz_reduced_modulus_pa"})
    found = single[single["method"].str.startswith(MINIMISED)]
    found = found.assign(error=found["method"].str.removeprefix(MINIMISED))
    columns = [*keys, "error", *MODULI, "poisson_ratio_verdict", "provenance"]
    return found.merge(hertz, on=keys)[columns].reset_index(drop=True)


def our_numbers(
    tables: Mapping[str, pd.DataFrame],
    *,
    traces: Sequence[tuple[Mapping, str, Sequence[Mapping]]] = (),
    nodes: Sequence[tuple[Mapping, int]] = (),
    residual_n: float | None = None,
) -> pd.DataFrame:
    """Our counterparts of the printed numbers.

    Parameters
    ----------
    tables : mapping
        ``summary`` and what there is of the tables 3.1 to 5.2 and ``simulation``, by name.
    traces : sequence of (capture, error option, trace)
        Traces of minimisations, as in minimise-<error>.json.
    nodes : sequence of (capture, count)
        Nodes of the solid of each capture's object.
    residual_n : float, optional
        Residual of the linear method on exact data [N].
    """
    known = {name: table for name, table in tables.items() if name != "summary"}
    if "equation_4_12" in tables:
        transform = tables["equation_4_12"]
        known["equation_4_12"] = transform[transform["row"] <= 3]
    if "table_4_2" in tables:
        known["figure_4_16"] = tables["table_4_2"].drop_duplicates("sensor")
    if "simulation" in tables:
        known["simulation"] = tables["simulation"].assign(provenance="simulated")
    if "summary" in tables:
        found = estimates(tables["summary"])
        known |= {name: found[found["object"] == owner] for name, owner in ESTIMATES.items()}
    of = ("object", "provenance")
    known["traces"] = settled(traces)
    known["nodes"] = pd.DataFrame({k: one[k] for k in of} | {"nodes": n} for one, n in nodes)
    alone = {"object": SIMULATED, "residual_n": residual_n, "provenance": "simulated"}
    known["residual"] = pd.DataFrame([alone])
    return numbers(known, "ours").drop(columns="unit")


def settled(traces: Sequence[tuple[Mapping, str, Sequence[Mapping]]]) -> pd.DataFrame:
    """When each minimisation settles, and its first and last error [mm]."""
    return pd.DataFrame(
        {key: capture[key] for key in ("object", "sensor", "point", "provenance")}
        | {
            "error": error,
            "settled_iteration": settled_iteration(trace),
            "error_first_mm": trace[0]["error_m"] * MILLIMETRES,
            "error_last_mm": trace[-1]["error_m"] * MILLIMETRES,
        }
        for capture, error, trace in traces
    )


def settled_iteration(trace: Sequence[Mapping], *, within: float = SETTLED) -> int:
    """First iteration from which both Lame parameters stay near their last values."""
    steps = pd.DataFrame(trace)
    values = steps[["lame_lambda_pa", "lame_mu_pa"]]
    last = values.iloc[-1]
    apart = (values - last).abs().gt(within * last.abs()).any(axis=1).to_numpy()
    away = apart.nonzero()[0]
    return int(steps["iteration"].iloc[away[-1] + 1 if len(away) else 0])
