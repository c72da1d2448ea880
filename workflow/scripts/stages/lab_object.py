"""Describe an object of the lab as people describe theirs, and note its true material apart."""

from palpate.capture.files import whole_file, write_json
from palpate.workflow.job import run
from virtual_lab.describe import misdeclared, object_text


def main(snakemake):
    """Write object.yaml and the truth."""
    name = snakemake.wildcards.object
    spec = misdeclared(snakemake.params.spec, snakemake.params.errors, name=name)
    with whole_file(snakemake.output.object) as part:
        part.write_text(object_text(spec, name=name), encoding="utf-8")
    material = dict(spec["material"])
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    truth = material | {"reduced_modulus_pa": E / (1 - nu**2), "modulus": "instantaneous"}
    write_json(snakemake.output.material, dict(sorted(truth.items())))


run(main, snakemake)
