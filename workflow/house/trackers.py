"""Options of the named trackers of config.yaml."""

from collections.abc import Mapping


def options_of(tracking: Mapping, name: str, object_name: str) -> dict:
    """Options of a tracker for one object.

    Parameters
    ----------
    tracking : mapping
        ``tracking`` block of config.yaml.
    name, object_name : str
        The tracker and the object.
    """
    own = dict(tracking["trackers"][name])
    base = own.pop("like", None)
    inherited = options_of(tracking, base, object_name) if base is not None else {}
    return inherited | own | tracking["objects"].get(object_name, {}).get(name, {})
