"""A capture as far as its forces: seconds of work, and all that speaks against it till then."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.capture import Capture
from palpate.capture.tables import as_written, columns_of
from palpate.config.probe import asked, require_met
from palpate.solid.support import Support, read_support
from palpate.surface.template import Template, read_template
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clock import ClockOffset
from palpate.vision.clouds import table_of
from palpate.vision.follow import followed
from palpate.vision.force import FORCE
from palpate.vision.indentation import capture_path
from palpate.vision.probe import ALONG_STD, TIP, check_steepness
from palpate.workflow.options import Config


@dataclass(frozen=True, repr=False)
class Press:
    """What probe and force do in a capture.

    Attributes
    ----------
    capture : Capture
    config : Config
        That it was worked out with.
    sensor : mapping
        With the optics of its calibration.
    plane : (4,) array
        The table, camera frame.
    poses, wrenches, path : DataFrame
        probe_pose.csv, force.csv and path.csv of the results.
    clock : ClockOffset
        Force clock minus camera clock.
    """

    capture: Capture
    config: Config
    sensor: Mapping
    plane: NDArray
    poses: pd.DataFrame
    wrenches: pd.DataFrame
    path: pd.DataFrame
    clock: ClockOffset

    @cached_property
    def template(self) -> Template:
        """Undeformed, object frame; a `ValueError` where the file is none, or to be made."""
        unit = self.capture.declared["template"]["unit"]
        return read_template(self.capture.template, unit=unit)

    @cached_property
    def support(self) -> Support:
        """What the object stands on."""
        return read_support(self.capture.declared["support"])

    @property
    def tips_m(self) -> NDArray:
        """Centre of the sphere in each frame, camera frame, (f, 3) [m]."""
        return columns_of(self.poses, TIP)

    @property
    def forces_n(self) -> NDArray:
        """Force on the object in each frame, camera frame, (f, 3) [N]."""
        return columns_of(self.wrenches, FORCE)

    @property
    def sizes_n(self) -> NDArray:
        """Magnitude of that force, (f,) [N]."""
        return np.linalg.norm(self.forces_n, axis=1)

    @property
    def tip_std_m(self) -> float:
        """Deviation of a tip along the probe's axis [m]."""
        return float(np.nanmedian(self.poses[ALONG_STD]))


def press_of(capture: Capture, config: Config, optics: str | Path | None = None) -> Press:
    """Follow the probe through a capture, and give the force at each frame.

    ``optics`` is the calibration.json of the sensor, where its own file's optics don't hold.

    Raises
    ------
    ValueError
        Naming what was expected and found, where target, depth and force don't fit each other.
    """
    if capture.sensor.get("optics") == "calibration" and optics is None:
        expected = f"the calibration.json that {capture.folder.parent.name}'s file asks for"
        raise ValueError(f"optics: expected {expected}, found none")
    require_met(asked(capture.probe), capture.probe)
    sensor, probe = sensor_with_optics(capture.sensor, optics and str(optics)), capture.probe
    # Numbers are those of the files between the workflow's stages: one answer either way.
    poses = as_written(followed(capture.folder, sensor, probe, config.probe_pose))
    plane = table_of(capture.background, sensor, config.support_plane, seed=config.seed)
    stands = capture.declared["support"], sensor.get("base")
    check_steepness(poses, probe, plane[:3], capture.declared_point, *stands)
    given = capture.folder, capture.force, poses, sensor, probe, config.force
    wrenches, path, clock = capture_path(*given, up=plane[:3])
    tables = poses, as_written(wrenches), as_written(path)
    return Press(capture, config, sensor, plane, *tables, clock)
