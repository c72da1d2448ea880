"""What other choices of cells and priors make of the direct estimate."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.fit import Solution, fit_direct
from palpate.estimate.direct.indentation import DirectPress
from palpate.estimate.direct.options import Fit


def other_choices(
    best: Solution, options: Fit, *, radius_m: float
) -> dict[str, tuple[float, float]]:
    """Moduli with other cells, and with relaxation held more and less loosely."""
    start, presses = best.parameters[0], best.presses
    variants = {
        "cells_farther_off": ([_farther(press, 0.5 * radius_m) for press in presses], options),
        "near_cells": ([_nearer(press) for press in presses], options),
        "looser_relaxation": (presses, _relaxing(options, 2.0)),
        "stiffer_relaxation": (presses, _relaxing(options, 0.5)),
        "uneven_relaxation": (presses, replace(options, fraction_step_std=1.0)),
        "looser_gain": (presses, replace(options, gain_std=2 * options.gain_std)),
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


def _farther(press: DirectPress, by_m: float) -> DirectPress:
    """Without the cells next to the contact."""
    away = np.linalg.norm(press.cell_m - press.contact_m, axis=1)
    nearest = away[press.seen.any(axis=0)].min()
    return _without(press, away < nearest + by_m)


def _nearer(press: DirectPress) -> DirectPress:
    """Without the farther half of the cells."""
    away = np.linalg.norm(press.cell_m - press.contact_m, axis=1)
    return _without(press, away > (away.min() + away.max()) / 2)


def _without(press: DirectPress, out: NDArray) -> DirectPress:
    moved = np.where(out, np.nan, press.moved_m)
    return replace(press, moved_m=moved)
