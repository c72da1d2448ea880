"""Find captures by looking into ``raw/``."""

import re
from dataclasses import dataclass
from pathlib import Path

BACKGROUND = "background"
NOT_SENSORS = ("scans",)
# Recordings about the sensors, and simulations: no objects.
NOT_OBJECTS = ("sensors", "simulations")
# Folders of results/ that are no object's, whatever the case of their letters.
TAKEN = ("benchmarks", "figures", "lab", "logs", "objects", "pages")
TAKEN += ("sample", "sensors", "simulation", "tables")
# A point, or a point and an attempt: 08, 11-a03.
CAPTURE_NAME = re.compile("[A-Za-z0-9]+(-a[0-9]+)?")


@dataclass(frozen=True, order=True)
class CaptureId:
    """One indentation: ``raw/<object>/<sensor>/<capture>/``."""

    object: str
    sensor: str
    capture: str

    @property
    def point(self) -> str:
        """Number of the point, the part of the name before a hyphen."""
        return self.capture.partition("-")[0]

    @property
    def attempt(self) -> str:
        """Attempt at the point, the part of the name after a hyphen; empty for the only one."""
        return self.capture.partition("-")[2]


def discover(raw: str | Path) -> list[CaptureId]:
    """List the captures below a folder, sorted.

    Parameters
    ----------
    raw : path
        Folder of all objects; hidden folders, backgrounds, scans and non-objects are passed over.
    """
    return sorted(
        CaptureId(name.name, sensor.name, capture.name)
        for name in folders(raw)
        if name.name not in NOT_OBJECTS
        for sensor in folders(name)
        if sensor.name not in NOT_SENSORS
        for capture in folders(sensor)
        if capture.name != BACKGROUND
    )


def folders(parent: str | Path) -> list[Path]:
    """Visible folders in a folder, sorted; none where it does not exist."""
    parent = Path(parent)
    if not parent.is_dir():
        return []
    found = (path for path in parent.iterdir() if path.is_dir())
    return sorted(path for path in found if not path.name.startswith("."))
