"""Table 4.2 and Figures 4.14 to 4.19: one of them."""

import pandas as pd
from artefact_files import draw, write_table
from job import run
from palpate.study import workspace, workspace_figures

TITLE = "Table 4.2: mean standard deviation of the resting tip over the workspace (cm)"


def main(snakemake):
    """Write the table or draw the figure that the rule is named after."""
    source, params, output = snakemake.input, snakemake.params, snakemake.output
    found = {
        name: pd.read_csv(path) for name, path in zip(params.names, source.tables, strict=True)
    }
    if params.artefact == "table_4_2":
        table = workspace.table_4_2(found, thresholds(params), pd.read_csv(source.published))
        table["provenance"] = table["sensor"].map(params.provenance)
        write_table(output, table, title=TITLE)
    else:
        make = getattr(workspace_figures, params.artefact)
        draw(output, lambda: make(found, set(params.provenance.values())))


def thresholds(params):
    """Threshold of each sensor's file."""
    return {
        name: params.sensors[name]["marker"]["reprojection_threshold_px"] for name in params.names
    }


run(main, snakemake)
