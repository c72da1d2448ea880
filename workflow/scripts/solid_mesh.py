"""Take an object's kept solid mesh, or make one from its template."""

import logging

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.solid.mesh import read_solid, tetrahedralise, write_solid
from palpate.surface.distance import ClosestPoints
from palpate.surface.template import read_template

# A kept mesh of another object is farther from the template than its own ever is.
LARGEST_GAP = 0.02


def main(snakemake):
    """Write the solid mesh, object frame."""
    spec = load_yaml(snakemake.input.object)["template"]
    template = read_template(snakemake.input.template, unit=spec["unit"])
    if snakemake.input.kept:
        solid = read_solid(snakemake.input.kept)
        check_kept(solid, template, snakemake.input.kept)
    else:
        solid = tetrahedralise(template.vertices_m, template.faces, vertices=spec["vertices"])
        logging.info("made anew; keep it to make results repeatable")
    logging.info("%d nodes, %d tetrahedra", len(solid.nodes_m), len(solid.tetrahedra))
    with whole_file(snakemake.output.solid) as part:
        write_solid(part, solid)


def check_kept(solid, template, path):
    """Hold a kept mesh to its template."""
    surface = solid.nodes_m[solid.surface_nodes()]
    gap = ClosestPoints(template.vertices_m, template.faces).distance(surface).max()
    allowed = LARGEST_GAP * np.ptp(template.vertices_m, axis=0).max()
    if gap > allowed:
        raise ValueError(
            f"{path}: nodes: expected within {allowed:.2g} m of the template, found {gap:.2g} m"
        )


run(main, snakemake)
