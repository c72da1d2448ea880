"""Depth noise of a sensor on the flat boards that it filmed."""

from pathlib import Path

import numpy as np
import pandas as pd
from frames import all_streams
from job import run
from palpate.capture.tables import read_table, write_table
from palpate.study.fidelity import plane_residual
from palpate.vision.clouds import scene_points
from palpate.vision.depth import kinect_depth


def main(snakemake):
    """Write one row a distance: depth, residual and step of the depth."""
    folder, sensor = Path(snakemake.input.planes), snakemake.params.sensor
    rows = []
    for plane in read_table(folder / "planes.csv")["plane"]:
        frames = list(all_streams(folder / f"{int(plane):02d}", sensor))
        found = [plane_residual(scene_points(images, sensor)) for images in frames]
        depth, residual = np.mean(found, axis=0)
        row = {"depth_m": depth, "residual_m": residual, "step_m": depth_step(frames[0], sensor)}
        rows.append(row)
    write_table(snakemake.output.noise, pd.DataFrame(rows))


def depth_step(images, sensor):
    """Median difference of neighbouring depths that occur [m]; NaN where they are not stepped."""
    if "depth" not in images:
        return np.nan
    depth = kinect_depth(images["depth"], sensor["depth"])
    levels, counts = np.unique(depth[np.isfinite(depth)], return_counts=True)
    common = levels[counts > 0.02 * counts.max()]
    return float(np.median(np.diff(common)))


run(main, snakemake)
