"""Track the simulated block's own surface through its steps."""

import logging

from job import naming, run
from palpate.capture.files import whole_file
from palpate.surface.data_points import TrackerOptions
from palpate.surface.simulation import read_steps, track_steps
from palpate.surface.tracked import save_tracked


def main(snakemake):
    """Write tracked.npz of the simulation."""
    options = snakemake.params.options
    steps, tracker = read_steps(snakemake.input.steps), TrackerOptions(**options["tracking"])
    with naming(snakemake.input.steps):
        tracked = track_steps(steps, tracker, cuts=options["cuts"], corners=options["corners"])
    for k, residual in enumerate(tracked.residual_m):
        logging.info("frame %d: residual %.4f mm", k, residual * 1e3)
    with whole_file(snakemake.output.tracked) as part:
        save_tracked(part, tracked)


run(main, snakemake)
