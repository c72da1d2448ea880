"""What an estimate says in files: direct.json, and what it makes of its captures."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.deviations import Scales
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.prior import FREE
from palpate.estimate.direct.quantities import ONE_SECOND_S, Quantities
from palpate.npz import read_arrays, write_npz

# By what of the captures is taken.
REGIONS = {"force": ("depth",), "surface": ("motion",), "both": ("depth", "motion")}
CAPTURES = "captures"
# Mean strain of a contact over its radius divided by the sphere's (D. Tabor, The hardness of
# metals, 1951).
TABOR = 0.2


@dataclass(frozen=True)
class CaptureFit:
    """What one capture shows and what the estimate makes of it, in the k frames compared.

    Attributes
    ----------
    time_s, tip_depth_m : (f,) arrays
        Of all frames of the capture [s], and how deep the tip is in the object in them, its fitted
        offset and clock allowed for [m].
    frames, force_n : (k,) arrays
        Those compared, and the force along the indentation in them [N].
    depth_m, fitted_depth_m, depth_expected_std_m : (k,) arrays
        That depth in those, as the force and the estimate have it, and the standard deviation that
        their difference is found to have [m].
    moved_m, fitted_moved_m, moved_expected_std_m : (k, c) arrays
        The same of the motion of c samples of the surface; NaN where one was not seen [m].
    cell_m : (c, 3) array
        Places of the samples on the undeformed template, object frame [m].
    contact_m : (3,) array
        Where the tip first touches it [m].
    distance_m : (c,) array
        Of the samples from there [m].
    """

    time_s: NDArray
    tip_depth_m: NDArray
    frames: NDArray
    force_n: NDArray
    depth_m: NDArray
    fitted_depth_m: NDArray
    depth_expected_std_m: NDArray
    moved_m: NDArray
    fitted_moved_m: NDArray
    moved_expected_std_m: NDArray
    cell_m: NDArray
    contact_m: NDArray
    distance_m: NDArray


FITTED = tuple(field.name for field in fields(CaptureFit))


def save_fitted(path: str | Path, fitted: Mapping[str, CaptureFit]) -> None:
    """Write what each capture shows and what the estimate makes of it, as NPZ, by capture."""
    each = fitted.items()
    arrays = {f"{capture}/{name}": getattr(one, name) for capture, one in each for name in FITTED}
    write_npz(path, {CAPTURES: np.array(list(fitted))} | arrays)


def load_fitted(path: str | Path) -> dict[str, CaptureFit]:
    """Read what `save_fitted` wrote.

    Raises
    ------
    ValueError
        If the file is none, or lacks an array.
    """
    captures = read_arrays(path, [CAPTURES])[CAPTURES].tolist()
    arrays = read_arrays(path, [f"{capture}/{name}" for capture in captures for name in FITTED])
    return {one: CaptureFit(*(arrays[f"{one}/{name}"] for name in FITTED)) for one in captures}


def described_law(best: Solution, known: Quantities) -> dict:
    """Material-law parameters of force and displacement, and what the effective modulus is of."""
    first, std, radii = best.parameters[0], best.std, known.depth_m / known.radius_m
    return {
        "law": {
            "force": {"value": first.force_law, "std": float(std[unknown.FORCE_LAW])},
            "motion": {"value": first.motion_law, "std": float(std[unknown.MOTION_LAW])},
        },
        "effective": {
            "depth_m": known.depth_m,
            "after_s": ONE_SECOND_S,
            "depth_over_radius": radii,
            "strain": float(TABOR * np.sqrt(radii)),
        },
    }


def nuisances(best: Solution, number: int) -> dict:
    """What a capture has for itself; how well the depth's zero was known beforehand.

    Of poses from elsewhere both offsets of clocks, their deviations and correlation, too.
    """
    indentation, p = best.indentations[number], best.parameters[number]
    sunk, *rocked = p.support_motion.tolist()
    found = {
        "offset_m": p.offset_m,
        "offset_std_m": indentation.zero_std_m,
        "clock_s": p.clock_s,
        "shift_m": p.shift_m,
        "place_m": p.place_m.tolist(),
        "sunk_m": sunk,
        "rocked_rad": rocked,
    }
    if indentation.camera_clock_std_s > 0:
        clock, camera = best.places[number][-unknown.OWN :][[unknown.CLOCK, unknown.CAMERA_CLOCK]]
        std, camera_std = best.std[[clock, camera]].tolist()
        found |= {
            # Of the force minus the poses, of the poses minus the camera.
            "force_clock_s": indentation.clock_expected_s - p.clock_s,
            "force_clock_std_s": std,
            "camera_clock_s": p.camera_clock_s,
            "camera_clock_std_s": camera_std,
            "camera_clock_known_std_s": indentation.camera_clock_std_s,
            "clocks_correlation": float(-best.covariance[clock, camera] / std / camera_std),
        }
    return found


def summed(indentation: DirectIndentation, scales: Scales) -> dict:
    """How a capture's residuals compare with what was stated."""
    depth_std_m = float(np.median(indentation.depth_std_m))
    motion_std_m = float(np.median(indentation.moved_std_m[indentation.seen])) * scales.motion
    return {
        "cells": int(indentation.seen.any(axis=0).sum()),
        "motion_std_m": motion_std_m,
        "motion_scale": scales.motion,
        "motion_sharing": scales.sharing,
        "depth_std_m": depth_std_m,
        "depth_scale": depth_std_m / indentation.tip_std_m,
        "largest_depth_m": float(indentation.depth_m.max()),
    }


def regions_of(best: Solution) -> dict[str, NDArray]:
    """Information on log E and nu, (2, 2) each, by what of the captures is taken.

    To first order at the estimate, all else unknown as its priors have it (Schur complement);
    without errors of rig, of table and of captures that differ. What is not determined of a
    direction has none, where a covariance would have no end.
    """
    found = {}
    for name, kinds in REGIONS.items():
        whole = best.summed(best.blocks, kinds).matrix
        cross, rest = whole[:FREE, FREE:], whole[FREE:, FREE:]
        scale = 1 / np.sqrt(np.diag(rest))
        scaled = rest * scale * scale[:, None]
        taken = (cross * scale) @ np.linalg.solve(scaled, (cross * scale).T)
        found[name] = whole[:FREE, :FREE] - taken
    return found
