"""Wrench on the object at every frame of a capture."""

from job import run
from palpate.capture.tables import read_force, read_table, write_table
from palpate.vision.force import frame_wrenches
from palpate.vision.probe import marker_transforms


def main(snakemake):
    """Write the wrench about the tip, camera frame."""
    poses = read_table(snakemake.input.pose)
    table = frame_wrenches(
        read_force(snakemake.input.capture),
        poses["time_s"].to_numpy(),
        marker_transforms(poses),
        snakemake.params.probe,
        **snakemake.params.options,
    )
    write_table(snakemake.output.force, table)


run(main, snakemake)
