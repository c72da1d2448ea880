"""Write the template of an object of the lab that needs no scans."""

import numpy as np
import trimesh
from palpate.capture.files import whole_file
from palpate.workflow.job import run
from virtual_lab.describe import BLOCK_EDGE_M, box_template, bumped
from virtual_lab.shapes import shape_of

# Edges of another form's template over those of its surface in pictures.
COARSER = 2


def main(snakemake):
    """Write a triangulated box, or a coarse surface of another form."""
    template = template_of(snakemake.params.shape)
    bumped(template, snakemake.params.errors, name=snakemake.wildcards.object)
    with whole_file(snakemake.output.template) as part:
        template.export(part, file_type="ply")


def template_of(shape):
    """Closed surface of an object of lab.yaml."""
    if shape["kind"] == "block":
        return box_template(np.array(shape["size_m"]), BLOCK_EDGE_M)
    coarse = shape | {"surface_m": COARSER * shape["surface_m"]}
    return trimesh.Trimesh(*shape_of({"shape": coarse}).surface(), process=False)


run(main, snakemake)
