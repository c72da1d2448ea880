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

from palpate.report import texts

# Units by the ends of columns' names, what columns and tables are.
UNITS, MEANINGS, ALIKE, TITLES = texts("columns").values()
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
