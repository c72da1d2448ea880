"""Find the table in the depth of the empty scene."""

from palpate.capture.files import write_json
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import table_of
from palpate.vision.options import SupportPlane
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the table's plane, camera frame."""
    sensor = sensor_with_optics(snakemake.params.sensor, snakemake.input.get("optics"))
    options = SupportPlane.read(snakemake.params.options)
    with naming(snakemake.input.background, "background"):
        plane = table_of(snakemake.input.background, sensor, options, seed=snakemake.params.seed)
    result = {"normal": plane[:3].tolist(), "offset_m": float(plane[3])}
    write_json(snakemake.output.plane, result)


run(main, snakemake)
