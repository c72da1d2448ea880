"""Table 4.2 and Figures 4.14 to 4.19."""

from pathlib import Path

import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import style, tables, workspace, workspace_figures


def main(snakemake):
    """Write the table and draw the figures."""
    source, params, output = snakemake.input, snakemake.params, snakemake.output
    found = {
        name: pd.read_csv(path) for name, path in zip(params.names, source.tables, strict=True)
    }
    used = {
        name: params.sensors[name]["marker"]["reprojection_threshold_px"] for name in params.names
    }
    table = workspace.table_4_2(found, used, pd.read_csv(source.published))
    table["provenance"] = table["sensor"].map(params.provenance)
    title = "Table 4.2: mean standard deviation of the resting tip over the workspace (cm)"
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(table, csv, md, title=title)
    with style.journal():
        for png, svg in zip(output.png, output.svg, strict=True):
            draw = getattr(workspace_figures, Path(png).stem)
            figure = draw(found, set(params.provenance.values()))
            with whole_file(png) as whole_png, whole_file(svg) as whole_svg:
                style.save(figure, whole_png, whole_svg)


run(main, snakemake)
