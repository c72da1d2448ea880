"""Follow the probe through a capture."""

from frames import Stream
from job import run
from palpate.capture.tables import read_frames, write_table
from palpate.vision.camera import camera_from_spec
from palpate.vision.probe import track_probe


def main(snakemake):
    """Write the probe's pose at every frame."""
    sensor, options = snakemake.params.sensor, snakemake.params.options
    table = track_probe(
        Stream(snakemake.input.capture, sensor),
        read_frames(snakemake.input.capture)["time_s"].to_numpy(),
        camera_from_spec(sensor["color"]),
        snakemake.params.probe,
        threshold_px=sensor["marker"]["reprojection_threshold_px"],
        largest_gap_frames=options["largest_gap_frames"],
        filter_options=options["filter"],
    )
    write_table(snakemake.output.pose, table)


run(main, snakemake)
