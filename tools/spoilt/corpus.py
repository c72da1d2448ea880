"""All mutations, in one order."""

import random
from collections.abc import Sequence

from spoilt import images, kept, meshes, names, physics, tables, texts, walk
from spoilt.place import Mutation

GROUPS = (images, tables, physics, texts, names, meshes, kept, walk)


def corpus() -> list[Mutation]:
    """Every mutation; their names are unique."""
    found = [one for group in GROUPS for one in group.corpus()]
    keys = [one.key for one in found]
    twice = {key for key in keys if keys.count(key) > 1}
    if twice:
        raise ValueError(f"mutations: expected each name once, found {sorted(twice)[0]} twice")
    return found


def drawn(mutations: Sequence[Mutation], count: int, *, seed: int) -> list[Mutation]:
    """Some of them, the same for the same seed."""
    return random.Random(seed).sample(list(mutations), count)
