"""Load the simulated foam block of Section 3.3.2 step by step."""

import json

import numpy as np
from palpate.capture.files import whole_file
from palpate.workflow.job import run
from virtual_lab.simulated_block import load_block


def main(snakemake):
    """Write the steps, and the moduli apart."""
    spec = snakemake.params.spec
    steps = load_block(
        snakemake.input.mesh,
        lambda_pa=spec["lambda_pa"],
        mu_pa=spec["mu_pa"],
        traction_pa=spec["traction_pa"],
        steps=spec["steps"],
    )
    with whole_file(snakemake.output.steps) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **steps)
    truth = {key: spec[key] for key in ("lambda_pa", "mu_pa", "traction_pa")}
    with whole_file(snakemake.output.truth) as part:
        part.write_text(json.dumps(truth, indent=2, sort_keys=True) + "\n", encoding="utf-8")


run(main, snakemake)
