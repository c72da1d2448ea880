"""An object's tables for other programs: links, and their description as a data package.

Specification of Frictionless Data Packages (data package, tabular data resource, table schema),
version 1: https://specs.frictionlessdata.io.
"""

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd
from pandas.io.json import build_table_schema

# Ends of the columns' names, the longest first, and the units that they stand for.
UNITS = {
    "_per_m": "1/m",
    "_n_m": "N/m",
    "_nm": "N m",
    "_pa": "Pa",
    "_px": "px",
    "_rad": "rad",
    "_m": "m",
    "_n": "N",
    "_s": "s",
}
# What the name of a column does not say itself.
MEANINGS = {
    "sensor": "camera; curve where there was none",
    "capture": "one press",
    "frame": "number of the camera's picture, or of a curve's sample, from 0",
    "time_s": "on the camera's clock",
    "sample": "place of the surface, as samples.csv has it",
    "force_n": "along the press, on the object",
    "depth_m": "of the tip in the object: offset, clock and what the probe gives way allowed for",
    "fitted_depth_m": "indentation that force and estimate give",
    "fitted_force_n": "force that depth and estimate give",
    "moved_m": "motion since the frames at rest, outward along the normal",
    "moved_std_m": "standard deviation of the frame's own noise",
    "fitted_moved_m": "motion that the estimate gives; empty where it was not compared",
    "moved_residual_m": "seen less fitted",
    "depth_residual_m": "seen less fitted",
    "force_residual_n": "seen less fitted",
    "depth_expected_std_m": "standard deviation of the residual by noise and what lasts",
    "moved_expected_std_m": "standard deviation of the residual as all residuals show it",
    "moved_residual_std_m": "standard deviation within the ring",
    "distance_m": "from the first touch, straight; of a profile the ring's mean",
    "samples": "how many the ring has",
    "rest_std_m": "standard deviation of the mean of the frames at rest",
    "recommended": "whether the row is the one to rely on",
}
# And of columns that are alike, by what their names begin or end with.
ALIKE = {
    r".*_low(_pa)?": "lower end of the 95 % interval",
    r".*_high(_pa)?": "upper end of the 95 % interval",
    r".*_verdict": "how well the captures tell it",
    r"contribution_.*": "standard deviation that the source adds to it; their squares add up",
    r"sensitivity_.*": "that over the source's own standard_uncertainty",
}
TITLES = {
    "data/force.csv": "Force against depth, with the recommended estimate's fit",
    "data/motion.csv": "Motion of the surface by sample and frame, with the estimate's",
    "data/samples.csv": "Places of the surface, in the object's frame",
    "data/profile.csv": "Motion over distance from the contact in the deepest frame, in rings",
    "summary.csv": "Moduli of every sensor, capture and method",
    "uncertainty_budget.csv": "What makes the intervals; deviations in the unit of their row",
    "probe_pose.csv": "Pose of the probe in each frame, camera frame",
    "force.csv": "Force on the object in each frame, camera frame",
}
DESCRIBED = "What each of their columns is, and its unit (a Frictionless Data Package)"
BUDGET = "uncertainty_budget.csv"
NOT_A_NAME = re.compile(r"[^a-z0-9._-]+")


def data_package(name: str, folder: str | Path, tables: Mapping[str, pd.DataFrame]) -> dict:
    """Describe tables of an object, by path, that were written, or were read.

    Where datapackage.json stands is ``folder``. Without a date: the same tables give the same
    description.
    """
    places = {Path(os.path.relpath(path, folder)).as_posix(): one for path, one in tables.items()}
    return {
        "profile": "tabular-data-package",
        "name": NOT_A_NAME.sub("-", name.lower()),
        "title": f"{name}: what was measured and fitted",
        "resources": [_resource(place, table) for place, table in places.items()],
    }


def links_of(sensors: Iterable[str]) -> dict[str, str]:
    """Tables beside an object's page, by their place, and what each is.

    A run makes them, they are not read here; sensors are those with a budget.
    """
    names = [place for place in TITLES if place.startswith("data/")] + ["summary.csv"]
    links = {place: TITLES[place] for place in names}
    links |= {f"{sensor}/{BUDGET}": TITLES[BUDGET] for sensor in sensors}
    return links | {"datapackage.json": DESCRIBED}


def _resource(place: str, table: pd.DataFrame) -> dict:
    return {
        "name": NOT_A_NAME.sub("-", place.lower().removesuffix(".csv")),
        "path": place,
        "profile": "tabular-data-resource",
        "title": TITLES.get(place) or TITLES[Path(place).name],
        "format": "csv",
        "mediatype": "text/csv",
        "encoding": "utf-8",
        "schema": {"fields": [_field(str(column), table[column]) for column in table]},
    }


def _field(name: str, values: pd.Series) -> dict:
    unit = next((told for end, told in UNITS.items() if name.endswith(end)), None)
    alike = next((told for kind, told in ALIKE.items() if re.fullmatch(kind, name)), None)
    parts = [MEANINGS.get(name, alike), f"unit: {unit}" if unit else None]
    told = "; ".join(filter(None, parts))
    described = {"description": told} if told else {}
    return {"name": name, "type": "number" if unit else _type(name, values)} | described


def _type(name: str, values: pd.Series) -> str:
    if name in ("sensor", "capture", "point"):
        return "string"
    # Nothing in it may be numbers or words in another object's table.
    if values.isna().all():
        return "any"
    return build_table_schema(values.to_frame(), index=False)["fields"][0]["type"]
