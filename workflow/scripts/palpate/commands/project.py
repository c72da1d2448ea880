"""The project of a folder: its configuration, kept solids, calibrations, results."""

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.capture.devices import CONFIG, device_folder, read_device
from palpate.config.probe import PARTS, asked, require_met
from palpate.config.sensor import HAND_EYE
from palpate.yaml_files import load_yaml

# What a file may say besides, for the workflow alone, which checks it before its first job.
FOR_RUNS = {"study", "methods", "error_options", "solid", "minimise", "simulation"}
FOR_RUNS |= {f"tracking.{name}" for name in ("estimate_from", "compared", "trackers", "objects")}
FOR_RUNS |= {"experiments.cd_case_size_m"}


@dataclass(frozen=True)
class Project:
    """Folder with a configuration, and what a run of the workflow keeps in it."""

    folder: Path | None  # None where there is none above the captures or here
    content: Mapping[str, Any]  # of config.yaml

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
            return Config.read(_of_the_tool(load_yaml(own) if own else self.content))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    def results(self, *parts: str) -> Path | None:
        """Where the workflow keeps a result."""
        return self._place("results", "results", *parts)

    def solid(self, name: str) -> Path | None:
        """Kept solid mesh of an object."""
        kept = self._place("meshes", "config/meshes", f"{name}.vtu")
        places = (kept, self.results(name, "solid.vtu"))
        return next((path for path in places if path and path.is_file()), None)

    def calibrations(self, sensor: str) -> list[Path]:
        """What a run has found of the probe by a sensor, and of the base of poses."""
        names = [*(part.name for part in PARTS), HAND_EYE]
        paths = [self.results("sensors", sensor, f"{name}.json") for name in names]
        return [path for path in paths if path and path.is_file()]

    def optics(self, sensor: str) -> Path | None:
        """Calibration of a sensor that a run has made."""
        path = self.results("sensors", sensor, "calibration.json")
        return path if path and path.is_file() else None

    def _place(self, key: str, default: str, *parts: str) -> Path | None:
        """A place by ``paths`` of the configuration."""
        folder = self.content.get("paths", {}).get(key, default)
        return self.folder and self.folder.joinpath(folder, *parts)

    def read(self, path: str) -> Mapping:
        """What a file of the project says; nothing where there is none."""
        there = self.folder is not None and (self.folder / path).is_file()
        return (load_yaml(self.folder / path) or {}) if there else {}


def device_files(options: argparse.Namespace, near: Path, probe: str) -> dict[str, Path]:
    """Files of the sensor that options name and of a probe, by kind, the nearest to a folder."""
    named = {"sensors": options.sensor, "probes": probe}
    folders = {kind: device_folder(kind, getattr(options, kind), near) for kind in named}
    return {kind: folders[kind] / f"{name}.yaml" for kind, name in named.items()}


def stated_devices(files: Mapping[str, Path]) -> tuple[Mapping, Mapping]:
    """Sensor and probe of their files; a `ValueError` with all that is wrong with them."""
    (sensor, wrong), (probe, more) = (read_device(path, kind) for kind, path in files.items())
    if wrong or more:
        raise ValueError("\n".join([*wrong, *more]))
    return sensor, probe


def calibrated_devices(files: Mapping[str, Path], project: Project) -> tuple[Mapping, Mapping]:
    """Sensor and probe, with what a run's calibrations found where they ask for it."""
    from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
    from palpate.vision.camera import sensor_with_optics

    (sensor, probe), optics = stated_devices(files), None
    name = sensor["sensor"]
    if sensor.get("optics") == "calibration" and (optics := project.optics(name)) is None:
        made = f"results/sensors/{name}/calibration.json of a run (or stated)"
        raise ValueError(f"{files['sensors']}: optics: expected {made}, found none")
    calibrations = project.calibrations(name)
    probe = calibrated_probe(probe, calibrations)
    require_met(asked(probe), probe)
    return placed_sensor(sensor_with_optics(sensor, optics and str(optics)), calibrations), probe


def _of_the_tool(content: Any, place: str = "") -> Any:
    """What a configuration says of the tool."""
    if not isinstance(content, Mapping):
        return content
    kept = ((key, one) for key, one in content.items() if f"{place}{key}" not in FOR_RUNS)
    return {key: _of_the_tool(one, f"{place}{key}.") for key, one in kept}
