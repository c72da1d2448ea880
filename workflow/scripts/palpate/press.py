"""A capture as far as its forces: seconds of work, and all that speaks against it till then."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from numpy.typing import NDArray

from palpate.capture.capture import Capture
from palpate.capture.tables import as_written
from palpate.config.probe import asked, require_met
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clock import ClockOffset
from palpate.vision.clouds import table_of
from palpate.vision.follow import followed
from palpate.vision.indentation import capture_path
from palpate.vision.probe import check_steepness
from palpate.workflow.options import Config


@dataclass(frozen=True)
class Press:
    """What probe and force do in a capture.

    Attributes
    ----------
    sensor : mapping
        With the optics of its calibration.
    plane : (4,) array
        The table, camera frame.
    poses, wrenches, path : DataFrame
        probe_pose.csv, force.csv and path.csv of the results.
    clock : ClockOffset
        Force clock minus camera clock.
    """

    sensor: Mapping
    plane: NDArray
    poses: pd.DataFrame
    wrenches: pd.DataFrame
    path: pd.DataFrame
    clock: ClockOffset


def press_of(capture: Capture, config: Config, optics: str | Path | None = None) -> Press:
    """Follow the probe through a capture, and give the force at each frame.

    Parameters
    ----------
    capture : Capture
    config : Config
        The options of all steps.
    optics : path, optional
        calibration.json of the sensor, where its own file's optics don't hold.

    Raises
    ------
    ValueError
        Naming what was expected and found, where board, depth and force don't fit each other.
    """
    if capture.sensor.get("optics") == "calibration" and optics is None:
        raise ValueError(
            f"optics: expected the calibration.json that {capture.folder.parent.name}'s file asks"
            " for, found none"
        )
    require_met(asked(capture.probe), capture.probe)
    sensor, probe = sensor_with_optics(capture.sensor, optics and str(optics)), capture.probe
    # Numbers are those of the files between the workflow's stages: one answer either way.
    poses = as_written(followed(capture.folder, sensor, probe, config.probe_pose))
    plane = table_of(capture.background, sensor, config.support_plane, seed=config.seed)
    declared = capture.declared
    point, base = declared["points"][capture.point], sensor.get("base")
    check_steepness(poses, probe, plane[:3], point, declared["support"], base)
    given = capture.folder, capture.force, poses, sensor, probe, config.force
    wrenches, path, clock = capture_path(*given, up=plane[:3])
    return Press(sensor, plane, poses, as_written(wrenches), as_written(path), clock)
