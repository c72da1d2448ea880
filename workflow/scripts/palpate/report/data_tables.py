"""What was fitted, as tables that other programmes read: force, motion, samples, profile."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.result import CaptureFit

# Width of the rings of a profile [m].
RING_M = 0.002


def force_table(
    fits: Mapping[tuple[str, str], CaptureFit],
    curves: Sequence[Mapping] = (),
    files: Sequence[Mapping] = (),
) -> pd.DataFrame:
    """Force against depth with the fit: of captures in the frames compared, then of curves.

    The fit of a capture gives the depth at a force, that of a curve without a camera the force at a
    depth. Captures are by sensor and name; ``files`` are the curve.json of described curves.
    """
    found = {
        key: {
            "frame": one.frames,
            "time_s": one.time_s[one.frames],
            "force_n": one.force_n,
            "depth_m": one.depth_m,
            "fitted_depth_m": one.fitted_depth_m,
            "depth_residual_m": one.depth_m - one.fitted_depth_m,
            "depth_expected_std_m": one.depth_expected_std_m,
        }
        for key, one in fits.items()
    }
    for curve, told in zip(curves, files, strict=True):
        samples = {name: np.array(values) for name, values in told["samples"].items()}
        force, fitted = samples["force_n"], samples["fitted_n"]
        found[curve["sensor"], curve["capture"]] = {
            "frame": np.arange(len(force)),
            "force_n": force,
            "depth_m": samples["depth_m"],
            "fitted_force_n": fitted,
            "force_residual_n": force - fitted,
        }
    return _joined(found)


def sample_table(
    fits: Mapping[tuple[str, str], CaptureFit], motions: Sequence[SurfaceMotion]
) -> pd.DataFrame:
    """Places of the surface whose motion was seen, and their distance from the contact.

    Of captures by sensor and name, and the motion.npz of each.
    """
    found = {}
    for (key, one), motion in zip(fits.items(), motions, strict=True):
        away = np.linalg.norm(motion.cell_m - one.contact_m, axis=1)
        found[key] = {
            "sample": np.arange(len(away)),
            **_components("place", motion.cell_m, "_m"),
            **_components("normal", motion.normal, ""),
            "distance_m": away,
            "rest_std_m": motion.rest_std_m,
        }
    return _joined(found)


def motion_table(
    fits: Mapping[tuple[str, str], CaptureFit], motions: Sequence[SurfaceMotion]
) -> pd.DataFrame:
    """Motion of each sample in each frame in which it was seen, with the model's where compared.

    Of captures by sensor and name, and the motion.npz of each.
    """
    found = {}
    for (key, one), motion in zip(fits.items(), motions, strict=True):
        fitted, expected = np.full((2, *motion.moved_m.shape), np.nan)
        compared = np.ix_(one.frames, _places(one, motion))
        fitted[compared], expected[compared] = one.fitted_moved_m, one.moved_expected_std_m
        frame, place = np.nonzero(np.isfinite(motion.moved_m))
        moved, model = motion.moved_m[frame, place], fitted[frame, place]
        found[key] = {
            "frame": frame,
            "time_s": one.time_s[frame],
            "sample": place,
            "moved_m": moved,
            "moved_std_m": motion.std_m[frame, place],
            "fitted_moved_m": model,
            "moved_residual_m": moved - model,
            "moved_expected_std_m": expected[frame, place],
        }
    return _joined(found)


def profile_table(fits: Mapping[tuple[str, str], CaptureFit]) -> pd.DataFrame:
    """Motion along the normals over distance from the contact, in each capture's deepest frame.

    Means over rings of `RING_M`, of the samples that were compared.
    """
    found = {}
    for key, one in fits.items():
        row = int(np.argmax(one.depth_m))
        moved, fitted = one.moved_m[row], one.fitted_moved_m[row]
        samples = {
            "distance_m": one.distance_m,
            "moved_m": moved,
            "fitted_moved_m": fitted,
            "moved_residual_m": moved - fitted,
        }
        samples = pd.DataFrame(samples)[np.isfinite(moved)]
        rings = samples.groupby(samples["distance_m"] // RING_M)
        found[key] = {
            "frame": one.frames[row],
            "depth_m": one.depth_m[row],
            "samples": rings.size(),
            **rings.mean(),
            "moved_residual_std_m": rings["moved_residual_m"].std(),
        }
    return _joined(found)


def _places(one: CaptureFit, motion: SurfaceMotion) -> NDArray:
    """Where the samples that were compared stand among all, (c,)."""
    known = {tuple(cell): place for place, cell in enumerate(motion.cell_m.tolist())}
    try:
        return np.array([known[tuple(cell)] for cell in one.cell_m.tolist()], dtype=int)
    except KeyError:
        raise ValueError("samples: expected those of the motion, found others") from None


def _components(name: str, vectors: NDArray, unit: str) -> dict[str, NDArray]:
    return {f"{name}_{axis}{unit}": vectors[:, k] for k, axis in enumerate("xyz")}


def _joined(found: Mapping[tuple[str, str], Mapping]) -> pd.DataFrame:
    """One table of all captures, the first columns their sensor and name."""
    parts = {key: pd.DataFrame(columns) for key, columns in found.items()}
    whole = pd.concat(parts, names=["sensor", "capture"])
    return whole.reset_index(["sensor", "capture"]).reset_index(drop=True)
