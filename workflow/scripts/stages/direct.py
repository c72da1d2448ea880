"""Direct estimate of E and nu from one or more captures of an object with one sensor."""

import json

import pandas as pd
from palpate.capture.files import whole_file
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Fit
from palpate.run.direct_inputs import read_indentations
from palpate.run.job import naming, run


def main(snakemake):
    """Write direct.json."""
    params, options = snakemake.params, Fit.read(snakemake.params.options)
    indentations = read_indentations(snakemake.input, params.probe, options)
    radius = params.probe["indenter"]["radius_m"]
    with naming(", ".join(snakemake.input.poses), "frames"):
        found = estimate_direct(indentations, options, radius_m=radius)
    with whole_file(snakemake.output.estimate) as part:
        text = json.dumps({"captures": list(params.captures)} | found.to_dict(), indent=2)
        part.write_text(text + "\n", encoding="utf-8")
    if "budget" in snakemake.output.keys():
        with whole_file(snakemake.output.budget) as part:
            pd.DataFrame(found.budget.rows()).to_csv(part, index=False)


run(main, snakemake)
