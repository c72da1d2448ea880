"""The probe through a film."""

import logging
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from palpate.capture.streams import Stream
from palpate.capture.tables import read_frames
from palpate.vision.agreement import require_agreement
from palpate.vision.camera import camera_from_spec
from palpate.vision.options import ProbePose
from palpate.vision.probe import track_probe


def followed(
    folder: str | Path, sensor: Mapping, probe: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Poses of the probe at every frame of a folder.

    Parameters
    ----------
    folder : path
        Folder of a capture, or of a film without force.
    sensor, probe : mapping
        Specifications.
    options : ProbePose

    Raises
    ------
    ValueError
        As `track_probe` and `require_agreement` do.
    """
    frames = Stream(folder, sensor, samples=True)
    table = track_probe(
        frames,
        read_frames(folder)["time_s"].to_numpy(),
        camera_from_spec(sensor["color"]),
        probe,
        encoding=frames.encoding,
        threshold_px=sensor["marker"]["reprojection_threshold_px"],
        refinement=options.refinement,
        largest_gap_frames=options.largest_gap_frames,
        filter_by=options.filter,
    )
    require_agreement(folder, sensor, probe["marker"], table)
    found, refined = table["detected"].sum(), table["refined"].sum()
    logging.info("marker found in %d of %d frames, refined in %d", found, len(table), refined)
    return table
