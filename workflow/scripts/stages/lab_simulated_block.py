"""Load the simulated foam block of Section 3.3.2 step by step."""

import numpy as np
from palpate.capture.files import whole_file, write_json
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
    write_json(snakemake.output.truth, truth)


run(main, snakemake)
