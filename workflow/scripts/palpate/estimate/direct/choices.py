"""What other choices of samples and priors make of the direct estimate."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.fit import Solution, fit_direct
from palpate.estimate.direct.indentation import DirectIndentation
from palpate.estimate.direct.options import Fit


def other_choices(
    best: Solution, options: Fit, *, radius_m: float
) -> dict[str, tuple[float, float]]:
    """Moduli with other samples, and with relaxation held more and less loosely."""
    start, indentations = best.parameters[0], best.indentations
    variants = {
        "cells_farther_off": (
            [_farther(indentation, 0.5 * radius_m) for indentation in indentations],
            options,
        ),
        "near_cells": ([_nearer(indentation) for indentation in indentations], options),
        "looser_relaxation": (indentations, _relaxing(options, 2.0)),
        "stiffer_relaxation": (indentations, _relaxing(options, 0.5)),
        "uneven_relaxation": (indentations, replace(options, fraction_step_std=1.0)),
        "looser_gain": (indentations, replace(options, gain_std=2 * options.gain_std)),
    }
    found = {}
    for name, (chosen, changed) in variants.items():
        p = fit_direct(chosen, best.law, changed, start, scales=best.scales).parameters[0]
        found[name] = (p.youngs_modulus_pa, p.poisson_ratio)
    return found


def _relaxing(options: Fit, times: float) -> Fit:
    """Options with the priors of what relaxes so many times as wide."""
    return replace(
        options,
        fraction_std=times * options.fraction_std,
        fraction_step_std=times * options.fraction_step_std,
    )


def _farther(indentation: DirectIndentation, by_m: float) -> DirectIndentation:
    """Without the samples next to the contact."""
    away = np.linalg.norm(indentation.cell_m - indentation.contact_m, axis=1)
    nearest = away[indentation.seen.any(axis=0)].min()
    return _without(indentation, away < nearest + by_m)


def _nearer(indentation: DirectIndentation) -> DirectIndentation:
    """Without the farther half of the samples."""
    away = np.linalg.norm(indentation.cell_m - indentation.contact_m, axis=1)
    return _without(indentation, away > (away.min() + away.max()) / 2)


def _without(indentation: DirectIndentation, out: NDArray) -> DirectIndentation:
    moved = np.where(out, np.nan, indentation.moved_m)
    return replace(indentation, moved_m=moved)
