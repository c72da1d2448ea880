"""Scan an object of the lab from all sides with the laser scanner."""

import numpy as np
from palpate.capture.files import whole_folder
from palpate.workflow.job import run
from virtual_lab.rig_errors import seed_of
from virtual_lab.scanner import scan_views, write_scans
from virtual_lab.shapes import shape_of


def main(snakemake):
    """Write raw/<object>/scans/."""
    laser = snakemake.params.laser
    surface = shape_of({"shape": snakemake.params.shape}).surface()
    rng = np.random.default_rng(seed_of(laser, snakemake.wildcards.object, "scans"))
    with whole_folder(snakemake.output.scans) as folder:
        write_scans(folder, scan_views(*surface, laser, rng))


run(main, snakemake)
