"""Way and force of a filmed press on something rigid, as the board's poses tell them."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.vision.bending import CONTACT_N
from palpate.vision.force import FORCE, zeroed
from palpate.vision.indentation import frame_wrenches
from palpate.vision.options import Force
from palpate.vision.probe import marker_from_tip, marker_transforms


def way_and_force(
    table: pd.DataFrame,
    record: pd.DataFrame,
    probe: Mapping,
    options: Force,
    *,
    contact_n: float = CONTACT_N,
) -> tuple[NDArray, NDArray]:
    """How far the tip went [m] and what it pressed with [N], along the pressed frames' mean axis.

    The force's zero is the unloaded sensor's before the press; what hangs on the sensor weighs the
    same in all frames of a handle that does not turn.

    Parameters
    ----------
    table : DataFrame
        Of `palpate.vision.follow.board_followed`.
    record : DataFrame
        force.csv of the film.
    probe : mapping
        With ``marker_from_force`` and ``force_from_tip``, and ``gauge`` where the record is volts.
    options : Force
    contact_n : float
        Frames above it are pressed.

    Returns
    -------
    (n,) array, (n,) array

    Raises
    ------
    ValueError
        If no frame is pressed, or as `zeroed` and `frame_wrenches` do.
    """
    frames_s = table["time_s"].to_numpy(float)
    known = zeroed(record, probe, options.bias_window_s, frames_s[0])
    poses = marker_transforms(table)
    wrenches = frame_wrenches(known, table, probe, options)
    force, tips = wrenches[FORCE].to_numpy(), poses @ marker_from_tip(probe)
    along_n = np.einsum("ni,ni->n", force, tips[:, :3, 2])
    pressed = along_n > contact_n
    if not pressed.any():
        raise ValueError(
            f"force: expected a press above {contact_n:g} N along the probe's axis, found"
            f" {along_n.max():.2g} N (sign of the channels, marker_from_force?)"
        )
    axis = tips[pressed, :3, 2].mean(axis=0)
    axis /= np.linalg.norm(axis)
    return tips[:, :3, 3] @ axis, force @ axis
