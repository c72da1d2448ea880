"""Find the table in the depth of the empty scene."""

import json

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.streams import all_streams
from palpate.run.job import naming, run
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import scene_points
from palpate.vision.options import SupportPlane
from palpate.vision.support_plane import fit_support_plane


def main(snakemake):
    """Write the table's plane, camera frame."""
    sensor = sensor_with_optics(snakemake.params.sensor, snakemake.input.get("optics"))
    options = SupportPlane.read(snakemake.params.options)
    images = next(all_streams(snakemake.input.background, sensor))
    with naming(snakemake.input.background, "background"):
        plane = fit_support_plane(
            scene_points(images, sensor),
            inlier_distance_m=options.inlier_distance_m,
            rng=np.random.default_rng(snakemake.params.seed),
        )
    result = {"normal": plane[:3].tolist(), "offset_m": float(plane[3])}
    with whole_file(snakemake.output.plane) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


run(main, snakemake)
