"""What is wrong with an object's captures: every table and image is opened."""

import logging
from pathlib import Path

from palpate.capture.check import check_object
from palpate.capture.files import whole_file
from palpate.run.job import run

log = logging.getLogger(__name__)


def main(snakemake):
    """Write a line for each problem; an empty file when nothing is wrong."""
    params = snakemake.params
    folder = Path(snakemake.input.object).parent
    lines = check_object(folder, params.sensors, params.probes)
    log.info("\n".join(lines) or f"{folder}: nothing wrong")
    with whole_file(snakemake.output.lines) as part:
        part.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")


run(main, snakemake)
