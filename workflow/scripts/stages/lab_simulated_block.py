"""Load the simulated foam block of Section 3.3.2 step by step."""

from palpate.capture.files import write_json
from palpate.npz import write_npz
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
    write_npz(snakemake.output.steps, steps)
    truth = {key: spec[key] for key in ("lambda_pa", "mu_pa", "traction_pa")}
    write_json(snakemake.output.truth, truth)


run(main, snakemake)
