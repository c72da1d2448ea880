"""Hertz fit of one capture."""

import json
from dataclasses import asdict

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.tables import read_table
from palpate.estimate.hertz import check_contact, fit_free_contact, fit_study, hertz_range
from palpate.surface.distance import ClosestPoints
from palpate.surface.track import load_tracked
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP


def main(snakemake):
    """Write hertz.json."""
    radius = snakemake.params.probe["indenter"]["radius_m"]
    tracked = load_tracked(snakemake.input.tracked)
    tips = read_table(snakemake.input.pose)[TIP].to_numpy(float)
    force = np.linalg.norm(read_table(snakemake.input.force)[FORCE], axis=1)
    depth = radius - ClosestPoints(tracked.rest_m, tracked.faces).signed_distance(tips)
    chosen = hertz_range(force, **snakemake.params.options)
    check_contact(depth, chosen.start)
    used = slice(chosen.start, chosen.stop + 1)
    result = {
        "radius_m": radius,
        "range": {"first_frame": chosen.start, "last_frame": chosen.stop},
        "samples": {"depth_m": depth.tolist(), "force_n": force.tolist()},
        "study": asdict(fit_study(depth[used], force[used], radius)),
        "free_contact": asdict(fit_free_contact(depth[: used.stop], force[: used.stop], radius)),
    }
    with whole_file(snakemake.output.fit) as part:
        part.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


run(main, snakemake)
