"""Wrench on the object at every frame of a capture."""

import json
import logging

from palpate.capture.files import whole_file
from palpate.capture.tables import read_force, read_frames, read_table, write_table
from palpate.run.job import naming, run
from palpate.surface.checks import columns_of
from palpate.vision.force import check_direction, check_lever, frame_wrenches
from palpate.vision.options import Force
from palpate.vision.press import press_clock
from palpate.vision.probe import AXIS, TIP, marker_transforms
from palpate.vision.support_plane import read_plane


def main(snakemake):
    """Write the wrench about the tip, camera frame, and the clocks' offset."""
    source, params = snakemake.input, snakemake.params
    poses, record = read_table(source.pose), read_force(source.capture)
    with naming(source.pose):
        columns_of(poses, ["time_s", *TIP, *AXIS], frames=len(read_frames(source.capture)))
    plane = read_plane(source.plane)
    options = Force.read(params.options)
    radius_m = params.probe["indenter"]["radius_m"]
    with naming(source.capture, "force", "matching", "probe"):
        clock = press_clock(
            record,
            poses,
            params.probe,
            bias_window_s=options.bias_window_s,
            prior_std_s=options.clock_offset_std_s,
        )
        logging.info("clock offset %.4f s, deviation %.4f s", clock.offset_s, clock.std_s)
        table = frame_wrenches(
            record,
            poses["time_s"].to_numpy(),
            marker_transforms(poses),
            params.probe,
            up=plane[:3],
            clock_offset_s=clock.offset_s,
            matching=options.matching,
            bias_window_s=options.bias_window_s,
            linear_window_s=options.linear_window_s,
            largest_gap_s=options.largest_gap_s,
        )
        check_direction(table, poses[AXIS].to_numpy(float))
        check_lever(table, radius_m)
    found = {
        "offset_s": clock.offset_s,
        "std_s": clock.std_s,
        "prior_std_s": options.clock_offset_std_s,
    }
    with whole_file(snakemake.output.clock) as part:
        part.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    write_table(snakemake.output.force, table)


run(main, snakemake)
