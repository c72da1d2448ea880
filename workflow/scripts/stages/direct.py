"""Direct estimate of E and nu from one or more captures of an object with one sensor."""

import pandas as pd
from palpate.capture.files import whole_file, write_json
from palpate.estimate.direct.estimate import estimate_direct
from palpate.estimate.direct.options import Fit, ProbeUncertainty
from palpate.estimate.direct.result import save_fitted
from palpate.vision.calibrated_probe import calibrated_probe, placed_sensor
from palpate.workflow.estimate_inputs import read_indentations
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write direct.json."""
    params, options = snakemake.params, Fit.read(snakemake.params.options)
    probe = calibrated_probe(params.probe, snakemake.input.calibrations)
    sensor = placed_sensor(params.sensor, snakemake.input.calibrations)
    indentations = read_indentations(snakemake.input, probe, sensor, options)
    known = ProbeUncertainty.of(probe, sensor.get("base"))
    radius = probe["indenter"]["radius_m"]
    with naming(", ".join(snakemake.input.paths), "frames"):
        found = estimate_direct(indentations, options, known, radius_m=radius)
    write_json(snakemake.output.estimate, {"captures": list(params.captures)} | found.to_dict())
    if "budget" in snakemake.output.keys():
        with whole_file(snakemake.output.budget) as part:
            pd.DataFrame(found.budget.rows()).to_csv(part, index=False)
    if "fitted" in snakemake.output.keys():
        fitted = dict(zip(params.captures, found.captures(), strict=True))
        save_fitted(snakemake.output.fitted, fitted)


run(main, snakemake)
