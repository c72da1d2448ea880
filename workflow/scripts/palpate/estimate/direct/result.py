"""What direct.json says of an estimate."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from palpate.estimate.direct.blocks import Scales
from palpate.estimate.direct.indentation import DirectIndentation, Parameters
from palpate.estimate.direct.quantities import FORCE_LAW, MOTION_LAW, NAMES

if TYPE_CHECKING:
    from palpate.estimate.direct.estimate import DirectEstimate


def described(found: "DirectEstimate") -> dict:
    """Describe an estimate in what a JSON file holds."""
    best, first = found.solution, found.solution.parameters[0]
    indentations, times = best.indentations, found.options.relaxation_times_s
    moduli = {name: asdict(modulus) for name, modulus in found.moduli.items()}
    return {
        "frames": [len(indentation.frames) for indentation in indentations],
        "frames_beyond_lookup": [indentation.frames_beyond for indentation in indentations],
        **moduli,
        **described_law(found),
        "relaxation": {"times_s": list(times), "fractions": first.fractions.tolist()},
        "gain": first.gain,
        "foot": first.foot if any(one.table.slides for one in indentations) else None,
        "nuisances": [_nuisances(p) for p in best.parameters],
        "residuals": [_summed(*of) for of in zip(best.indentations, best.scales, strict=True)],
        "budget": found.budget.rows(),
        "information": _information(found),
        "converged": best.converged,
        "doubts": found.doubts,
    }


def described_law(found: "DirectEstimate") -> dict:
    """Places of force and motion among the laws, and where the equivalent modulus is told."""
    std, told, first = found.std, found.quantities, found.solution.parameters[0]
    return {
        "law": {
            "force": {"value": first.force_law, "std": float(std[FORCE_LAW])},
            "motion": {"value": first.motion_law, "std": float(std[MOTION_LAW])},
        },
        "equivalent": {
            "depth_m": told.depth_m,
            "depth_over_radius": told.depth_radii,
            "strain": told.strain,
        },
    }


def _information(found: "DirectEstimate") -> dict:
    """Least deviations of log moduli and nu, and their parts of those that are stated."""
    parts = found.bound / found.budget.std
    each = zip(NAMES, found.bound.tolist(), parts.tolist(), strict=True)
    return {name: {"bound": bound, "efficiency": part} for name, bound, part in each}


def _nuisances(p: Parameters) -> dict:
    """What a capture has for itself."""
    sunk, *rocked = p.support_motion.tolist()
    return {
        "offset_m": p.offset_m,
        "clock_s": p.clock_s,
        "shift_m": p.shift_m.tolist(),
        "place_m": p.place_m.tolist(),
        "sunk_m": sunk,
        "rocked_rad": rocked,
    }


def _summed(indentation: DirectIndentation, scales: Scales) -> dict:
    """How a capture's residuals compare with what was stated."""
    return {
        **_moved(indentation, scales, 0),
        "across": _moved(indentation, scales, 1) if (indentation.kind == 1).any() else None,
        "depth_std_m": float(np.median(indentation.depth_std_m)),
        "depth_scale": float(np.median(indentation.depth_std_m)) / indentation.tip_std_m,
        "largest_depth_m": float(indentation.depth_m.max()),
    }


def _moved(indentation: DirectIndentation, scales: Scales, kind: int) -> dict:
    """The same of its motions along the normals, or across."""
    of, at = indentation.kind == kind, np.minimum(indentation.axis, 1) == kind
    seen, std = indentation.seen.any(axis=0) & at, indentation.moved_std_m[indentation.seen][of]
    return {
        "cells": int(seen.sum()),
        "patches": len(np.unique(indentation.cluster[seen])),
        "motion_std_m": float(np.median(std)) * scales.motion[kind] if len(std) else None,
        "motion_scale": scales.motion[kind],
        "motion_sharing": scales.sharing[kind],
    }
