"""Force and displacement while loading and holding an object (Figure 4.6)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import all_streams
from palpate.capture.tables import read_force
from palpate.report import outputs
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import scene_points
from palpate.vision.follow import followed
from palpate.vision.force import FORCE, zeroed
from palpate.vision.indentation import capture_wrenches, depth_along, force_along
from palpate.vision.options import Force, ProbePose
from palpate.vision.support_plane import fit_support_plane


def make_loading_test(inputs: Any, params: Any) -> dict:
    """Force and displacement at every frame, and the force's averaged record."""
    folder, sensor = inputs.loading, sensor_with_optics(params.sensor, inputs.optics)
    options, record = Force.read(params.options), read_force(folder)
    poses = followed(folder, sensor, params.probe, ProbePose.read(params.pose))
    wrench, clock = capture_wrenches(
        record, poses, sensor, params.probe, options, up=table_normal(folder, sensor, params)
    )
    frames = loading_frames(poses, np.linalg.norm(wrench[FORCE], axis=1), params.onset_force_n)
    frames["clock_offset_s"], frames["clock_offset_std_s"] = clock.offset_s, clock.std_s
    known = zeroed(record, params.probe, options.bias_window_s, poses["time_s"].iloc[0])
    time_s, along_n = force_along(known, params.probe)
    force = pd.DataFrame({"time_s": time_s - clock.offset_s, "force_n": along_n})
    return {"frames": outputs.exact(frames), "force": outputs.exact(force)}


def loading_frames(poses: pd.DataFrame, force_n: NDArray, onset_force_n: float) -> pd.DataFrame:
    """Force and displacement at each frame, the displacement from the first contact on.

    Raises
    ------
    ValueError
        If the force does not rise from below to above that of the first contact.
    """
    depth_m = depth_along(poses)[0]
    if force_n.max() <= onset_force_n or force_n[0] > onset_force_n:
        raise ValueError(
            f"loading: expected an indentation from below to above {onset_force_n:g} N, found"
            f" {force_n[0]:.2f} N at first and at most {force_n.max():.2f} N"
        )
    onset = int(np.argmax(force_n > onset_force_n))
    frames = pd.DataFrame({"time_s": poses["time_s"], "force_n": force_n})
    return frames.assign(displacement_m=depth_m - depth_m[onset])


def table_normal(folder: str, sensor: Mapping, params: Any) -> NDArray:
    """Upward direction, from the table in the first frame."""
    points = scene_points(next(all_streams(folder, sensor)), sensor)
    rng = np.random.default_rng(params.seed)
    return fit_support_plane(points, rng=rng, inlier_distance_m=params.inlier_distance_m)[:3]
