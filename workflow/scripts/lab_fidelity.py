"""The lab's errors beside those of the real devices: a table and a figure."""

import numpy as np
import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import fidelity, style, tables
from palpate.study.fidelity_figure import fidelity_figure
from palpate.study.workspace import CORNERS, select_threshold
from palpate.surface.template import read_template


def main(snakemake):
    """Write lab_fidelity.csv, .md and the figure."""
    source, params, output = snakemake.input, snakemake.params, snakemake.output
    planes, workspaces, holds = (
        {name: pd.read_csv(path) for name, path in zip(names, paths, strict=True)}
        for names, paths in (
            (params.planes, source.planes),
            (params.workspace, source.workspaces),
            (params.loading, source.holds),
        )
    )
    scatters = {name: at_selected_threshold(table) for name, table in workspaces.items()}
    study = pd.read_csv(source.published)
    rows = []
    for name, table in planes.items():
        rows += fidelity.plane_rows(table, params.sensors[name])
    for name, table in scatters.items():
        rows += fidelity.scatter_rows(table, name, study)
    rows += [hold_row(name, table) for name, table in holds.items()]
    for name, template, truth in zip(params.scanned, source.templates, source.truths, strict=True):
        rows += template_rows(name, template, truth)
    table = fidelity.fidelity_table(rows)
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(table, csv, md, title="The lab's errors beside those of real devices")
    with style.journal():
        figure = fidelity_figure(params.sensors, planes, scatters, holds, study)
        with whole_file(output.png) as png, whole_file(output.svg) as svg:
            style.save(figure, png, svg)


def at_selected_threshold(table):
    """The workspace's points as the study tracks them."""
    selected = select_threshold(table)
    return table[(table["method"] == CORNERS) & (table["threshold_px"] == selected)]


def hold_row(name, forces):
    """Force lost while holding; the study prints a curve and no figure."""
    row = {"quantity": "force_drop", "sensor": name, "at": "hold", "unit": "%"}
    drop = 100 * fidelity.hold_drop(forces)
    return row | {"value": drop, "reference_value": np.nan, "source": "Figure 4.6 (curve only)"}


def template_rows(name, template_file, truth_file):
    """Distance of a template made from scans from the true surface."""
    template = read_template(template_file, unit="m")
    with np.load(truth_file, allow_pickle=False) as truth:
        true = truth["surface_rest_m"], truth["surface_faces"]
    error = fidelity.template_error(template.vertices_m, template.faces, *true)
    accuracy = float(np.mean(fidelity.VIVID_MM))
    shared = {"quantity": "template_distance", "sensor": "laser", "unit": "mm"}
    shared |= {"reference_value": accuracy, "source": "VIVID 910, mean of 0.22, 0.16, 0.10"}
    return [
        shared | {"at": f"{name}, mean", "value": error["mean_m"] * 1e3},
        shared | {"at": f"{name}, 95 %", "value": error["p95_m"] * 1e3},
    ]


run(main, snakemake)
