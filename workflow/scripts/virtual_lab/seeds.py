"""Seeds of what the lab draws."""

import zlib
from collections.abc import Mapping


def seed_of(common: Mapping, *names: str) -> list[int]:
    """Seed of a named thing of the lab, the same in whatever order things are made."""
    return [common["seed"], *(zlib.crc32(name.encode()) for name in names)]
