"""Find what stands in ``raw/``, by its names, and stamp it, so that what changes is noticed."""

import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path

from palpate.yaml_files import mismatch

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
# Kinds of files with a template: surfaces alone, since scenes and archives may name other files.
MESHES = (".ply", ".stl", ".obj", ".off")
# A point, or a point and an attempt: 08, 11-a03.
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


@dataclass(frozen=True)
class SensorFolder:
    """What stands in ``raw/<object>/<sensor>/``."""

    folder: Path
    captures: tuple[Path, ...]  # folders, sorted
    has_background: bool

    @property
    def background(self) -> Path:
        """Where frames without the object are to stand."""
        return self.folder / BACKGROUND

    @property
    def scene(self) -> Path:
        """Folder that shows what the object stands on: without a background the first capture."""
        return self.background if self.has_background else min(self.captures, default=self.folder)

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


def folders(parent: str | Path) -> list[Path]:
    """Visible folders in a folder, sorted; none where it does not exist."""
    parent = Path(parent)
    if not parent.is_dir():
        return []
    found = (path for path in parent.iterdir() if path.is_dir())
    return sorted(path for path in found if not path.name.startswith("."))


def object_folders(raw: str | Path) -> list[Path]:
    """Folders of objects in the folder of all, sorted."""
    return [folder for folder in folders(raw) if folder.name not in NOT_OBJECTS]


def sensor_folders(folder: str | Path) -> tuple[SensorFolder, ...]:
    """List what stands in an object's folder, by sensor."""
    return tuple(sensor_folder(place) for place in folders(folder) if place.name not in NOT_SENSORS)


def sensor_folder(folder: Path) -> SensorFolder:
    """List what stands in ``raw/<object>/<sensor>``, which may not be there."""
    found = folders(folder)
    captures = tuple(place for place in found if place.name != BACKGROUND)
    return SensorFolder(folder, captures, len(captures) < len(found))


def discover(raw: str | Path) -> list[CaptureId]:
    """List the captures below the folder of all objects, sorted.

    Hidden folders, backgrounds, scans and non-objects are passed over.
    """
    return sorted(
        CaptureId(folder.name, place.folder.name, capture.name)
        for folder in object_folders(raw)
        for place in sensor_folders(folder)
        for capture in place.captures
    )


def curve_files(folder: str | Path) -> list[Path]:
    """Curves of force and depth in an object's folder, sorted; see `CURVE`."""
    found = Path(folder).glob(f"*{CURVE_END}")
    return sorted(path for path in found if path.is_file() and not path.name.startswith("."))


def declared_point(spec: Mapping, name: str) -> Mapping:
    """What object.yaml says of a point.

    Raises
    ------
    ValueError
        If it says nothing of it.
    """
    if name not in spec["points"]:
        names = ", ".join(sorted(spec["points"]))
        raise mismatch("points", f"one of {names}", name)
    return spec["points"][name]


def folder_fingerprint(folder: str | Path, *, linked: int = 0) -> str:
    """Digest the names, sizes and modification times of a folder's files.

    Reading the images themselves at every start would take minutes for a large study; size and
    time change with every ordinary way of replacing a file. Hidden files are passed over. It has
    sixteen hexadecimal digits.

    Parameters
    ----------
    folder : path
        Itself a link or not.
    linked : int, optional
        Levels below it whose folders may be links: 2 in an object's, for sensors and captures.
        A link to itself is passed over, and one to a folder above it is entered on these alone.
    """
    digest = hashlib.sha256()
    for parts, status in sorted(_files(str(folder), (), linked), key=itemgetter(0)):
        digest.update(f"{'/'.join(parts)} {status.st_size} {status.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]


def _files(
    folder: str, parts: tuple[str, ...], linked: int
) -> Iterator[tuple[tuple, os.stat_result]]:
    """Visible files below a folder; a linked folder is entered on the first levels alone."""
    # By os.path, whose answer is no of a link to itself: entries raise an error.
    for entry in os.scandir(folder) if os.path.isdir(folder) else ():
        if entry.name.startswith("."):
            continue
        if os.path.isdir(entry.path):
            if linked > 0 or not entry.is_symlink():
                yield from _files(entry.path, (*parts, entry.name), linked - 1)
        elif os.path.isfile(entry.path):
            yield (*parts, entry.name), entry.stat()


def stamp(path: str | Path) -> str:
    """Fingerprint of a folder; size [bytes], time of modification [ns] and inode of a file.

    Empty where nothing stands.
    """
    path = Path(path)
    if path.is_dir():
        return folder_fingerprint(path)
    if not path.exists():
        return ""
    status = path.stat()
    return f"{status.st_size} {status.st_mtime_ns} {status.st_ino}"


def stamps_below(raw: str | Path, *, only: str | None = None) -> dict[str, str]:
    """Stamp whatever may stand in ``raw/`` for a rule to read, by path; of one object ``only``.

    Objects' files, scans, backgrounds and captures, and experiments on sensors.
    """
    tops = [path for path in Path(raw).glob("*") if path.name in {only or path.name, *NOT_OBJECTS}]
    below = [path for top in tops for path in top.glob("*")]
    files = [path for path in below if path.is_file() or path.name in NOT_SENSORS]
    folders = [path for place in below for path in place.glob("*") if path.is_dir()]
    return {str(path): stamp(path) for path in sorted([*files, *folders])}
