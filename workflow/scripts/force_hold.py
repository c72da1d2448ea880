"""Force while a sensor films a press and a hold (Figure 4.6)."""

import numpy as np
import pandas as pd
from job import run
from palpate.capture.tables import read_frames, read_table, write_table
from palpate.vision.force import FORCE, frame_wrenches


def main(snakemake):
    """Write the size of the force at every frame."""
    params = snakemake.params
    record = read_table(f"{snakemake.input.loading}/force.csv")
    time_s = read_frames(snakemake.input.loading)["time_s"].to_numpy()
    # The size of a force needs no pose.
    still = np.tile(np.eye(4), (len(time_s), 1, 1))
    wrench = frame_wrenches(record, time_s, still, params.probe, **params.options)
    force_n = np.linalg.norm(wrench[FORCE], axis=1)
    write_table(snakemake.output.forces, pd.DataFrame({"time_s": time_s, "force_n": force_n}))


run(main, snakemake)
