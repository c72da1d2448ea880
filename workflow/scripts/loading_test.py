"""Force and displacement while loading and holding an object (Figure 4.6)."""

import numpy as np
import pandas as pd
from follow import followed
from frames import all_streams, sensor_of
from job import run
from palpate.capture.tables import read_table, write_table
from palpate.vision.clouds import scene_points
from palpate.vision.force import FORCE, frame_wrenches
from palpate.vision.press import press_clock, press_depth, press_force
from palpate.vision.probe import marker_transforms
from palpate.vision.support_plane import fit_support_plane


def main(snakemake):
    """Write force and displacement at every frame, and the force's averaged record."""
    folder, params, sensor = snakemake.input.loading, snakemake.params, sensor_of(snakemake)
    options, record = dict(params.options), read_table(f"{folder}/force.csv")
    prior_std_s, bias_window_s = options.pop("clock_offset_std_s"), options["bias_window_s"]
    poses = followed(folder, sensor, params.probe, params.pose)
    clock = press_clock(
        record, poses, params.probe, bias_window_s=bias_window_s, prior_std_s=prior_std_s
    )
    wrench = frame_wrenches(
        record,
        poses["time_s"].to_numpy(),
        marker_transforms(poses),
        params.probe,
        up=table_normal(folder, sensor, params),
        clock_offset_s=clock.offset_s,
        **options,
    )
    force_n, depth_m = np.linalg.norm(wrench[FORCE], axis=1), press_depth(poses)[0]
    if force_n.max() <= params.onset_force_n or force_n[0] > params.onset_force_n:
        raise ValueError(
            f"loading: expected a press from below to above {params.onset_force_n:g} N, found"
            f" {force_n[0]:.2f} N at first and at most {force_n.max():.2f} N"
        )
    onset = int(np.argmax(force_n > params.onset_force_n))
    frames = pd.DataFrame({"time_s": poses["time_s"], "force_n": force_n})
    frames["displacement_m"] = depth_m - depth_m[onset]
    frames["clock_offset_s"], frames["clock_offset_std_s"] = clock.offset_s, clock.std_s
    write_table(snakemake.output.frames, frames)
    time_s, along_n = press_force(record, params.probe, bias_window_s=bias_window_s)
    table = pd.DataFrame({"time_s": time_s - clock.offset_s, "force_n": along_n})
    write_table(snakemake.output.force, table)


def table_normal(folder, sensor, params):
    """Upward direction, from the table in the first frame."""
    points = scene_points(next(all_streams(folder, sensor)), sensor)
    rng = np.random.default_rng(params.seed)
    return fit_support_plane(points, rng=rng, **params.plane)[:3]


run(main, snakemake)
