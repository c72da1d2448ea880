"""Rules that decide whether numbers bear a statement out."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from math import comb

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy import stats

LEVEL = 0.05
LEAST_PRINTED_P = 1e-6
HOLDS, FAILS, OPEN = "holds", "does not hold", "not decided"
# Of findings that simulated captures exclude by how they are made.
UNTESTABLE = "not testable here"


@dataclass(frozen=True)
class Outcome:
    """What a check found: numbers in words, and whether they bear the statement out.

    Attributes
    ----------
    evidence : str
    holds : bool or None
        None where the numbers do not decide.
    """

    evidence: str
    holds: bool | None

    @property
    def verdict(self) -> str:
        """``holds``, ``does not hold`` or ``not decided``."""
        return OPEN if self.holds is None else HOLDS if self.holds else FAILS


def sign_test(
    larger: ArrayLike, smaller: ArrayLike, *, what: str = "pairs", unit: str = ""
) -> Outcome:
    """Whether one of paired values is larger than the other more often than by chance.

    Parameters
    ----------
    larger, smaller : (n,) arrays
        Paired values; equal ones and those with a missing value do not count.
    what : str, optional
        What a pair is called in the evidence.
    unit : str, optional
        Of the values, for the evidence.

    Returns
    -------
    Outcome
        Holds at p below `LEVEL`, does not hold where the opposite has p below `LEVEL`.

    Raises
    ------
    ValueError
        If the arrays differ in length.
    """
    one, other = np.asarray(larger, dtype=float), np.asarray(smaller, dtype=float)
    if one.shape != other.shape:
        raise ValueError(f"smaller: expected {len(one)} values, found {len(other)}")
    known = np.isfinite(one) & np.isfinite(other) & (one != other)
    n, k = int(known.sum()), int((one > other)[known].sum())
    if n == 0:
        return Outcome(f"no {what}", None)
    p, opposite = (
        float(stats.binomtest(k, n, alternative=side).pvalue) for side in ("greater", "less")
    )
    medians = " and ".join(f"{_median(values[known])} {unit}".strip() for values in (one, other))
    text = f"{k} of {n} {what}, {_p(p, opposite)}; medians {medians}"
    return Outcome(text, _either(p, opposite))


def rank_test(larger: ArrayLike, smaller: ArrayLike, *, least_ratio: float) -> Outcome:
    """Whether one group's values are larger than another's, and by enough to matter.

    Parameters
    ----------
    larger, smaller : (n,) and (m,) arrays
        Two groups of positive values.
    least_ratio : float
        Least ratio of the medians that counts as a difference.

    Returns
    -------
    Outcome
        One-sided Mann-Whitney test. Does not hold where the same test finds the first group
        smaller than ``least_ratio`` times the second, that is, excludes so large a difference.
    """
    one, other = np.asarray(larger, dtype=float), np.asarray(smaller, dtype=float)
    # The least p that so many values can give.
    least_p = 1 / comb(len(one) + len(other), len(one))
    if min(len(one), len(other)) == 0 or least_p >= LEVEL:
        return Outcome(f"only {len(one)} and {len(other)} values", None)
    p = float(stats.mannwhitneyu(one, other, alternative="greater").pvalue)
    less = float(stats.mannwhitneyu(one, least_ratio * other, alternative="less").pvalue)
    ratio = float(np.median(one) / np.median(other))
    text = f"ratio of medians {ratio:.3f}, {_p(p)}; p of a ratio below {least_ratio:g}: {less:.2g}"
    return Outcome(text, _either(p if ratio >= least_ratio else 1.0, less))


def trend_test(x: ArrayLike, y: ArrayLike) -> Outcome:
    """Whether y grows with x: Spearman's rank correlation, one-sided either way."""
    if len(x) < 5:
        return Outcome(f"only {len(x)} values", None)
    found = stats.spearmanr(x, y, alternative="greater")
    rho, p = float(found.statistic), float(found.pvalue)
    if not np.isfinite(rho):
        return Outcome("no spread", None)
    opposite = float(stats.spearmanr(x, y, alternative="less").pvalue)
    return Outcome(f"rank correlation {rho:.2f}, {_p(p, opposite)}", _either(p, opposite))


def follow(values: pd.Series, rule: Callable, form: str, needed: Collection[str]) -> Outcome:
    """Whether values by name follow a rule; open where one that it needs is missing."""
    text = ", ".join(form.format(name, value) for name, value in values.items())
    holds = rule(values) if set(needed) <= set(values.index) else None
    return Outcome(text, None if holds is None else bool(holds))


def each(groups: Iterable[tuple], check: Callable) -> Outcome:
    """A check of each of a table's groups: one that fails decides, then one that is open."""
    found = {name if isinstance(name, str) else " ".join(name): check(one) for name, one in groups}
    if not found:
        return Outcome("nothing to compare", None)
    text = "; ".join(f"{name}: {one.evidence}" for name, one in found.items())
    holds = [one.holds for one in found.values()]
    return Outcome(text, False if False in holds else None if None in holds else True)


def _either(p: float, opposite: float) -> bool | None:
    """True or False where the statement or its opposite has p below `LEVEL`."""
    return True if p < LEVEL else False if opposite < LEVEL else None


def _median(values: np.ndarray) -> str:
    value = float(np.nanmedian(values))
    return f"{value:.0f}" if value >= 1000 else f"{value:.3g}"


def _p(p: float, opposite: float = 0.0) -> str:
    """P value in words; that of the opposite too where the first decides nothing."""
    text = f"p = {p:.2g}" if p >= LEAST_PRINTED_P else f"p < {LEAST_PRINTED_P:g}"
    return text if p < LEVEL or not opposite else f"{text}, of the opposite {_p(opposite)}"
