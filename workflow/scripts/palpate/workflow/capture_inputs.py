"""What stages read of an object and of its captures, checked as they read it."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import columns_of, read_table
from palpate.solid.support import Support, read_support
from palpate.surface.template import Template, read_template
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from palpate.workflow.job import naming
from palpate.yaml_files import load_yaml


def read_declared(path: str) -> tuple[dict, Support]:
    """Read object.yaml, and what the object stands on."""
    spec = load_yaml(path)
    with naming(path):
        return spec, read_support(spec["support"])


def declared_point(spec: Mapping, name: str) -> Mapping:
    """What object.yaml says of a point.

    Raises
    ------
    ValueError
        If it says nothing of it.
    """
    if name not in spec["points"]:
        names = ", ".join(sorted(spec["points"]))
        raise ValueError(f"points: expected one of {names}, found {name}")
    return spec["points"][name]


def read_object(inputs: Any) -> tuple[dict, Support, Template]:
    """Read the files ``object`` and ``template``: also what the object stands on."""
    spec, support = read_declared(inputs.object)
    return spec, support, read_template(inputs.template, unit=spec["template"]["unit"])


def read_probe(
    pose: str, force: str, *columns: str, frames: int | None = None
) -> tuple[pd.DataFrame, NDArray, NDArray]:
    """Read a capture's poses, their tips and other columns (f, 3 + k), and the forces (f, 3).

    Raises
    ------
    ValueError
        If a column is missing or not of finite numbers, or the files have other numbers of frames.
    """
    poses = read_table(pose)
    with naming(force):
        forces = columns_of(read_table(force), FORCE, frames=frames)
    with naming(pose):
        return poses, columns_of(poses, [*TIP, *columns], frames=len(forces)), forces
