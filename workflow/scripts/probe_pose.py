"""Follow the probe through a capture."""

from follow import followed
from frames import sensor_of
from job import naming, run
from palpate.capture.tables import write_table


def main(snakemake):
    """Write the probe's pose at every frame."""
    params = snakemake.params
    capture = snakemake.input.capture
    with naming(capture, "marker", "frame"):
        table = followed(capture, sensor_of(snakemake), params.probe, params.options)
    write_table(snakemake.output.pose, table)


run(main, snakemake)
