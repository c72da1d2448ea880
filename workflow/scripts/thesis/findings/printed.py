"""Every number that the study prints, in rows of one kind: config/published/*.csv."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from palpate.units import CENTIMETRES

KEYS = ["artefact", "object", "sensor", "point", "error", "quantity"]
PRINTED = [*KEYS, "unit", "published"]
BLOCK, BALL, EAR, SIMULATED = "foam_block", "foam_ball", "ear", "simulated_block"
REPEATED_POINT, REPEATED_SENSOR = "11", "kinect"
OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")
CAMERAS = {"color": "color", "ir": "infrared"}
MODULI_UNITS = {
    "youngs_modulus_pa": "Pa",
    "poisson_ratio": "",
    "reduced_modulus_pa": "Pa",
    "hertz_reduced_modulus_pa": "Pa",
}
# Which artefact prints each row of simulation.csv.
SIMULATION_FIGURES = {
    ("linear_method", "exact"): "figure_3_5",
    ("linear_method", "tracked"): "figure_3_7",
    ("minimise_displacement", "tracked"): "figure_3_9",
}
ESTIMATES = {"table_5_3": BLOCK, "table_5_4": BALL, "table_5_5": EAR}


def numbers(published: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Rows of all printed numbers.

    Parameters
    ----------
    published : mapping
        config/published/<name>.csv by name.

    Returns
    -------
    DataFrame
        Columns ``artefact, object, sensor, point, error, quantity, unit, published``; an empty
        string where a number belongs to no object, sensor, point or error option.
    """
    parts = [
        *_calibration(published["table_4_1"], published["equation_4_12"]),
        *_tip(published["table_4_2"]),
        *_repeats(published["table_5_1"]),
        *_points(published["table_5_2"]),
        *simulation_rows(published["simulation"]),
    ]
    for name, owner in ESTIMATES.items():
        parts += estimate_rows(published[name].assign(object=owner), artefact=name)
    text = published["text"].astype(object)
    text = text.assign(point=text["point"].map(point_name)).fillna("")
    return pd.concat([pd.DataFrame(parts, columns=PRINTED), text[PRINTED]], ignore_index=True)


def estimates(published: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Tables 5.3 to 5.5 as one table with the columns of `comparison.estimates`."""
    parts = [published[name].assign(object=owner) for name, owner in ESTIMATES.items()]
    whole = pd.concat(parts, ignore_index=True)
    columns = ["object", "sensor", "point", "error", *MODULI_UNITS]
    return whole.assign(point=whole["point"].map(point_name)).reindex(columns=columns)


def point_name(point: object) -> str:
    """Name of a point as captures have it: two digits or a word; an empty string for none."""
    if pd.isna(point):
        return ""
    return point if isinstance(point, str) and not point.isdigit() else f"{int(point):02d}"


def row(artefact: str, quantity: str, unit: str, value: float, **place: str) -> dict:
    """One printed number; what ``place`` does not name is blank."""
    blank = dict.fromkeys(("object", "sensor", "point", "error"), "")
    known = {"artefact": artefact, "quantity": quantity, "unit": unit, "published": value}
    return blank | known | place


def estimate_rows(table: pd.DataFrame, *, artefact: str) -> list[dict]:
    """Rows of E, nu, E* and Hertz's E*, where a table has them.

    Hertz's E* hangs on no error option and stands once for each sensor and point.
    """
    rows = []
    for entry in table.to_dict("records"):
        place = {"object": entry["object"], "sensor": entry["sensor"]}
        place["point"] = point_name(entry.get("point"))
        for name, unit in MODULI_UNITS.items():
            if pd.notna(entry.get(name)):
                error = "" if name.startswith("hertz") else entry["error"]
                quantity = name.removesuffix("_pa")
                rows.append(row(artefact, quantity, unit, entry[name], error=error, **place))
    return list({tuple(one[key] for key in KEYS): one for one in rows}.values())


def simulation_rows(table: pd.DataFrame) -> list[dict]:
    """Lame parameters of the simulated block, by the figure that prints them."""
    rows = []
    for entry in table.to_dict("records"):
        artefact = SIMULATION_FIGURES.get((entry["method"], entry["data"]))
        if artefact is None:
            continue
        place = {"object": SIMULATED}
        place["error"] = "displacement" if artefact == "figure_3_9" else ""
        for name in ("lame_lambda", "lame_mu"):
            rows.append(row(artefact, name, "Pa", entry[f"{name}_pa"], **place))
    return rows


def _calibration(optics: pd.DataFrame, transform: pd.DataFrame) -> list[dict]:
    place = {"sensor": REPEATED_SENSOR}
    rows = [
        row("table_4_1", f"{CAMERAS[entry['camera']]}_{name[:2]}", "px", entry[name], **place)
        for entry in optics.to_dict("records")
        for name in OPTICS
    ]
    matrix = transform.to_numpy(float)
    for i, j in np.ndindex(3, 4):
        quantity, unit = (f"r{i + 1}{j + 1}", "") if j < 3 else (f"t{i + 1}", "m")
        value = matrix[i, j] / (CENTIMETRES if j == 3 else 1)
        rows.append(row("equation_4_12", quantity, unit, round(value, 10), **place))
    return rows


def _tip(table: pd.DataFrame) -> list[dict]:
    return [
        row("table_4_2", f"tip_std_{e['axis']}", "cm", e[f"{sensor}_cm"], sensor=sensor)
        for sensor in ("bumblebee", "kinect")
        for e in table.to_dict("records")
    ]


def _repeats(table: pd.DataFrame) -> list[dict]:
    place = {"object": BLOCK, "sensor": REPEATED_SENSOR}
    moduli = table["reduced_modulus_pa"]
    return [
        row("table_5_1", "reduced_modulus", "Pa", value,
            point=f"{REPEATED_POINT}-a{int(attempt):02d}", **place)
        for attempt, value in zip(table["attempt"], moduli, strict=True)
    ]  # fmt: skip


def _points(table: pd.DataFrame) -> list[dict]:
    return [
        row("table_5_2", "reduced_modulus", "Pa", e["reduced_modulus_pa"],
            object=BLOCK, sensor=e["sensor"], point=point_name(e["point"]))
        for e in table.to_dict("records")
    ]  # fmt: skip
