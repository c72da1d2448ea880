"""Record one indentation in the lab: the capture, and its truth apart."""

import numpy as np
from job import run
from palpate.capture.files import whole_file, whole_folder
from palpate.lab.block import load_ladder
from palpate.lab.record import make_rig, record_capture, seed_of


def main(snakemake):
    """Write one capture's folder and truth.npz."""
    params, wildcards = snakemake.params, snakemake.wildcards
    rig = make_rig(params.common, params.spec, params.sensor, name=wildcards.object)
    ladder = load_ladder(snakemake.input.ladder)
    seed = seed_of(params.common, wildcards.object, wildcards.sensor, wildcards.capture)
    with whole_folder(snakemake.output.capture) as folder:
        truth = record_capture(
            folder, rig, ladder, params.common, params.spec, params.probe, seed=seed
        )
    with whole_file(snakemake.output.truth) as part, part.open("wb") as stream:
        np.savez_compressed(stream, **truth)


run(main, snakemake)
