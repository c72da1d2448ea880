"""Wrench on the object at every frame of a capture."""

import logging

from palpate.capture.discover import declared_point
from palpate.capture.files import write_json
from palpate.capture.tables import columns_of, read_force, read_frames, read_table, write_table
from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
from palpate.vision.indentation import capture_path
from palpate.vision.options import Force
from palpate.vision.probe import AXIS, TIP, check_steepness
from palpate.vision.support_plane import read_plane
from palpate.workflow.job import naming, run
from palpate.yaml_files import load_yaml


def main(snakemake):
    """Write the wrench about the tip, camera frame, and the clocks' offset."""
    source, params = snakemake.input, snakemake.params
    options = Force.read(params.options)
    probe = calibrated_probe(params.probe, source.calibrations)
    sensor = placed_sensor(params.sensor, source.calibrations)
    poses, record = read_table(source.pose), read_force(source.capture)
    with naming(source.pose):
        columns_of(poses, ["time_s", *TIP, *AXIS], frames=len(read_frames(source.capture)))
    plane = read_plane(source.plane)
    spec = load_yaml(source.object)
    point = declared_point(spec, snakemake.wildcards.capture.partition("-")[0])
    with naming(source.capture, "force", "matching", "probe"):
        check_steepness(poses, probe, plane[:3], point, spec["support"], sensor.get("base"))
        given = source.capture, record, poses, sensor, probe, options
        table, path, clock = capture_path(*given, up=plane[:3])
        logging.info("force clock minus camera clock: %s", clock)
    write_json(snakemake.output.clock, vars(clock))
    write_table(snakemake.output.force, table)
    write_table(snakemake.output.path, path)


run(main, snakemake)
