"""What time and a first press take from the force: relaxation, at constant ratio, and softening."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

# Part of the most work ever done, over which a first press' softening comes in.
SOFTENED_WITHIN = 0.3


def relaxed_force(
    time_s: NDArray,
    elastic_force_n: NDArray,
    *,
    fractions: Sequence[float],
    times_s: Sequence[float],
) -> NDArray:
    """Hereditary integral of a Prony series over the elastic force.

    G(t) = 1 - sum g_i (1 - exp(-t / tau_i)), as part of the instantaneous modulus; exact for an
    elastic force that is linear between the samples.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times [s].
    elastic_force_n : (n,) array
        Force that the instantaneous modulus would give [N].
    fractions, times_s : sequences of float
        g_i and tau_i [s].

    Returns
    -------
    (n,) array
        Force [N].

    Raises
    ------
    ValueError
        If the series is no relaxation: a fraction or time not positive, or a sum of 1 or more.
    """
    if len(fractions) != len(times_s):
        found = f"{len(fractions)} and {len(times_s)}"
        raise ValueError(f"relaxation: expected as many fractions as times, found {found}")
    if sum(fractions) >= 1 or min(fractions, default=1) < 0 or min(times_s, default=1) <= 0:
        raise ValueError(f"relaxation: expected fractions with a sum < 1, found {list(fractions)}")
    force = np.asarray(elastic_force_n) * (1 - sum(fractions))
    steps, changes = np.diff(time_s), np.diff(elastic_force_n)
    for fraction, tau in zip(fractions, times_s, strict=True):
        decay = np.exp(-steps / tau)
        gain = fraction * changes * (1 - decay) * tau / steps
        part = np.zeros(len(time_s))
        part[0] = fraction * elastic_force_n[0]
        for k in range(len(steps)):
            part[k + 1] = decay[k] * part[k] + gain[k]
        force = force + part
    return force


def softening(depth_m: NDArray, force_n: NDArray, loss: float) -> NDArray:
    """What a first press leaves of rubber's force (Mullins), as Ogden and Roxburgh 1999 write it.

    On the way down all of it; short of the deepest so far
    1 - loss erf((W_max - W)/(0.3 W_max)), with the work W that the virgin takes to a depth.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth in the order of time [m] and the virgin's force [N].
    loss : float
        Share that is lost where nothing presses any more.

    Returns
    -------
    (n,) array
    """
    order = np.argsort(depth_m, kind="stable")
    steps = np.diff(depth_m[order]) * (force_n[order][1:] + force_n[order][:-1]) / 2
    work = np.empty(len(depth_m))
    work[order] = np.concatenate([[0.0], np.cumsum(steps)])
    most = np.maximum.accumulate(work)
    return 1 - loss * erf(
        (most - work) / (SOFTENED_WITHIN * np.maximum(most, np.finfo(float).tiny))
    )
