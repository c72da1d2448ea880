"""What direct.json says of an estimate."""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np

from palpate.estimate.direct.estimate import DirectEstimate
from palpate.estimate.direct.indentation import DirectIndentation, Parameters


def described(
    found: DirectEstimate, indentations: Sequence[DirectIndentation], times_s: Sequence[float]
) -> dict:
    """Describe an estimate.

    Parameters
    ----------
    found : DirectEstimate
    indentations : sequence of DirectIndentation
        That it was made from.
    times_s : sequence of float
        Relaxation times [s].
    """
    best, first = found.solution, found.solution.parameters[0]
    moduli = {name: asdict(interval) for name, interval in found.moduli.items()}
    return {
        "frames": [len(indentation.frames) for indentation in indentations],
        "frames_beyond_lookup": [indentation.frames_beyond for indentation in indentations],
        "law": best.law,
        "criterion": found.criterion,
        **moduli,
        "relaxation": {"times_s": list(times_s), "fractions": first.fractions.tolist()},
        "gain": first.gain,
        "nuisances": [_nuisances(p) for p in best.parameters],
        "residuals": [_summed(*of) for of in zip(indentations, best.scales, strict=True)],
        "laws": [asdict(law) for law in found.laws],
        "profile": asdict(found.profile),
        "choices": {
            name: {"youngs_modulus_pa": E, "poisson_ratio": nu}
            for name, (E, nu) in found.choices.items()
        },
    }


def _nuisances(p: Parameters) -> dict:
    """What a capture has for itself."""
    sunk, *rocked = p.support_motion.tolist()
    return {
        "offset_m": p.offset_m,
        "clock_s": p.clock_s,
        "shift_m": p.shift_m,
        "sunk_m": sunk,
        "rocked_rad": rocked,
    }


def _summed(indentation: DirectIndentation, scales) -> dict:
    """How a capture's residuals compare with what was stated."""
    return {
        "cells": int(indentation.seen.any(axis=0).sum()),
        "patches": len(np.unique(indentation.cluster[indentation.seen.any(axis=0)])),
        "motion_std_m": float(np.median(indentation.moved_std_m[indentation.seen])) * scales.motion,
        "motion_scale": scales.motion,
        "motion_sharing": scales.sharing,
        "depth_std_m": indentation.depth_std_m * scales.depth,
        "depth_scale": scales.depth,
        "largest_depth_m": float(indentation.depth_m.max()),
    }
