"""Every printed number of the study beside ours."""

import numpy as np
from comparison_inputs import tables_of, traces_of
from job import run
from palpate.capture.files import whole_file
from palpate.solid.mesh import read_solid
from palpate.study import comparison, printed, tables
from study_inputs import read_all, read_one

TITLE = "Every printed number of the study beside ours"
NOTES = (
    "published is the study's printed value, ratio is ours over it. What the study prints"
    " without naming a sensor or point stands beside each of ours. true is what the virtual lab"
    " was given; instantaneous moduli.",
    "Ours of selected_threshold comes of the rule of selection: deviations fall with the threshold"
    " and flatten without a clear minimum, and the smallest within 2 % of the least is taken.",
)


def main(snakemake):
    """Write the comparison as CSV and Markdown."""
    inputs, params, output = snakemake.input, snakemake.params, snakemake.output
    linear = read_one(inputs.linear)
    ours = comparison.our_numbers(
        tables_of(inputs.tables),
        traces=traces_of(inputs, params.captures, params.error),
        nodes=list(zip(params.solids, map(nodes_of, inputs.solids), strict=True)),
        residual_n=linear["estimates"][0]["residual_n"] if linear else None,
    )
    table = comparison.comparison(
        printed.numbers(tables_of(inputs.published)), ours, truths(inputs, params)
    )
    with whole_file(output.csv) as csv, whole_file(output.md) as md:
        tables.write(table, csv, md, title=TITLE, more_notes=NOTES)


def nodes_of(path):
    """Nodes of a solid."""
    return len(read_solid(path).nodes_m)


def truths(inputs, params):
    """What the lab was given, by object or sensor and by quantity."""
    found = {}
    for name, material in zip(params.materials, read_all(inputs.materials), strict=True):
        for quantity in printed.MODULI_UNITS:
            if quantity in material:
                found[name, quantity.removesuffix("_pa")] = material[quantity]
    simulated = read_one(inputs.simulated)
    if simulated:
        found[printed.SIMULATED, "lame_lambda"] = simulated["lambda_pa"]
        found[printed.SIMULATED, "lame_mu"] = simulated["mu_pa"]
    return found | optics(params.calibrated)


def optics(sensors):
    """True optics of the sensors that the lab calibrates."""
    found = {}
    for name, sensor in sensors.items():
        for stream, block in (("color", "color"), ("infrared", "depth")):
            for quantity in printed.OPTICS:
                found[name, f"{stream}_{quantity[:2]}"] = sensor[block][quantity]
        matrix = np.array(sensor["depth"]["color_from_depth"], dtype=float)
        for i, j in np.ndindex(3, 4):
            found[name, f"r{i + 1}{j + 1}" if j < 3 else f"t{i + 1}"] = float(matrix[i, j])
    return found


run(main, snakemake)
