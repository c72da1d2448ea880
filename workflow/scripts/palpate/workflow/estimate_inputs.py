"""What the estimates read of captures."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from palpate.capture.tables import columns_of, read_table
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.problem import ProbeRecord, direct_indentation
from palpate.estimate.hertz.indentation import Indentation, indentation_of
from palpate.estimate.hertz.options import Hertz
from palpate.solid.indentation_table import load_indentation
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import load_alignment
from palpate.vision.probe import ALONG_STD, MARKER, QUATERNION
from palpate.workflow.capture_inputs import read_probe
from palpate.workflow.job import naming
from palpate.workflow.object_inputs import read_object


def read_indentation(inputs: Any, *, radius_m: float, options: Hertz) -> tuple[Indentation, dict]:
    """Read what a Hertz fit needs of ``inputs``."""
    poses, tips, forces = read_probe(inputs.pose, inputs.force)
    with naming(inputs.force):
        time = columns_of(read_table(inputs.force), ["time_s"])[:, 0]
    _, support, template = read_object(inputs)
    alignment = load_alignment(inputs.alignment)
    with (
        naming(inputs.force, "force"),
        naming(inputs.pose, "depth"),
        naming(inputs.template, "direction"),
    ):
        return indentation_of(
            template,
            support,
            alignment,
            tips,
            forces,
            time,
            radius_m=radius_m,
            tip_std_m=float(np.nanmedian(poses[ALONG_STD])),
            options=options,
        )


def read_indentations(inputs, probe, sensor, options):
    """Read what a direct estimate needs; files of one kind go in the captures' order."""
    _, support, template = read_object(inputs)
    surface = SmoothSurface(template.vertices_m, template.faces)
    tables = {path: load_indentation(path) for path in dict.fromkeys(inputs.tables)}
    indentations = []
    for k, path in enumerate(inputs.tables):
        record = _probe_record(inputs.paths[k], inputs.clocks[k], probe, sensor)
        with (
            naming(inputs.paths[k], "force", "frames", "depth", "tip"),
            naming(inputs.motions[k], "samples"),
            naming(inputs.alignments[k], "contact"),
            naming(path, "table"),
        ):
            motion, alignment = load_motion(inputs.motions[k]), load_alignment(inputs.alignments[k])
            known = record, motion, alignment, surface, tables[path], support, options
            indentations.append(direct_indentation(*known))
    return indentations


def _probe_record(path, clock, probe, sensor):
    """Tip, force and clock of a capture."""
    table, clocks = read_table(path), json.loads(Path(clock).read_text(encoding="utf-8"))
    with naming(path):
        columns_of(table, [*QUATERNION, *MARKER])
        return ProbeRecord.of(table, probe, sensor, clock_offset_s=clocks["offset_s"])
