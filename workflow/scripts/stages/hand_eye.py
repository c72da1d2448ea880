"""Where a sensor's camera is in the base frame of a robot or a tracker."""

from pathlib import Path

from palpate.capture.experiments import read_marker
from palpate.capture.files import write_json
from palpate.vision.camera import sensor_with_optics
from palpate.vision.hand_eye import recorded_hand_eye
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write hand_eye.json."""
    folder, spec = Path(snakemake.input.recording), snakemake.params.sensor
    sensor = sensor_with_optics(spec, snakemake.input.get("optics"))
    with naming(folder):
        found = recorded_hand_eye(folder, sensor, read_marker(folder))
    write_json(snakemake.output.hand_eye, found.fields(spec["sensor"]))


run(main, snakemake)
