"""Load the simulated foam block of Section 3.3.2 step by step."""

from palpate.capture.files import write_json
from palpate.npz import write_npz
from palpate.workflow.job import run
from virtual_lab.block import load_block


def main(snakemake):
    """Write the steps, and the moduli apart."""
    spec = snakemake.params.spec
    truth = {key: spec[key] for key in ("lambda_pa", "mu_pa", "traction_pa")}
    steps = load_block(snakemake.input.mesh, **truth, steps=spec["steps"])
    write_npz(snakemake.output.steps, steps)
    write_json(snakemake.output.truth, truth)


run(main, snakemake)
