"""A tip as tip.json holds it, and what is said of it."""

from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.config.probe import covariance_fault
from palpate.json_fields import numbers_of, read_fields
from palpate.units import MILLIMETRES
from palpate.vision.pivot import Pivot
from palpate.vision.probe import marker_from_tip

# Standard deviation up to which a tip is told: what a Kinect's 200 frames tell.
TOLD_M = 0.0002
# As far as a hand leans a probe whose board is still seen, root mean square.
FARTHEST_DEG = 25.0
# A film of more is none that a hand makes.
MOST_FRAMES = 1000
COVARIANCE = "tip_covariance_m2"
# A tip that is farther from what the probe's file says is another probe's.
FARTHEST_M = 0.02
# What is left where a probe's file asked for a calibration that was taken.
CALIBRATED = "calibrated"


def pivot_fields(found: Pivot, names: Sequence[str], probe: str | None) -> dict:
    """What tip.json says, of a probe by its name where that is known."""
    return {
        "probe": probe,
        "tip_m": found.tip_m.tolist(),
        COVARIANCE: found.covariance.tolist(),
        "tip_std_m": found.std_m.tolist(),
        "optics_covariance_m2": None
        if (part := found.optics_covariance) is None
        else part.tolist(),
        "pivot_m": found.pivot_m.tolist(),
        "rms_m": found.rms_m,
        "turn_deg": found.turn_deg.tolist(),
        "poses": len(names),
        "left_out_m": left_out(found, names),
        "verdict": verdict(found),
    }


def left_out(found: Pivot, names: Sequence[str]) -> dict[str, float]:
    """Frames that were left out, and how far off they are [m]."""
    return {
        names[k]: float(np.linalg.norm(found.residuals_m[k])) for k in np.flatnonzero(~found.kept)
    }


def verdict(found: Pivot) -> str:
    """Whether the tip is told, and else what would tell it."""
    std_m, optics_m = _most(found.covariance), optics_std_m(found)
    told = f"told, to {std_m * MILLIMETRES:.2g} mm in the direction that is told least"
    if std_m <= TOLD_M:
        return f"tip: {told}"
    if optics_m >= TOLD_M:
        only = f"{optics_m * MILLIMETRES:.2g} mm are the optics' alone"
        return f"tip: not {told}: {only}: calibrate the camera"
    # A deviation goes down with the turn, and with the square root of the number of frames.
    noise_m = np.sqrt(std_m**2 - optics_m**2)
    factor = noise_m / np.sqrt(TOLD_M**2 - optics_m**2)
    lean = min(factor, max(1, FARTHEST_DEG / found.turn_deg[0]))
    frames = ceil(found.kept.sum() * (factor / lean) ** 2)
    if frames > MOST_FRAMES:
        return f"tip: not {told}: {MOST_FRAMES} frames would not tell it: bring the board nearer"
    todo = f"lean it {lean:.1f} times as far" if lean > 1.05 else "lean it as far"
    return f"tip: not {told}: {todo}, in {frames} frames"


def optics_std_m(found: Pivot) -> float:
    """What the camera's optics are in the deviation that is told least; 0 if nothing is known."""
    part = found.optics_covariance
    return 0.0 if part is None else _most(part)


def _most(covariance: NDArray) -> float:
    """Standard deviation in the direction that is told least."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))


def force_from_tip(marker_from_force: ArrayLike, tip_m: NDArray) -> NDArray:
    """The probe's transform with a calibrated tip, shape (4, 4).

    The axes stay those of the force sensor: a ball has no axis of its own, and the probe presses
    along the sensor's z, as its drawing has it. The line from the sensor's origin to the tip would
    put a tip's error across into the direction.

    Parameters
    ----------
    marker_from_force : (4, 4) array
    tip_m : (3,) array
        In the board's frame.
    """
    fixed = np.array(marker_from_force, dtype=float)
    transform = np.eye(4)
    transform[:3, 3] = fixed[:3, :3].T @ (tip_m - fixed[:3, 3])
    return transform


def probe_with_tip(spec: Mapping, tip_path: str | Path) -> Mapping:
    """The probe's file, with tip and covariance of a sensor's own calibration.

    Parameters
    ----------
    spec : mapping
        The probe's file; its tip's axes hold.
    tip_path : str or path
        tip.json.

    Raises
    ------
    ValueError
        If the calibrated tip is that of another probe, or is not told to `TOLD_M`.
    """
    fields = read_fields(tip_path)
    tip_m = numbers_of(tip_path, fields, "tip_m", (3,))
    covariance = numbers_of(tip_path, fields, COVARIANCE, (3, 3))
    if fault := covariance_fault(covariance):
        raise ValueError(f"{tip_path}: {COVARIANCE}: {fault}")
    if (std_m := _most(covariance)) > TOLD_M:
        raise ValueError(
            f"{tip_path}: tip_m: expected a tip that is told to {TOLD_M * MILLIMETRES:g} mm, found"
            f" one to {std_m * MILLIMETRES:.2g} mm (its verdict says what would tell it)"
        )
    away_m = float(np.linalg.norm(tip_m - marker_from_tip(spec)[:3, 3]))
    if away_m > FARTHEST_M:
        raise ValueError(
            f"{tip_path}: tip_m: expected within {FARTHEST_M * MILLIMETRES:g} mm of where the"
            f" probe's file has it (force_from_tip), found it {away_m * MILLIMETRES:.0f} mm away"
        )
    return with_tip_at(spec, tip_m) | {COVARIANCE: covariance.tolist(), "tip": CALIBRATED}


def with_tip_at(spec: Mapping, tip_m: NDArray) -> dict:
    """The probe's file with its tip at (3,) in the board's frame [m]; the tip's axes stay."""
    transform = np.array(spec["force_from_tip"], dtype=float)
    transform[:3, 3] = force_from_tip(spec["marker_from_force"], tip_m)[:3, 3]
    return dict(spec) | {"force_from_tip": transform.tolist()}
