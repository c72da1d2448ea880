"""What a verb finds by itself of a folder: captures, configuration, kept solids, tables, optics."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.capture.calibrations import PARTS
from palpate.capture.capture import Capture, open_capture
from palpate.capture.check import check_twice
from palpate.capture.devices import CONFIG
from palpate.capture.discover import sensor_folders
from palpate.capture.tables import FRAMES
from palpate.yaml_files import load_yaml

OBJECT = "object.yaml"


def captures_of(folders: Sequence[Path]) -> list[Path]:
    """Folders of captures in given ones: themselves, or those of a sensor or an object.

    Raises
    ------
    ValueError
        If a folder holds none.
    """
    found: list[Path] = []
    for folder in folders:
        path = Path(os.path.abspath(folder))
        above = sensor_folders(path.parent) if (path.parent / OBJECT).is_file() else ()
        inside = [place for place in above if place.folder == path]
        inside = list(sensor_folders(path)) if (path / OBJECT).is_file() else inside
        here = [path] if (path / FRAMES).is_file() else []
        here = here or [capture for place in inside for capture in place.captures]
        if not here:
            expected = "expected a capture, or an object's or a sensor's folder with captures"
            there = "none in it" if path.is_dir() else "no such folder"
            raise ValueError(f"{folder}: folder: {expected}, found {there}")
        found += [Path(os.path.relpath(one)) for one in here]
    return list(dict.fromkeys(found))


def opened(folders: Sequence[Path], devices: Mapping[str, Path | None]) -> list[Capture]:
    """Open captures, none of them twice.

    Raises
    ------
    ValueError
        With a line for each thing that is wrong.
    """
    captures, wrong = [], check_twice(folders)
    for folder in folders:
        try:
            captures.append(open_capture(folder, **devices))
        except ValueError as error:
            wrong += str(error).splitlines()
    if wrong:
        raise ValueError("\n".join(dict.fromkeys(wrong)))
    return captures


@dataclass(frozen=True)
class Project:
    """Folder with a configuration, and what a run of the workflow keeps in it.

    Attributes
    ----------
    folder : Path or None
        None where there is none above the captures or here.
    content : mapping
        config.yaml.
    """

    folder: Path | None
    content: Mapping[str, Any]

    @classmethod
    def near(cls, folder: Path) -> "Project":
        """The nearest one above a folder, or above the current one."""
        for start in map(Path, (os.path.abspath(folder), os.getcwd())):
            for place in (start, *start.parents):
                if (place / CONFIG).is_file():
                    return cls(place, load_yaml(place / CONFIG) or {})
        return cls(None, {})

    def config(self, own: Path | None) -> Any:
        """Options of all steps: of a file, else the project's, else the defaults."""
        from palpate.workflow.options import Config

        path = own or (self.folder and self.folder / CONFIG)
        try:
            return Config.read(load_yaml(own) if own else self.content)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    @property
    def config_file(self) -> Path:
        """Of a project that has a folder."""
        return self.folder / CONFIG

    def results(self, *parts: str) -> Path | None:
        """Where the workflow keeps a result."""
        if self.folder is None:
            return None
        folder = self.content.get("paths", {}).get("results", "results")
        return self.folder.joinpath(folder, *parts)

    def solid(self, name: str) -> Path | None:
        """Kept solid mesh of an object."""
        if self.folder is None:
            return None
        meshes = self.content.get("paths", {}).get("meshes", "config/meshes")
        places = (self.folder / meshes / f"{name}.vtu", self.results(name, "solid.vtu"))
        return next((path for path in places if path.is_file()), None)

    def calibrations(self, sensor: str) -> list[Path]:
        """What a run has found of the probe by a sensor."""
        paths = [self.results("sensors", sensor, f"{part.name}.json") for part in PARTS]
        return [path for path in paths if path is not None and path.is_file()]

    def missing_films(self, folder: Path, probe: Mapping | None, place: Path) -> list[str]:
        """What a run would miss of the films that an object's probe asks for, as lines.

        Parameters
        ----------
        folder : Path
            ``raw/<object>``.
        probe : mapping or None
            The probe's file, which stands in ``place``.
        """
        from palpate.workflow.configuration_checks import missing_films
        from palpate.workflow.places import CONFIGURATION, LAB

        if probe is None:
            return []
        # Without a configuration nobody says which probe was filmed.
        filmed = probe["probe"] if self.folder is None else ""
        for path in CONFIGURATION:
            filmed = (self._content(path).get("experiments") or {}).get("probe", filmed)
        sensors = [one.folder.name for one in sensor_folders(folder)]
        used = {(folder.name, sensor): probe for sensor in sensors}
        paths = {"raw": folder.parent, "probes": place}
        return missing_films(used, self._content(LAB), paths, filmed)

    def _content(self, path: str) -> Mapping:
        """What a file of the project says; nothing where there is none."""
        there = self.folder is not None and (self.folder / path).is_file()
        return (load_yaml(self.folder / path) or {}) if there else {}

    def optics(self, sensor: str) -> Path | None:
        """Calibration of a sensor that a run has made."""
        path = self.results("sensors", sensor, "calibration.json")
        return path if path is not None and path.is_file() else None
