"""Configuration of the ordinary workflow for one object of many."""

import json
from collections.abc import Mapping


def object_config(config: Mapping, name: str, results: str) -> dict:
    """Give the configuration of the ordinary workflow for one object.

    Parameters
    ----------
    config : mapping
        Configuration of all.
    name : str
        The object.
    results : str
        Folder of its results.

    Returns
    -------
    dict
        The same, but for the one object, its folder of results, and no virtual lab: what stands
        in raw/ is taken as it is.
    """
    whole = json.loads(json.dumps(config))
    whole["paths"] |= {"results": results, "lab": None}
    return whole | {"only": name}
