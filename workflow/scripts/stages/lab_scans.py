"""Scan an object of the lab from all sides with the laser scanner."""

import numpy as np
from palpate.capture.files import whole_folder
from palpate.workflow.job import run
from virtual_lab.scanner import scan_views, write_scans
from virtual_lab.seeds import seed_of
from virtual_lab.shapes import shape_of


def main(snakemake):
    """Write raw/<object>/scans/."""
    laser = snakemake.params.laser
    vertices, faces = shape_of({"shape": snakemake.params.shape}).surface()
    views = [(turn, tip) for tip in laser["elevations_deg"] for turn in laser["turns_deg"]]
    rng = np.random.default_rng(seed_of(laser, snakemake.wildcards.object, "scans"))
    scans = scan_views(
        vertices,
        faces,
        views,
        distance_m=laser["distance_m"],
        pose_error=(laser["turn_error_deg"], laser["shift_error_m"]),
        rng=rng,
    )
    with whole_folder(snakemake.output.scans) as folder:
        write_scans(folder, scans)


run(main, snakemake)
