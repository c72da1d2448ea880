"""Poses of the probe, or of a target, in a folder's frames."""

import logging
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.capture.images import Stream
from palpate.capture.tables import read_frames
from palpate.vision.agreement import require_agreement
from palpate.vision.options import ProbePose
from palpate.vision.probe import marker_columns, recorded_poses, track_probe


def followed(
    folder: str | Path, sensor: Mapping, probe: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Poses of the probe at every frame of a folder.

    Parameters
    ----------
    folder : path
        Folder of a capture, or of a recording without force.
    sensor, probe : mapping
        Specifications.
    options : ProbePose

    Raises
    ------
    ValueError
        As `track_probe` and `require_agreement` do.
    """
    frames = Stream(folder, sensor, samples=True)
    time_s = read_frames(folder)["time_s"].to_numpy()
    table = track_probe(frames, time_s, sensor, probe, options)
    require_agreement(folder, sensor, probe["marker"], table)
    found, refined = table["detected"].sum(), table["refined"].sum()
    logging.info("marker found in %d of %d frames, refined in %d", found, len(table), refined)
    return table


def board_followed(
    folder: str | Path, sensor: Mapping, marker: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Poses of a target in the frames of a folder that show it.

    Parameters
    ----------
    folder : path
        Folder of a recording.
    sensor, marker : mapping
        The sensor's file, and the block of a probe's.
    options : ProbePose

    Returns
    -------
    DataFrame
        ``frame, time_s, detected`` and the target's pose, as `palpate.vision.probe.track_probe`
        has them.

    Raises
    ------
    ValueError
        If no frame shows the target, or as `require_agreement` does.
    """
    frames = Stream(folder, sensor, samples=True)
    threshold_px = sensor["marker"]["reprojection_threshold_px"]
    found = recorded_poses(frames, sensor, marker, options)
    seen = [k for k, (pose, _) in enumerate(found) if pose]
    if not seen:
        raise ValueError(
            f"{folder}: marker: expected its corners within {threshold_px:g} px, found in none of"
            f" {len(found)} frames"
        )
    transforms = np.array([found[k][0].camera_from_marker for k in seen])
    times_s = read_frames(folder)["time_s"].to_numpy()[seen]
    poses = pd.DataFrame({"frame": seen, "time_s": times_s, "detected": 1})
    poses = poses.join(marker_columns(transforms))
    require_agreement(folder, sensor, marker, poses.set_index("frame").reindex(range(len(found))))
    return poses
