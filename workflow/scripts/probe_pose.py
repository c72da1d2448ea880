"""Follow the probe through a capture."""

import logging

from frames import Stream, sensor_of
from job import run
from palpate.capture.tables import read_frames, write_table
from palpate.vision.camera import camera_from_spec
from palpate.vision.probe import track_probe


def main(snakemake):
    """Write the probe's pose at every frame."""
    sensor, options = sensor_of(snakemake), snakemake.params.options
    frames = Stream(snakemake.input.capture, sensor, samples=True)
    table = track_probe(
        frames,
        read_frames(snakemake.input.capture)["time_s"].to_numpy(),
        camera_from_spec(sensor["color"]),
        snakemake.params.probe,
        encoding=frames.encoding,
        threshold_px=sensor["marker"]["reprojection_threshold_px"],
        refinement=options["refinement"],
        largest_gap_frames=options["largest_gap_frames"],
        filter_options=options["filter"],
    )
    found, refined = table["detected"].sum(), table["refined"].sum()
    logging.info("marker found in %d of %d frames, refined in %d", found, len(table), refined)
    write_table(snakemake.output.pose, table)


run(main, snakemake)
