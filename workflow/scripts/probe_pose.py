"""Follow the probe through a capture."""

from follow import followed
from frames import sensor_of
from job import run
from palpate.capture.tables import write_table


def main(snakemake):
    """Write the probe's pose at every frame."""
    params = snakemake.params
    table = followed(snakemake.input.capture, sensor_of(snakemake), params.probe, params.options)
    write_table(snakemake.output.pose, table)


run(main, snakemake)
