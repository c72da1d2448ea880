"""How far the traced path lies from the outline of the CD case (Section 4.2.4)."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from palpate.json_fields import read_one
from palpate.report import outputs
from palpate.units import MILLIMETRES

from thesis.chapter4.sensor_files import by_sensor

TITLE = "Tracing the CD case (Section 4.2.4): the tip's centre against the case's outline (mm)"


def make_cd_case_table(inputs: Any, params: Any) -> dict:
    """Offsets of each sensor's path."""
    paths = by_sensor(params.names, inputs.paths)
    places = by_sensor(params.names, inputs.places, read_one)
    table = pd.DataFrame([case_row(name, paths[name], places[name]) for name in params.names])
    table["provenance"] = table["sensor"].map(params.provenance)
    return outputs.table(table, title=TITLE)


def case_row(name: str, path: pd.DataFrame, place: Mapping) -> dict:
    """Offsets of one sensor's path; a hand leaves the edge here and there."""
    found = {"sensor": name, "frames": len(path)}
    for kind in ("raw", "smooth", "study"):
        offset = path[f"{kind}_offset_m"] * MILLIMETRES
        found |= {f"{kind}_offset_mm": offset.mean(), f"{kind}_offset_std_mm": offset.std()}
    return found | {"tip_radius_mm": place["tip_radius_m"] * MILLIMETRES}
