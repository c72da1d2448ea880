"""Align the template with the first frame of a capture."""

import json
import logging
from pathlib import Path

import numpy as np
from job import naming, run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_table
from palpate.estimate.hertz_range import force_onset
from palpate.surface.alignment import align_capture, save_alignment
from palpate.surface.template import read_template
from palpate.vision.clouds import unpack_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP


def main(snakemake):
    """Write alignment.json."""
    spec = load_yaml(snakemake.input.object)
    point = spec["points"][snakemake.wildcards.capture.partition("-")[0]]["position_m"]
    force = np.linalg.norm(read_table(snakemake.input.force)[FORCE], axis=1)
    with naming(snakemake.input.force):
        onset = force_onset(force, onset_force_n=snakemake.params.onset_force_n)
    plane = json.loads(Path(snakemake.input.plane).read_text(encoding="utf-8"))
    with np.load(snakemake.input.cloud, allow_pickle=False) as data:
        first = unpack_clouds(data)[0]
    template = read_template(snakemake.input.template, unit=spec["template"]["unit"])
    tips = read_table(snakemake.input.pose)[TIP].to_numpy(float)
    with naming(snakemake.input.object):
        alignment = align_capture(
            template,
            (first.points_m, first.normals),
            np.array([*plane["normal"], plane["offset_m"]]),
            tips,
            onset,
            spec["support"],
            point,
            indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
            **snakemake.params.options,
        )
    logging.info("contact in frame %d", alignment.contact_frame)
    logging.info("cloud to template: %.3f mm rms", alignment.residual.rms_m * 1e3)
    with whole_file(snakemake.output.alignment) as part:
        save_alignment(part, alignment)


run(main, snakemake)
