"""Hertz fit of one capture."""

from palpate.capture.files import write_json
from palpate.estimate.direct.options import Rig
from palpate.estimate.direct.rig import ProbeUncertainty
from palpate.estimate.hertz.estimate import estimate_hertz
from palpate.estimate.hertz.options import Hertz
from palpate.json_fields import numbers_of, read_fields
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
    known = ProbeUncertainty.of(snakemake.params.probe)
    clock = snakemake.input.clock
    clock_std_s = float(numbers_of(clock, read_fields(clock), "std_s", ()))
    with naming(snakemake.input.force):
        found = estimate_hertz(
            indentation,
            record,
            options,
            rig=known.rig(Rig.read(snakemake.params.rig)),
            clock_std_s=clock_std_s,
        )
    write_json(snakemake.output.fit, told | found)


run(main, snakemake)
