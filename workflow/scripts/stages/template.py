"""Make an object's template from its laser scans (Section 4.1.1)."""

import logging

from palpate.capture.files import whole_file
from palpate.surface.scans import read_scans, template_from_scans
from palpate.units import METRES
from palpate.workflow.job import run
from palpate.yaml_files import load_yaml


def main(snakemake):
    """Write template.ply, in the scans' unit."""
    spec = load_yaml(snakemake.input.object)["template"]
    views = read_scans(snakemake.input.scans, unit=spec["unit"])
    mesh = template_from_scans(views, vertices=int(spec["vertices"]), spacing_m=spec["spacing_m"])
    logging.info("%d views, %d vertices, %.3g m3", len(views), len(mesh.vertices), mesh.volume)
    mesh.apply_scale(1 / METRES[spec["unit"]])
    with whole_file(snakemake.output.template) as part:
        mesh.export(part, file_type="ply")


run(main, snakemake)
