"""Every field of the files that people write: dropped, or of another type or size."""

import copy
import random
from collections.abc import Iterator

import yaml

from spoilt.place import ROOT, Mutation, Place
from spoilt.texts import path_of

WRONG = ["text", -1, 0, 1e30, 1e-30, float("nan"), float("inf"), [], {}, None, True, 2**70, 0.5]
# How many of them, or to be dropped, each field meets.
PER_FIELD = {
    "object.yaml": 4,
    "sensors/kinect.yaml": 3,
    "probes/nano25_sphere.yaml": 2,
    "config": 1,
}
DROPPED = "dropped"
# Lists are alike from end to end.
ENDS = 2
SEED = 11


def fields(value, path: tuple = ()) -> Iterator[tuple]:
    """Paths of all fields, groups too; of long lists the two ends."""
    if path:
        yield path
    if isinstance(value, dict):
        for key, part in value.items():
            if key not in POINTS:
                yield from fields(part, (*path, key))
    elif isinstance(value, list):
        for k in range(len(value)) if len(value) <= ENDS else (0, len(value) - 1):
            yield from fields(value[k], (*path, k))


# Of the eighteen points of the block one is used and one is looked at.
POINTS = {f"{k:02d}" for k in range(2, 19)} - {"08"}


def replaced(value, path: tuple, new):
    """A copy with one field of another value."""
    changed = copy.deepcopy(value)
    part = changed
    for key in path[:-1]:
        part = part[key]
    # The sample's own options may be a shorter list.
    if isinstance(part, list) and path[-1] >= len(part):
        part.append(new)
    else:
        part[path[-1]] = new
    return changed


def without(value, path: tuple):
    """A copy without one field."""
    changed = copy.deepcopy(value)
    part = changed
    for key in path[:-1]:
        part = part[key]
    del part[path[-1]]
    return changed


def corpus() -> list[Mutation]:
    """Mutations of single fields, drawn with one seed."""
    return [one for file in PER_FIELD for one in _of_file(file)]


def _of_file(file: str) -> Iterator[Mutation]:
    draw = random.Random(f"{SEED} {file}")
    sources = {
        "object.yaml": "tests/sample/raw/foam_block/object.yaml",
        "sensors/kinect.yaml": "tests/sample/sensors/kinect.yaml",
        "probes/nano25_sphere.yaml": "config/probes/nano25_sphere.yaml",
        "config": "config/config.yaml",
    }
    spec = yaml.safe_load((ROOT / sources[file]).read_text())
    for path in fields(spec):
        name = ".".join(map(str, path))
        for value in draw.sample([DROPPED, *WRONG], PER_FIELD[file]):
            if value == DROPPED:
                what, change = f"{file}: {name} dropped", _change(file, path)
            else:
                what, change = f"{file}: {name} = {value!r}", _change(file, path, value)
            yield Mutation("field", what, file, change, option=True)


def _change(file: str, path: tuple, *value):
    def apply(spec):
        return replaced(spec, path, value[0]) if value else without(spec, path)

    def spoil(place: Place) -> None:
        if file != "config":
            place.yaml(path_of(place, file), apply)
        elif path[0] != "paths":
            place.config = apply(place.config)

    return spoil
