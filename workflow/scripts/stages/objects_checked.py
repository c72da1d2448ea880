"""No object's run begins while anything is wrong with any capture."""

import logging
from pathlib import Path

from palpate.capture.files import whole_file
from palpate.run.job import run

log = logging.getLogger(__name__)


def main(snakemake):
    """Write how many objects were checked, or tell all that is wrong with them."""
    texts = [Path(path).read_text(encoding="utf-8") for path in snakemake.input.lines]
    lines = [line for text in texts for line in text.splitlines()]
    if lines:
        log.info("\n".join(lines))
        wrong = sum(bool(text) for text in texts)
        raise ValueError(
            f"{lines[0]} (the first of {len(lines)} lines on {wrong} of {len(texts)} objects;"
            f" {snakemake.log} has all)"
        )
    with whole_file(snakemake.output.summary) as part:
        part.write_text(f"{len(texts)} objects: nothing wrong\n", encoding="utf-8")


run(main, snakemake)
