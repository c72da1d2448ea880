"""Write the template of an object of the lab that needs no scans."""

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.lab.describe import BLOCK_EDGE_M, box_template


def main(snakemake):
    """Write a triangulated box."""
    template = box_template(np.array(snakemake.params.shape["size_m"]), BLOCK_EDGE_M)
    with whole_file(snakemake.output.template) as part:
        template.export(part, file_type="ply")


run(main, snakemake)
