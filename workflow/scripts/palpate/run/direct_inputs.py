"""What the direct estimate reads of each capture."""

import json
from pathlib import Path

import numpy as np

from palpate.capture.tables import read_table
from palpate.estimate.direct.motion import load_motion
from palpate.estimate.direct.problem import Pressing, direct_press
from palpate.run.declared import read_declared
from palpate.run.job import naming
from palpate.solid.indentation import load_indentation
from palpate.solid.smooth_surface import SmoothSurface
from palpate.surface.alignment import load_alignment
from palpate.surface.checks import columns_of
from palpate.surface.template import read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP


def read_presses(inputs, options):
    """Read each capture; files of one kind go in the captures' order."""
    spec, support = read_declared(inputs.object)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    surface = SmoothSurface(template.vertices_m, template.faces)
    lookups = {path: load_indentation(path) for path in dict.fromkeys(inputs.lookups)}
    presses = []
    for k, lookup in enumerate(inputs.lookups):
        pressing = read_pressing(inputs.poses[k], inputs.forces[k], inputs.clocks[k])
        with (
            naming(inputs.forces[k], "force", "frames"),
            naming(inputs.poses[k], "depth", "tip"),
            naming(inputs.motions[k], "cells"),
        ):
            press = direct_press(
                pressing,
                load_motion(inputs.motions[k]),
                load_alignment(inputs.alignments[k]),
                surface,
                lookups[lookup],
                support,
                options,
            )
        presses.append(press)
    return presses


def read_pressing(pose, force, clock):
    """Tip, force and clock of a capture."""
    poses = read_table(pose)
    with naming(force):
        forces = columns_of(read_table(force), FORCE)
    with naming(pose):
        tips = columns_of(poses, TIP, frames=len(forces))
    clocks = json.loads(Path(clock).read_text(encoding="utf-8"))
    return Pressing(
        time_s=poses["time_s"].to_numpy(float),
        tips_m=tips,
        forces_n=forces,
        tip_std_m=float(np.nanmedian(poses[ALONG_STD])),
        clock_offset_s=float(clocks["offset_s"]),
        clock_std_s=float(clocks["prior_std_s"]),
    )
