"""What the Hertz fit reads of a capture."""

from typing import Any

import numpy as np

from palpate.capture.tables import columns_of, read_table
from palpate.estimate.hertz.indentation import indentation_of
from palpate.estimate.hertz.models import Indentation
from palpate.estimate.hertz.options import Hertz
from palpate.estimate.hertz.record import Record
from palpate.solid.support import read_support
from palpate.surface.alignment import load_alignment
from palpate.surface.template import read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import ALONG_STD, TIP
from palpate.workflow.job import naming
from palpate.yaml_files import load_yaml


def read_indentation(
    inputs: Any, *, radius_m: float, options: Hertz
) -> tuple[Indentation, Record | None, dict]:
    """Read the press and the same with its hold; see `indentation_of`.

    Parameters
    ----------
    inputs : object
        Files by name: ``object``, ``template``, ``alignment``, ``pose``, ``force``.
    radius_m : float
        Of the sphere.
    options : Hertz
    """
    poses = read_table(inputs.pose)
    with naming(inputs.force):
        table = read_table(inputs.force)
        forces, time = columns_of(table, FORCE), columns_of(table, ["time_s"])[:, 0]
    with naming(inputs.pose):
        tips = columns_of(poses, TIP, frames=len(forces))
    spec = load_yaml(inputs.object)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    alignment = load_alignment(inputs.alignment)
    with (
        naming(inputs.force, "force"),
        naming(inputs.pose, "depth"),
        naming(inputs.template, "direction"),
    ):
        return indentation_of(
            template,
            read_support(spec["support"]),
            alignment,
            tips,
            forces,
            time,
            radius_m=radius_m,
            tip_std_m=float(np.nanmedian(poses[ALONG_STD])),
            options=options,
        )
