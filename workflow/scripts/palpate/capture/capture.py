"""One capture as it was dropped, with what was written about it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from palpate.capture.check import checked_object
from palpate.capture.devices import device_folder, read_device
from palpate.capture.discover import sensor_folder
from palpate.capture.images import Stream
from palpate.capture.tables import read_force, read_frames
from palpate.yaml_files import load_yaml, mismatch


@dataclass(frozen=True)
class Capture:
    """One indentation: a folder ``raw/<object>/<sensor>/<capture>``.

    Attributes
    ----------
    folder : Path
    declared : mapping
        object.yaml.
    sensor, probe : mapping
        The sensor's and the probe's file.

    Examples
    --------
    >>> from palpate import open_capture
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> capture.images()[0].shape, capture.declared["probe"]
    ((480, 640, 3), 'nano25_sphere')
    """

    folder: Path
    declared: Mapping
    sensor: Mapping
    probe: Mapping

    @property
    def point(self) -> str:
        """Name of the pressed point."""
        return self.folder.name.partition("-")[0]

    @property
    def declared_point(self) -> Mapping:
        """What object.yaml says of that point."""
        return self.declared["points"][self.point]

    @property
    def background(self) -> Path:
        """Folder of the empty scene; of clouds without one, of the first capture."""
        place = sensor_folder(self.folder.parent)
        return place.scene if "cloud" in self.sensor else place.background

    @property
    def template(self) -> Path:
        """File of the object's undeformed surface.

        Raises
        ------
        ValueError
            If it is to be made of scans, which the workflow does.
        """
        if "file" not in self.declared["template"]:
            found = "scans (the workflow makes one of them: results/<object>/template.ply)"
            place = f"{self.folder.parents[1]}/object.yaml: template.file"
            raise mismatch(place, "a mesh", found)
        return self.folder.parents[1] / self.declared["template"]["file"]

    @property
    def radius_m(self) -> float:
        """Of the sphere that presses [m]."""
        return float(self.probe["indenter"]["radius_m"])

    @property
    def frames(self) -> pd.DataFrame:
        """frames.csv: a row for each frame."""
        return read_frames(self.folder)

    @property
    def force(self) -> pd.DataFrame:
        """force.csv: gauge volts or a wrench over time."""
        return read_force(self.folder)

    def images(self, stream: str | None = None) -> Stream:
        """Images or clouds of a stream, read when asked for; the reference camera's by default."""
        return Stream(self.folder, self.sensor, stream)


def open_capture(
    folder: str | Path, *, sensors: str | Path | None = None, probes: str | Path | None = None
) -> Capture:
    """Open a capture's folder with the files that its object, sensor and probe have.

    Parameters
    ----------
    folder : path
        ``raw/<object>/<sensor>/<capture>``.
    sensors, probes : path, optional
        Folders with a file for each; else ``config/sensors`` and ``config/probes`` of the nearest
        folder above the capture, or above the current one, that has them.

    Raises
    ------
    ValueError
        A line for each thing that is wrong with object.yaml, the files of sensor and probe, the
        capture's own and its background's.

    Examples
    --------
    >>> capture = open_capture(
    ...     "tests/sample/raw/foam_block/kinect/08", sensors="tests/sample/sensors"
    ... )
    >>> capture.point, len(capture.frames), capture.radius_m
    ('08', 10, 0.00622)
    """
    folder = Path(os.path.abspath(folder))
    declared = load_yaml(folder.parents[1] / "object.yaml")
    probe = declared.get("probe") if isinstance(declared, Mapping) else None
    found, problems = {}, []
    for kind, given, name in (("sensors", sensors, folder.parent.name), ("probes", probes, probe)):
        place = device_folder(kind, given and Path(given), folder)
        spec, lines = read_device(place / f"{name}.yaml", kind)
        found[kind] = {name: None if lines else spec}
        problems += lines
    problems += checked_object(folder.parents[1], **found, only=folder).problems
    if problems:
        raise ValueError("\n".join(problems))
    return Capture(folder, declared, *(spec for one in found.values() for spec in one.values()))
