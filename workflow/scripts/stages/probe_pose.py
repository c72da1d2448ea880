"""Follow the probe through a capture."""

from palpate.capture.tables import write_table
from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
from palpate.vision.camera import sensor_with_optics
from palpate.vision.follow import followed
from palpate.vision.options import ProbePose
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the probe's pose at every frame."""
    params, capture = snakemake.params, snakemake.input.capture
    sensor = sensor_with_optics(params.sensor, snakemake.input.get("optics"))
    made = snakemake.input.calibrations
    sensor, probe = placed_sensor(sensor, made), calibrated_probe(params.probe, made)
    with naming(capture, "marker", "frame", "base", "time_s"):
        table = followed(capture, sensor, probe, ProbePose.read(params.options))
    write_table(snakemake.output.pose, table)


run(main, snakemake)
