"""The inverse problem of one capture, from the files of its results."""

from collections.abc import Mapping
from typing import Any

from palpate.capture.tables import columns_of, read_table
from palpate.solid.mesh import read_solid
from palpate.surface.tracked import Tracked
from palpate.vision.force import FORCE
from palpate.workflow.job import naming
from palpate.workflow.object_inputs import read_declared

from thesis.minimise.options import Load, Solid
from thesis.minimise.problem import Problem, pose_problem


def read_problem(
    inputs: Any,
    fit: Mapping,
    *,
    tracked: Tracked,
    probe: Mapping,
    options: Load,
    solid: Solid,
) -> Problem:
    """Read the inverse problem of the deepest frame of the Hertz fit, for a tracked surface.

    Parameters
    ----------
    inputs : object
        Files by name: ``object``, ``solid`` and ``force``.
    fit : mapping
        hertz.json of the capture.
    tracked : Tracked
    probe : mapping
        The probe's file.
    options : Load
    solid : Solid

    Raises
    ------
    ValueError
        If a file is no such thing, or contact or support are not where the solid is.
    """
    frame = fit["range"]["last_frame"]
    mesh = read_solid(inputs.solid)
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)[frame]
    with naming(inputs.object, "support", "contact"):
        return pose_problem(
            mesh,
            tracked,
            force,
            frame,
            fit["samples"]["depth_m"][frame],
            read_declared(inputs.object)[1],
            indenter_radius_m=probe["indenter"]["radius_m"],
            load=options,
            fineness=solid,
        )
