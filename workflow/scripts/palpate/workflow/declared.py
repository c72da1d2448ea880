"""What object.yaml says, for jobs that depend on nothing else of an object."""

from collections.abc import Mapping


def declared_point(spec: Mapping, name: str) -> Mapping:
    """What object.yaml says of a point.

    Raises
    ------
    ValueError
        If it says nothing of it.
    """
    if name not in spec["points"]:
        names = ", ".join(sorted(spec["points"]))
        raise ValueError(f"points: expected one of {names}, found {name}")
    return spec["points"][name]
