"""What stages read of a capture."""

import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import columns_of, read_table
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from palpate.workflow.job import naming


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
