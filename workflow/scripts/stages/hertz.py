"""Hertz fit of one capture."""

import json

from palpate.capture.files import whole_file
from palpate.estimate.hertz.estimate import estimate_hertz
from palpate.estimate.hertz.options import Hertz
from palpate.workflow.hertz_inputs import read_indentation
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write hertz.json."""
    options = Hertz.read(snakemake.params.options)
    indentation, record, told = read_indentation(
        snakemake.input,
        radius_m=snakemake.params.probe["indenter"]["radius_m"],
        options=options,
    )
    with naming(snakemake.input.force):
        found = estimate_hertz(indentation, record, options)
    with whole_file(snakemake.output.fit) as part:
        part.write_text(json.dumps(told | found, indent=2) + "\n", encoding="utf-8")


run(main, snakemake)
