"""Hertz fit of one capture."""

from palpate.capture.files import write_json
from palpate.estimate.hertz.estimate import estimate_hertz
from palpate.estimate.hertz.options import Hertz
from palpate.workflow.estimate_inputs import read_indentation
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
    write_json(snakemake.output.fit, told | found)


run(main, snakemake)
