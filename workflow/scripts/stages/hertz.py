"""Hertz fit of one capture."""

from palpate.capture.files import write_json
from palpate.estimate.direct.options import ProbeUncertainty, Rig
from palpate.estimate.hertz.models import estimate_hertz
from palpate.estimate.hertz.options import Hertz
from palpate.json_fields import numbers_of, read_fields
from palpate.workflow.estimate_inputs import read_indentation
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write hertz.json."""
    inputs, params = snakemake.input, snakemake.params
    options, known = Hertz.read(params.options), ProbeUncertainty.of(params.probe)
    radius_m = params.probe["indenter"]["radius_m"]
    indentation, samples = read_indentation(inputs, radius_m=radius_m, options=options)
    std_s = float(numbers_of(inputs.clock, read_fields(inputs.clock), "std_s", ()))
    with naming(inputs.force):
        rig = known.rig(Rig.read(params.rig))
        found = estimate_hertz(indentation, options, rig=rig, clock_std_s=std_s)
    write_json(snakemake.output.fit, samples | found)


run(main, snakemake)
