"""What direct.json says of an estimate."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.estimate.direct.blocks import Scales
from palpate.estimate.direct.indentation import SHARED, DirectIndentation, Parameters
from palpate.estimate.direct.quantities import FORCE_LAW, MOTION_LAW, NAMES, ONE_SECOND_S
from palpate.estimate.direct.regions import regions_of
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import IDENTIFIED, Modulus

if TYPE_CHECKING:
    from palpate.estimate.direct.estimate import DirectEstimate

YOUNG, LATER_S = "youngs_modulus_pa", 10.0


def described(found: "DirectEstimate") -> dict:
    """Describe an estimate in what a JSON file holds."""
    best, first = found.solution, found.solution.parameters[0]
    indentations, times = best.indentations, found.options.relaxation_times_s
    moduli = {name: asdict(modulus) for name, modulus in found.moduli.items()}
    return {
        "frames": [len(indentation.frames) for indentation in indentations],
        "frames_beyond_lookup": [indentation.frames_beyond for indentation in indentations],
        **moduli,
        "youngs_modulus_10s_pa": asdict(youngs_after(found, LATER_S)),
        **described_law(found),
        "regions": {name: one.tolist() for name, one in regions_of(best, found.options).items()},
        "relaxation": {"times_s": list(times), "fractions": first.fractions.tolist()},
        "gain": first.gain,
        "nuisances": [_nuisances(*of) for of in zip(indentations, best.parameters, strict=True)],
        "residuals": [_summed(*of) for of in zip(best.indentations, best.scales, strict=True)],
        "budget": found.budget.rows(),
        "information": _information(found),
        "converged": best.converged,
        "doubts": found.doubts,
    }


def described_law(found: "DirectEstimate") -> dict:
    """Material-law parameters of force and displacement, and what the effective modulus is of."""
    std, told, first = found.std, found.quantities, found.solution.parameters[0]
    return {
        "law": {
            "force": {"value": first.force_law, "std": float(std[FORCE_LAW])},
            "motion": {"value": first.motion_law, "std": float(std[MOTION_LAW])},
        },
        "effective": {
            "depth_m": told.depth_m,
            "after_s": ONE_SECOND_S,
            "depth_over_radius": told.depth_radii,
            "strain": told.strain,
        },
    }


def _information(found: "DirectEstimate") -> dict:
    """Least deviations of log moduli and nu, and their parts of those that are stated."""
    parts = found.bound / found.budget.std
    each = zip(NAMES, found.bound.tolist(), parts.tolist(), strict=True)
    return {name: {"bound": bound, "efficiency": part} for name, bound, part in each}


def _nuisances(indentation: DirectIndentation, p: Parameters) -> dict:
    """What a capture has for itself; how well the depth's zero was known beforehand."""
    sunk, *rocked = p.support_motion.tolist()
    return {
        "offset_m": p.offset_m,
        "offset_std_m": indentation.zero_std_m,
        "clock_s": p.clock_s,
        "shift_m": p.shift_m.tolist(),
        "place_m": p.place_m.tolist(),
        "picture_m": p.picture_m.tolist(),
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


def youngs_after(found: "DirectEstimate", after_s: float) -> Modulus:
    """E that is left a time after a step, with its interval.

    As that of E at once, wider by what the relaxing shares add to its deviation; it is no better
    known than E at once is.
    """
    now, times = found.moduli[YOUNG], np.array(found.options.relaxation_times_s, dtype=float)
    fractions = found.solution.parameters[0].fractions
    left = 1 - float(relaxed_share(after_s, fractions=fractions, times_s=times))
    slope = found.quantities.slopes[NAMES.index(YOUNG)]
    later = slope.copy()
    later[SHARED : SHARED + len(times)] += np.expm1(-after_s / times) / left
    more = later @ found.covariance @ later - slope @ found.covariance @ slope
    part = np.sqrt(max(1 + more / found.budget.std[NAMES.index(YOUNG)] ** 2, 0.0))
    low, high = (left * now.value * float((end / now.value) ** part) for end in (now.low, now.high))
    told = Modulus.of_pascals(left * now.value, low, high)
    return told if now.verdict == IDENTIFIED else replace(told, verdict=now.verdict)
