"""What the estimates on the simulated block owe to the tracker."""

import logging

import pandas as pd
from job import naming, run
from palpate.capture.files import whole_file
from palpate.estimate.simulation import pose_simulation
from palpate.solid.support import read_support
from palpate.study import simulation_tables, tables
from palpate.surface.data_points import TrackerOptions
from palpate.surface.simulation import read_steps, track_steps
from study_inputs import read_one

SHOWN = ("cuts", "corners", "data_term", "s_sm", "w_sm_stop")


def main(snakemake):
    """Track with each variant of the options, and estimate from what it gives."""
    options, search = snakemake.params.options, snakemake.params.search
    steps = read_steps(snakemake.input.steps)
    base = {"cuts": options["cuts"], "corners": options["corners"]} | options["tracking"]
    variants = {"chosen": {}} | options["variants"]
    rows = []
    for name, changes in variants.items():
        logging.info("%s: %s", name, changes)
        with naming(snakemake.input.steps):
            rows.append({"variant": name} | row_of(steps, base | changes, options, search))
    truth = read_one(snakemake.input.truth)
    table = pd.DataFrame(rows)
    for key in ("lambda_pa", "mu_pa"):
        table[f"true_lame_{key}"] = truth[key] if truth else None
    table = tables.rounded(table.assign(provenance="simulated"))
    title = "Simulated block: errors of the tracker (m) and what follows from them (Pa)"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(table, csv, md, title=title)


def row_of(steps, variant, options, search):
    """Tracking errors of one variant, and the moduli that both methods find."""
    tracking = {key: value for key, value in variant.items() if key not in ("cuts", "corners")}
    tracked = track_steps(
        steps, TrackerOptions(**tracking), cuts=variant["cuts"], corners=variant["corners"]
    )
    errors = simulation_tables.tracking_errors(steps, tracked)
    problem = pose_simulation(steps, read_support(options["support"]), tracked=tracked)
    found = simulation_tables.every_method(
        problem, steps.triangle, linear=options["linear"], search=search
    )
    moduli = {
        f"{method}_{name}": getattr(found[key], name)
        for method, key in (("linear", "linear_method"), ("minimise", "minimise_displacement"))
        for name in simulation_tables.MODULI
    }
    shown = {key: variant[key] for key in SHOWN}
    return shown | {key: round(value, 7) for key, value in errors.items()} | moduli


run(main, snakemake)
