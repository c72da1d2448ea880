"""Find captures by looking into ``raw/``."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

BACKGROUND = "background"
# What stands for the sensor of a curve that was recorded without a camera: raw/<object>/08.csv.
CURVE, CURVE_END = "curve", ".csv"
NOT_SENSORS = ("scans", CURVE)
# Recordings about the sensors, and simulations: no objects.
NOT_OBJECTS = ("sensors", "simulations")
# Folders of results/ that are no object's, whatever the case of their letters.
TAKEN = ("benchmarks", "figures", "lab", "logs", "objects", "pages")
TAKEN += ("sample", "sensors", "simulation", "tables")
SENSOR_NAME = re.compile("[a-z][a-z0-9_]*")
OBJECT_NAME = re.compile("[A-Za-z0-9][A-Za-z0-9_]*")
# A point, or a point and an attempt: 08, 11-a03.
# Kinds of files with a template: surfaces alone, since scenes and archives may name other files.
MESHES = (".ply", ".stl", ".obj", ".off")
CAPTURE_NAME = re.compile("[A-Za-z0-9]+(-a[0-9]+)?")
CAPTURE_WORDS = (
    "a name like 08 or 08-a03 (the point's letters and digits; again there: -a, a number)"
)


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


@dataclass(frozen=True)
class SensorFolder:
    """What stands in ``raw/<object>/<sensor>/``.

    Attributes
    ----------
    folder : Path
    captures : tuple of Path
        Its captures' folders, sorted.
    background : Path
        Where frames without the object are to stand.
    has_background : bool
    """

    folder: Path
    captures: tuple[Path, ...]
    background: Path
    has_background: bool

    @property
    def contents(self) -> tuple[Path, ...]:
        """Background, where there is one, and captures."""
        return (*[self.background] * self.has_background, *self.captures)


def object_fault(name: str) -> str:
    """What keeps a name from being an object's, as expected and found; empty where nothing does."""
    if not OBJECT_NAME.fullmatch(name) or name in NOT_OBJECTS:
        others = " and ".join(NOT_OBJECTS)
        words = f"a name of letters, digits and _ other than {others}, like red_sponge"
        return f"expected {words}, found {name}"
    if name.casefold() in TAKEN:
        return f"expected none of {', '.join(TAKEN)}, found {name}"
    return ""


def sensor_fault(name: str) -> str:
    """What keeps a name from being a sensor's, as expected and found; empty where nothing does."""
    if SENSOR_NAME.fullmatch(name) and name not in NOT_SENSORS:
        return ""
    words = "a name of small letters, digits and _ other than scans and curve, like d435"
    return f"expected {words}, found {name}"


def sensor_folders(folder: str | Path) -> tuple[SensorFolder, ...]:
    """List what stands in an object's folder, by sensor."""
    return tuple(sensor_folder(place) for place in folders(folder) if place.name not in NOT_SENSORS)


def sensor_folder(folder: Path) -> SensorFolder:
    """List what stands in ``raw/<object>/<sensor>``, which may not be there."""
    found = folders(folder)
    captures = tuple(place for place in found if place.name != BACKGROUND)
    return SensorFolder(folder, captures, folder / BACKGROUND, len(captures) < len(found))


def curve_files(folder: str | Path) -> list[Path]:
    """Curves of force and depth in an object's folder, sorted; see `CURVE`."""
    folder = Path(folder)
    found = folder.glob(f"*{CURVE_END}") if folder.is_dir() else ()
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


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
