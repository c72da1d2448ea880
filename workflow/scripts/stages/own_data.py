"""What was fitted of one object, as tables, and what describes them."""

from pathlib import Path

import pandas as pd
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.result import load_fitted
from palpate.json_fields import read_all
from palpate.report import data_tables, outputs
from palpate.report.data_package import data_package
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write the tables and datapackage.json."""
    inputs, output, params = snakemake.input, snakemake.output, snakemake.params
    estimated = zip(params.groups, map(load_fitted, inputs.fitted), strict=True)
    fitted = {group["sensor"]: by_capture for group, by_capture in estimated}
    keys = [(capture["sensor"], capture["capture"]) for capture in params.captures]
    fits = {(sensor, capture): fitted[sensor][capture] for sensor, capture in keys}
    motions = [load_motion(path) for path in inputs.motions]
    curves = params.curves, read_all(inputs.curves)
    with naming(", ".join(inputs.motions), "samples"):
        made = {
            "force": data_tables.force_table(fits, *curves),
            "motion": data_tables.motion_table(fits, motions),
            "samples": data_tables.sample_table(fits, motions),
            "profile": data_tables.profile_table(fits),
        }
    tables = {output[name]: table for name, table in made.items()}
    for path in (inputs.summary, *inputs.budgets, *inputs.recorded):
        tables[path] = pd.read_csv(path)
    name, folder = snakemake.wildcards.object, Path(output.package).parent
    written = {key: outputs.exact(table) for key, table in made.items()}
    outputs.write(written | {"package": data_package(name, folder, tables)}, output)


run(main, snakemake)
