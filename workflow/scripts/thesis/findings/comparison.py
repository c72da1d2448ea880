"""Every printed number of the study beside ours and, where the lab knows it, the true one."""

from collections.abc import Mapping, Sequence

import pandas as pd
from palpate.units import MILLIMETRES

from thesis.findings import printed
from thesis.findings.printed import KEYS, SIMULATED, estimate_rows, row

COLUMNS = [*KEYS, "unit", "published", "ours", "ratio", "true", "provenance"]
MINIMISED = "minimise_"
SIGNIFICANT = 6
# Lame parameters within this part of their last values have settled.
SETTLED = 0.01


def comparison(
    printed_rows: pd.DataFrame, ours: pd.DataFrame, true: Mapping[tuple[str, str], float]
) -> pd.DataFrame:
    """Put ours beside each printed number.

    Parameters
    ----------
    printed_rows : DataFrame
        Of `printed.numbers`.
    ours : DataFrame
        Of `our_numbers`.
    true : mapping
        True value by (object or sensor, quantity), in the printed unit.

    Returns
    -------
    DataFrame
        One row a number; where the study names no sensor or point, one for each of ours.
    """
    rows = []
    for number in printed_rows.to_dict("records"):
        found = _like(ours, number)
        for mine in found.to_dict("records") or [{}]:
            rows.append(number | {key: mine.get(key) or number[key] for key in ("sensor", "point")}
                        | {"ours": mine.get("ours"), "provenance": mine.get("provenance", "")}
                        | {"true": _true(true, number)})  # fmt: skip
    table = pd.DataFrame(rows)
    for name in ("published", "ours", "true"):
        table[name] = pd.to_numeric(table[name])
    table["ratio"] = (table["ours"] / table["published"].where(table["published"] != 0)).round(4)
    for name in ("ours", "true"):
        table[name] = [_short(value) for value in table[name]]
    return table[COLUMNS]


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
    columns = [*keys, "error", *printed.MODULI_UNITS, "poisson_ratio_verdict", "provenance"]
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
    rows = []
    for name, make in MAKERS.items():
        if name in tables:
            rows += make(tables[name])
    for capture, error, trace in traces:
        rows += _trace_rows(capture, error, trace)
    for capture, count in nodes:
        place = {key: capture[key] for key in ("object", "provenance")}
        rows.append(row("", "nodes", "", count, **place))
    if residual_n is not None:
        rows.append(row("", "residual", "N", residual_n, object=SIMULATED, provenance="simulated"))
    table = pd.DataFrame(rows, columns=[*printed.PRINTED, "provenance"])
    return table.rename(columns={"published": "ours"})


def settled_iteration(trace: Sequence[Mapping], *, within: float = SETTLED) -> int:
    """First iteration from which both Lame parameters stay near their last values."""
    steps = pd.DataFrame(trace)
    values = steps[["lame_lambda_pa", "lame_mu_pa"]]
    last = values.iloc[-1]
    apart = (values - last).abs().gt(within * last.abs()).any(axis=1).to_numpy()
    away = apart.nonzero()[0]
    return int(steps["iteration"].iloc[away[-1] + 1 if len(away) else 0])


def _like(ours: pd.DataFrame, number: Mapping) -> pd.DataFrame:
    """Ours of the printed number; what the study leaves blank may be anything of ours."""
    same = (ours["quantity"] == number["quantity"]) & (ours["artefact"] == "")
    same |= (ours["quantity"] == number["quantity"]) & (ours["artefact"] == number["artefact"])
    for key in ("object", "error"):
        same &= ours[key] == number[key]
    for key in ("sensor", "point"):
        # Nodes and residuals of ours have no sensor either.
        same &= (ours[key] == number[key]) | (number[key] == "") | (ours[key] == "")
    return ours[same].sort_values(["sensor", "point"])


def _true(true: Mapping[tuple[str, str], float], number: Mapping) -> float | None:
    quantity = number["quantity"].removeprefix("hertz_").removesuffix("_mean")
    owner = number["object"] or number["sensor"]
    return true.get((owner, quantity))


def _short(value: float) -> float | None:
    return None if pd.isna(value) else float(f"{value:.{SIGNIFICANT}g}")


def _trace_rows(capture: Mapping, error: str, trace: Sequence[Mapping]) -> list[dict]:
    place = {key: capture[key] for key in ("object", "sensor", "point", "provenance")}
    values = (
        ("settled_iteration", "", settled_iteration(trace)),
        ("error_first", "mm", trace[0]["error_m"] * MILLIMETRES),
        ("error_last", "mm", trace[-1]["error_m"] * MILLIMETRES),
    )
    return [row("", name, unit, value, error=error, **place) for name, unit, value in values]


def _optics_rows(table: pd.DataFrame) -> list[dict]:
    return [
        row("table_4_1", f"{e['camera']}_{name[:2]}", "px", e[name],
            sensor=printed.REPEATED_SENSOR, provenance=e["provenance"])
        for e in table.to_dict("records")
        for name in printed.OPTICS
    ]  # fmt: skip


def _transform_rows(table: pd.DataFrame) -> list[dict]:
    rows = []
    for e in table[table["row"] <= 3].to_dict("records"):
        place = {"sensor": printed.REPEATED_SENSOR, "provenance": e["provenance"]}
        i = int(e["row"])
        rows += [row("equation_4_12", f"r{i}{j}", "", e[f"r{j}"], **place) for j in (1, 2, 3)]
        rows.append(row("equation_4_12", f"t{i}", "m", e["t_m"], **place))
    return rows


def _tip_rows(table: pd.DataFrame) -> list[dict]:
    rows = []
    for e in table.to_dict("records"):
        place = {"sensor": e["sensor"], "provenance": e["provenance"]}
        rows.append(row("table_4_2", f"tip_std_{e['axis']}", "cm", e["std_cm"], **place))
        if e["axis"] == "x":
            threshold = e["selected_threshold_px"]
            rows.append(row("figure_4_16", "selected_threshold", "px", threshold, **place))
    return rows


def _repeat_rows(table: pd.DataFrame) -> list[dict]:
    names = {"mean": "_mean", "standard deviation (n-1)": "_std"}
    rows = []
    for e in table.to_dict("records"):
        end, point = names.get(e["attempt"], ""), f"{int(e['point']):02d}"
        if not end:
            point += f"-a{int(e['attempt']):02d}"
        place = {"object": printed.BLOCK, "sensor": e["sensor"], "provenance": e["provenance"]}
        value = e["reduced_modulus_pa"]
        rows.append(row("table_5_1", f"reduced_modulus{end}", "Pa", value, point=point, **place))
    return rows


def _point_rows(table: pd.DataFrame) -> list[dict]:
    return [
        row("table_5_2", "reduced_modulus", "Pa", e["reduced_modulus_pa"], object=printed.BLOCK,
            sensor=e["sensor"], point=printed.point_name(e["point"]), provenance=e["provenance"])
        for e in table.to_dict("records")
    ]  # fmt: skip


def _summary_rows(summary: pd.DataFrame) -> list[dict]:
    found = estimates(summary)
    rows = []
    for name, owner in printed.ESTIMATES.items():
        mine = found[found["object"] == owner]
        for part in mine["provenance"].unique():
            for one in estimate_rows(mine[mine["provenance"] == part], artefact=name):
                rows.append(one | {"provenance": part})
    return rows


def _simulation_rows(table: pd.DataFrame) -> list[dict]:
    return [one | {"provenance": "simulated"} for one in printed.simulation_rows(table)]


MAKERS = {
    "table_4_1": _optics_rows,
    "equation_4_12": _transform_rows,
    "table_4_2": _tip_rows,
    "table_5_1": _repeat_rows,
    "table_5_2": _point_rows,
    "simulation": _simulation_rows,
    "summary": _summary_rows,
}
