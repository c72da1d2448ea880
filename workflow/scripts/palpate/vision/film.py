"""A film of a capture: its masks, the probe's poses, its clouds."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.examine_order import wrong_order
from palpate.capture.streams import Stream, all_streams
from palpate.capture.tables import read_frames
from palpate.vision.background import BackgroundModel
from palpate.vision.camera import camera_from_spec
from palpate.vision.clouds import Cloud, object_cloud, probe_places, scene_points
from palpate.vision.foreground import Classifier
from palpate.vision.options import Background, Clouds, ProbePose
from palpate.vision.probe import track_probe
from palpate.vision.stillness import check_still

MOST_FOREGROUND = 0.8


def masks_of(frames: Sequence[NDArray], model: BackgroundModel, options: Background) -> NDArray:
    """Foreground of each frame, (f, h, w) bool.

    Parameters
    ----------
    frames : sequence of uint8 arrays
        Of the reference camera.
    model : BackgroundModel
    options : Background

    Raises
    ------
    ValueError
        If the camera moved, or the foreground of a frame can't be an object's.
    """
    classify = Classifier(
        model,
        alpha_low=options.alpha_low,
        alpha_high=options.alpha_high,
        opening_px=options.opening_px,
        closing_px=options.closing_px,
        smallest_blob_px=options.smallest_blob_px,
    )
    masks = np.stack([classify(image) for image in frames])
    for k in (0, len(masks) - 1):
        check_still(
            model.mean, frames[k], masks[k], largest_shift_px=options.largest_shift_px, frame=k
        )
    full = masks.mean(axis=(1, 2))
    if full.max() > MOST_FOREGROUND:
        raise ValueError(
            f"mask: expected background around the object, found {full.max():.0%} foreground in"
            f" frame {int(full.argmax())} (does the background show the same scene and light?)"
        )
    empty = np.flatnonzero(~masks.any(axis=(1, 2)))
    if len(empty):
        raise ValueError(f"mask: expected foreground in each frame, found none in {empty[0]}")
    return masks


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
    found, refined = table["detected"].sum(), table["refined"].sum()
    logging.info("marker found in %d of %d frames, refined in %d", found, len(table), refined)
    return table


def clouds_of(
    folder: str | Path,
    sensor: Mapping,
    probe: Mapping,
    masks: NDArray,
    poses: pd.DataFrame,
    plane: NDArray,
    options: Clouds,
    frames: Sequence[int] | None = None,
) -> list[Cloud]:
    """Clouds of the object, with normals, camera frame.

    Parameters
    ----------
    folder : path
        Of a capture.
    sensor, probe : mapping
        Specifications.
    masks : (f, h, w) bool array
    poses : DataFrame
        probe_pose.csv.
    plane : (4,) array
        The table.
    options : Clouds
    frames : sequence of int, optional
        All by default; then the order of the pictures is examined too.

    Raises
    ------
    ValueError
        If pictures of two streams are of different moments, or a frame shows no points.
    """
    camera = camera_from_spec(sensor["color"])
    if frames is None and (problem := wrong_order(folder, sensor, probe["marker"])):
        raise ValueError(problem)
    places = probe_places(poses, probe)
    chosen, written = range(len(masks)) if frames is None else frames, options.written()
    clouds = []
    for k, images in zip(chosen, all_streams(folder, sensor, chosen), strict=True):
        points = scene_points(images, sensor, masks[k])
        if not len(points):
            nearest_m, farthest_m = sensor["range_m"]
            expected = f"points {nearest_m:g} to {farthest_m:g} m away"
            raise ValueError(f"frame {k}: depth: expected {expected}, found none")
        try:
            cloud = object_cloud(
                points, masks[k], camera, plane, places[k], probe["exclusion"], **written
            )
        except ValueError as error:
            raise ValueError(f"{folder}: frame {k}: {error}") from error
        logging.info("frame %d: %d points", k, len(cloud.points_m))
        clouds.append(cloud)
    return clouds
