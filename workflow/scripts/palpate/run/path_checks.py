"""What is wrong with the folders of a run: names that none can have, results where captures lie."""

from collections.abc import Mapping
from pathlib import Path

LONGEST_PATH = 1000


def path_problems(paths: Mapping, source: str) -> list[str]:
    """Say what is wrong with ``paths`` of the configuration, a line for each.

    Parameters
    ----------
    paths : mapping
        Folders by what they hold; ``lab`` may be None.
    source : str
        File named in messages.

    Returns
    -------
    list of str
        Results in raw/ would be written over captures that nobody can make again.
    """
    lines = [
        f"{source}: paths.{key}: expected printable characters, at most {LONGEST_PATH}, found"
        f" {value[:60]!a}"
        for key, value in paths.items()
        if value is not None and not (value.isprintable() and len(value) <= LONGEST_PATH)
    ]
    if lines:
        return lines
    results = Path(paths["results"]).resolve()
    for key in ("raw", "sensors", "probes", "meshes"):
        if results.is_relative_to(Path(paths[key]).resolve()):
            expected = f"a folder outside paths.{key}, {paths[key]}"
            lines.append(f"{source}: paths.results: expected {expected}, found {paths['results']}")
    return lines
