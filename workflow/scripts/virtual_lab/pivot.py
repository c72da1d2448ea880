"""The probe's handle, turned about its tip that rests in a dimple."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from virtual_lab.motion import ProbeMotion, upright
from virtual_lab.probe import make_probe
from virtual_lab.record import FACING, film
from virtual_lab.rig import Rig

# The handle goes round so often while it leans farther and farther, and about itself meanwhile.
ROUNDS, SPINS = 3.0, 2.5
LEAST_LEAN = 0.1


def record_pivot(
    folder: Path, rig: Rig, common: Mapping, options: Mapping, probe_spec: Mapping, *, seed: list
) -> dict[str, NDArray]:
    """Film the handle that leans to all sides about its resting tip.

    Parameters
    ----------
    folder : Path
        Empty folder to fill with a film in the capture format, without force.
    rig : Rig
    common, probe_spec : mapping
        lab.yaml without its objects, the probe's file.
    options : mapping
        ``pivot`` block of lab.yaml.
    seed : list of int

    Returns
    -------
    dict
        ``tip_m`` (3,), the tip in the frame of the board as it is on the probe.
    """
    probe_spec, rng = rig.device.probe(probe_spec), np.random.default_rng([*seed, 1])
    count = options["frames"]
    share = np.linspace(0, 1, count)
    way = 2 * np.pi * (ROUNDS * share + rng.uniform())
    lean = np.deg2rad(options["lean_deg"]) * np.sqrt(LEAST_LEAN + (1 - LEAST_LEAN) * share)
    tremor = np.deg2rad(options["tremor_deg"]) * rng.standard_normal((count, 2))
    turns = upright(FACING, lean[:, None] * np.column_stack([np.cos(way), np.sin(way)]) + tremor)
    spin = np.deg2rad(options["spin_deg"]) * np.sin(2 * np.pi * SPINS * share)
    turns = turns @ Rotation.from_euler("z", spin[:, None]).as_matrix()
    tip = np.tile([0.0, 0.0, probe_spec["indenter"]["radius_m"]], (count, 1))
    path = ProbeMotion(np.arange(count) / options["frame_rate_hz"], np.zeros(count), tip, turns)
    film(folder, rig, None, path, make_probe(probe_spec), seed=[*seed, 2])
    marker_from_tip = probe_spec["marker_from_force"] @ np.array(probe_spec["force_from_tip"])
    return {"tip_m": marker_from_tip[:3, 3]}
