"""A record of forces as instruments write it: which columns count, and when samples were taken."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

GAUGE_COLUMNS = ("v0", "v1", "v2", "v3", "v4", "v5")
WRENCH_COLUMNS = ("fx_n", "fy_n", "fz_n", "tx_nm", "ty_nm", "tz_nm")
# Of a record in bursts, steps within a burst over the mean step, how many of all they are at least
# (half of all where two samples come together), and so many bursts are no accident.
WITHIN_BURST, LEAST_WITHIN, FEWEST_BURSTS = 0.2, 0.4, 5
# No buffer is handed out less often than this (100 samples of 1 kHz take 0.1 s, give or take);
# stretches farther apart were recorded apart [s].
LONGEST_BURST_S = 0.25


def force_columns(columns: Iterable, probe: Mapping | None = None) -> tuple[str, ...] | None:
    """Columns that count: volts where the probe's file says what they stand for, else newtons.

    Parameters
    ----------
    columns : iterable
        Of force.csv.
    probe : mapping, optional
        The probe's file.

    Returns
    -------
    tuple of str or None
        Volts alone where nothing else is there; None where neither is whole.
    """
    sets = [names for names in (GAUGE_COLUMNS, WRENCH_COLUMNS) if set(names) <= set(columns)]
    if len(sets) > 1 and probe is not None and "gauge" not in probe:
        return WRENCH_COLUMNS
    return sets[0] if sets else None


def sampled_s(stamps_s: NDArray) -> tuple[NDArray, float]:
    """When samples were taken that came in bursts, each burst with the stamps of one moment.

    A burst is handed out as its last sample is taken, and its samples are as far apart as is usual,
    or as they can be since the burst before: what is missing stays missing.

    Parameters
    ----------
    stamps_s : (n,) array
        Times as they were written [s].

    Returns
    -------
    times_s : (n,) array
        The stamps themselves where they don't come in bursts.
    burst : float
        Mean number of samples in a burst; 1 without.
    """
    steps = np.diff(stamps_s)
    if not len(steps) or not (steps >= 0).all():
        return stamps_s, 1.0
    mean = (stamps_s[-1] - stamps_s[0]) / len(steps)
    ends = np.append(np.flatnonzero(steps > mean), len(steps))
    if (steps < WITHIN_BURST * mean).mean() < LEAST_WITHIN or len(ends) <= FEWEST_BURSTS:
        return stamps_s, 1.0
    since, size = np.diff(stamps_s[ends]), np.diff(ends)
    if np.median(since) > LONGEST_BURST_S:
        return stamps_s, 1.0
    usual = np.median(since / size)
    apart = np.append(usual, np.minimum(usual, since / size))
    number = np.arange(len(stamps_s))
    burst = np.searchsorted(ends, number)
    return stamps_s[ends[burst]] - apart[burst] * (ends[burst] - number), len(stamps_s) / len(ends)
