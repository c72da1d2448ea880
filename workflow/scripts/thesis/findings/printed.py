"""Numbers of the study and of ours in rows of one kind; config/published/*.csv."""

from collections.abc import Iterator, Mapping

import pandas as pd
from palpate.units import CENTIMETRES
from palpate.vision.camera import OPTICS

PLACE = ["object", "sensor", "point", "error"]
KEYS = ["artefact", *PLACE, "quantity"]
BLOCK, BALL, EAR, SIMULATED = "foam_block", "foam_ball", "ear", "simulated_block"
REPEATED = {"sensor": "kinect", "point": "11"}
CAMERAS = {"color": "color", "ir": "infrared"}
MODULI = ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa", "hertz_reduced_modulus_pa")
# Which artefact prints each row of simulation.csv.
SIMULATION_FIGURES = {
    ("linear_method", "exact"): "figure_3_5",
    ("linear_method", "tracked"): "figure_3_7",
    ("minimise_displacement", "tracked"): "figure_3_9",
}
ESTIMATES = {"table_5_3": BLOCK, "table_5_4": BALL, "table_5_5": EAR}
ENDS = {"mean": "_mean", "standard deviation (n-1)": "_std"}
# By table: its columns with numbers, and what their quantities are called.
NAMES: dict[str, dict[str, str]] = {
    "table_4_1": {name: f"{{camera}}_{name[:2]}" for name in OPTICS},
    "equation_4_12": {f"r{j}": f"r{{row}}{j}" for j in (1, 2, 3)} | {"t_m": "t{row}"},
    "table_4_2": {"std_cm": "tip_std_{axis}"},
    "figure_4_16": {"selected_threshold_px": "selected_threshold"},
    "table_5_1": {"reduced_modulus_pa": "reduced_modulus{end}"},
    "table_5_2": {"reduced_modulus_pa": "reduced_modulus"},
    "simulation": {f"{name}_pa": name for name in ("lame_lambda", "lame_mu")},
    **{key: {name: name.removesuffix("_pa") for name in MODULI} for key in ESTIMATES},
    "traces": {
        "settled_iteration": "settled_iteration",
        "error_first_mm": "error_first",
        "error_last_mm": "error_last",
    },
    "nodes": {"nodes": "nodes"},
    "residual": {"residual_n": "residual"},
}
# Of columns by the last part of their names.
UNITS = {"px": "px", "m": "m", "cm": "cm", "mm": "mm", "pa": "Pa", "n": "N"}
# Tables whose numbers no artefact but the study's text names.
OF_ANY_ARTEFACT = ("traces", "nodes", "residual")


def numbers(tables: Mapping[str, pd.DataFrame], value: str) -> pd.DataFrame:
    """Numbers of tables by the names of `NAMES`, one row each, under ``value``.

    Returns
    -------
    DataFrame
        Columns ``artefact, object, sensor, point, error, quantity, unit``, the value and
        ``provenance``; an empty string where a number belongs to no object, sensor, point or error
        option. Missing numbers have no row.
    """
    rows = (one for name in NAMES if name in tables for one in _rows(name, tables[name]))
    whole = pd.DataFrame(rows, columns=[*KEYS, "unit", "value", "provenance"])
    return whole.drop_duplicates([*KEYS, "provenance"]).rename(columns={"value": value})


def published_numbers(published: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Rows of all printed numbers, without ``provenance``.

    Parameters
    ----------
    published : mapping
        config/published/<name>.csv by name.
    """
    matrix = published["equation_4_12"].head(3)
    metres = (matrix["t"] / CENTIMETRES).round(10)
    optics = published["table_4_1"]
    alike = {
        "table_4_1": optics.assign(camera=optics["camera"].map(CAMERAS)),
        "equation_4_12": matrix.assign(row=range(1, 4), t_m=metres),
        "table_4_2": tip_of(published["table_4_2"]),
        "table_5_1": published["table_5_1"].assign(**REPEATED),
    }
    text = published["text"].astype(object)
    text = text.assign(point=text["point"].map(point_name)).fillna("")
    found = numbers({**published, **alike}, "published").drop(columns="provenance")
    return pd.concat([found, text[found.columns]], ignore_index=True)


def tip_of(table: pd.DataFrame) -> pd.DataFrame:
    """Table 4.2 with one row for each sensor and axis."""
    tip = table.melt("axis", var_name="sensor", value_name="std_cm")
    return tip.assign(sensor=tip["sensor"].str.removesuffix("_cm"))


def estimates(published: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Tables 5.3 to 5.5 as one table with the columns of `comparison.estimates`."""
    parts = [published[name].assign(object=owner) for name, owner in ESTIMATES.items()]
    whole = pd.concat(parts, ignore_index=True)
    columns = ["object", "sensor", "point", "error", *MODULI]
    return whole.assign(point=whole["point"].map(point_name)).reindex(columns=columns)


def point_name(point: object) -> str:
    """Name of a point as captures have it: two digits or a word; an empty string for none."""
    if pd.isna(point):
        return ""
    return point if isinstance(point, str) and not point.isdigit() else f"{int(point):02d}"


def _rows(name: str, table: pd.DataFrame) -> Iterator[dict]:
    """Rows of one table, entry by entry."""
    for entry in table.to_dict("records"):
        known = {"artefact": "" if name in OF_ANY_ARTEFACT else name} | _known(name, entry)
        for column, quantity in NAMES[name].items():
            if known["artefact"] is None or pd.isna(entry.get(column)):
                continue
            # Hertz's E* depends on no error option.
            place = known | ({"error": ""} if column.startswith("hertz") else {})
            yield {key: place.get(key, "") for key in KEYS} | {
                "quantity": quantity.format(**known),
                "unit": UNITS.get(column.rpartition("_")[2], ""),
                "value": entry[column],
                "provenance": entry.get("provenance", ""),
            }


def _known(name: str, entry: Mapping) -> dict:
    """What an entry of a table is of, and what its quantities are called by."""
    if name in ("table_4_1", "equation_4_12"):
        return {**entry, "sensor": REPEATED["sensor"]}
    if name == "simulation":
        figure = SIMULATION_FIGURES.get((entry["method"], entry["data"]))
        error = "displacement" if figure == "figure_3_9" else ""
        return {"artefact": figure, "object": SIMULATED, "error": error}
    known = dict(entry)
    if "point" in entry:
        known["point"] = point_name(entry["point"])
    if name in ("table_5_1", "table_5_2"):
        known["object"] = BLOCK
    if name == "table_5_1":
        known["end"] = ENDS.get(entry["attempt"], "")
        known["point"] += "" if known["end"] else f"-a{int(entry['attempt']):02d}"
    if name in ESTIMATES:
        known["object"] = ESTIMATES[name]
    return known
