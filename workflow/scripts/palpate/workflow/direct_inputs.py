"""What the direct estimate reads of each capture."""

import json
from pathlib import Path

import numpy as np

from palpate.capture.tables import columns_of, read_table
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.probe_uncertainty import ProbeUncertainty
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.solid.indentation import load_indentation
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import load_alignment
from palpate.surface.template import read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, MARKER, QUATERNION, TIP, marker_transforms
from palpate.workflow.declared import read_declared
from palpate.workflow.job import naming


def read_indentations(inputs, probe, options):
    """Read each capture; files of one kind go in the captures' order."""
    spec, support = read_declared(inputs.object)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    surface = SmoothSurface(template.vertices_m, template.faces)
    tables = {path: load_indentation(path) for path in dict.fromkeys(inputs.tables)}
    indentations = []
    for k, path in enumerate(inputs.tables):
        files = inputs.poses[k], inputs.forces[k], inputs.clocks[k]
        probe_record = read_probe_record(*files, probe)
        with (
            naming(inputs.forces[k], "force", "frames"),
            naming(inputs.poses[k], "depth", "tip"),
            naming(inputs.motions[k], "samples"),
            naming(inputs.alignments[k], "contact"),
            naming(path, "table"),
        ):
            indentation = direct_indentation(
                probe_record,
                load_motion(inputs.motions[k]),
                load_alignment(inputs.alignments[k]),
                surface,
                tables[path],
                support,
                options,
            )
        indentations.append(indentation)
    return indentations


def read_probe_record(pose, force, clock, probe):
    """Tip, force and clock of a capture."""
    poses = read_table(pose)
    with naming(force):
        forces = columns_of(read_table(force), FORCE)
    with naming(pose):
        tips = columns_of(poses, [*TIP, *QUATERNION, *MARKER], frames=len(forces))[:, : len(TIP)]
    clocks = json.loads(Path(clock).read_text(encoding="utf-8"))
    return ProbeRecord(
        time_s=poses["time_s"].to_numpy(float),
        tips_m=tips,
        forces_n=forces,
        tip_std_m=float(np.nanmedian(poses[ALONG_STD])),
        stiffness_n_m=probe.get("stiffness_n_m", np.inf),
        clock_offset_s=float(clocks["offset_s"]),
        clock_std_s=float(clocks["prior_std_s"]),
        turns=marker_transforms(poses)[:, :3, :3],
        uncertainty=ProbeUncertainty.of(probe),
    )
