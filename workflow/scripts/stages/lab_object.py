"""Describe an object of the lab as people describe theirs, and note its true material apart."""

from palpate.capture.files import write_json, write_text
from palpate.workflow.job import run
from virtual_lab.describe import misdeclared, object_text


def main(snakemake):
    """Write object.yaml and the truth."""
    name = snakemake.wildcards.object
    spec = misdeclared(snakemake.params.spec, snakemake.params.errors, name=name)
    write_text(snakemake.output.object, object_text(spec, name=name))
    material = dict(spec["material"])
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    truth = material | {"reduced_modulus_pa": E / (1 - nu**2), "modulus": "instantaneous"}
    write_json(snakemake.output.material, dict(sorted(truth.items())))


run(main, snakemake)
