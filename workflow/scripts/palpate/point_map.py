"""Stiffness over an object: whether its points differ, and what is to be expected between them.

Logarithms y_i of the moduli at n points have variances v_i that the points do not share. Cochran's
Q = sum w_i (y_i - y)^2, w_i = 1/v_i, y their weighted mean, is chi-square distributed with n - 1
degrees of freedom where all points are equally stiff. How much they differ is the standard
deviation with which Q is what it is expected to be, Q(tau^2) = n - 1, and its interval has Q at
quantiles of chi-square (R. C. Paule, J. Mandel, J. Res. NBS 87, 1982, 377; W. Viechtbauer,
Stat. Med. 26, 2007, 37).

Between points stands a Gaussian process with an unknown mean (C. E. Rasmussen, C. K. I. Williams,
Gaussian Processes for Machine Learning, 2006, Eqs. 2.25, 2.26, 2.41) and a Matern covariance
(Eq. 4.17) of the straight distance: that of two places along a curved surface makes no covariance
in general, and what an indentation feels is the volume below. So few points do not determine
length and deviation of a process, so both are averaged by their likelihood.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.spatial.distance import cdist, pdist
from scipy.special import ndtri
from scipy.stats import chi2

from palpate.estimate.direct.budget import OWN_SOURCES
from palpate.modulus import CONFIDENCE, NOT_JUDGED, VERDICTS, Modulus
from palpate.units import PERCENT

FEWEST_POINTS = 3
# What is mapped: it depends least on the material law, so points of other depths compare.
MAPPED = "effective_reduced_modulus_pa"
# Sources of an uncertainty budget, by how their names begin, that each capture has for itself, and
# that captures of one point share; all others are the same error at all points that are indented
# alike: as deep, by the same sphere, into a surface of the same shape.
OF_CAPTURE = (*OWN_SOURCES, "noise of", "offset of the force", "drift of the force")
OF_CAPTURE += ("captures that differ",)
OF_POINT = ("curvature of the template", "indentation table", "support: rocking")
# p-value from which on points are said not to differ, and the least that is printed.
LIKELY_ALIKE, LEAST_P = 1 - CONFIDENCE, 1e-4
# Of intervals of a normal distribution, either way.
REACH = float(ndtri((1 + CONFIDENCE) / 2))
# Deviation of log E* over an object beforehand (half of a normal distribution), and its values and
# the lengths that are averaged; lengths go from half the points' least distance to twice the most.
USUAL_STD, LENGTHS = 0.5, 7
DEVIATIONS = USUAL_STD * ndtri(0.5 + (np.arange(24) + 0.5) / 48)


@dataclass(frozen=True)
class Homogeneity:
    """Whether points differ by more than their own uncertainty.

    Attributes
    ----------
    q : float
        Cochran's.
    freedom : int
        Its degrees of freedom.
    p_value : float
        Of equal points.
    deviation, deviation_high : float
        Standard deviation between points, as a part of the modulus, and the end of its interval.
    """

    q: float
    freedom: int
    p_value: float
    deviation: float
    deviation_high: float

    def __str__(self) -> str:
        p = f"p = {self.p_value:.2g}" if self.p_value >= LEAST_P else f"p < {LEAST_P:g}"
        test = f"{p}; Q = {self.q:.1f}, {self.freedom} degrees of freedom"
        std, most = (f"{PERCENT * one:.0f} %" for one in (self.deviation, self.deviation_high))
        if self.p_value >= LIKELY_ALIKE:
            line = f"the points do not differ beyond their uncertainty ({test}); a standard"
            return f"{line} deviation between points of up to {most} could remain unseen"
        line = f"the points differ by more than their uncertainty ({test}): the standard deviation"
        return f"{line} between points is {std} (up to {most})"


def homogeneity(logs: ArrayLike, stds: ArrayLike) -> Homogeneity:
    """Test whether points are equally stiff, of logarithms (n,) and their own deviations (n,)."""
    logs, variances = np.asarray(logs, dtype=float), np.square(np.asarray(stds, dtype=float))

    def q(excess: float) -> float:
        weights = 1 / (variances + excess**2)
        return float(weights @ (logs - weights @ logs / weights.sum()) ** 2)

    def deviation(level: float) -> float:
        """Excess with which Q is at a level."""
        most = np.sqrt(len(logs) * np.ptp(logs) ** 2 / level)
        return float(brentq(lambda excess: q(excess) - level, 0, most)) if q(0) > level else 0.0

    def unseen(level: float) -> float:
        """Excess with which the Q that is expected of equal points falls to a level."""
        most = np.sqrt(freedom * variances.max() / level)
        given = brentq(lambda e: freedom * np.mean(variances / (variances + e**2)) - level, 0, most)
        return float(given)

    freedom = len(logs) - 1
    found, p = q(0.0), float(chi2.sf(q(0.0), freedom))
    # Points that agree better than they are expected to do not show how even they are.
    level = float(chi2.ppf((1 - CONFIDENCE) / 2, freedom))
    return Homogeneity(found, freedom, p, deviation(freedom), max(deviation(level), unseen(level)))


@dataclass(frozen=True)
class StiffnessMap:
    """Moduli at the points of an object, and what follows for all of its surface.

    Attributes
    ----------
    places_m : (n, 3) array
        Of the points [m].
    moduli : tuple of Modulus
        At them.
    own_stds : (n,) array
        Deviations of the moduli's logarithms that points do not share.
    shared_std : float
        And the one that they do.
    homogeneity : Homogeneity

    Examples
    --------
    >>> moduli = [Modulus(E, 0.9 * E, E / 0.9, "identified", "Pa") for E in (24e3, 25e3, 26e3)]
    >>> found = stiffness_map(0.03 * np.eye(3), moduli)
    >>> str(found)[:59]
    '3 points: the points do not differ beyond their uncertainty'
    """

    places_m: NDArray
    moduli: tuple[Modulus, ...]
    own_stds: NDArray
    shared_std: float
    homogeneity: Homogeneity

    def at(self, places_m: ArrayLike) -> tuple[NDArray, NDArray, NDArray]:
        """Modulus and ends of its 95 % interval at places (k, 3) [m]: three arrays (k,) [Pa].

        Intervals are of the object's own modulus there, and contain what all points share.
        """
        away = cdist(np.asarray(places_m, dtype=float), self.places_m)
        mean, square = np.zeros((2, len(away)))
        apart, logs = pdist(self.places_m), np.log([one.value for one in self.moduli])
        lengths = np.geomspace(apart[apart > 0].min() / 2, 2 * apart.max(), LENGTHS)
        each = [_Process(self.places_m, logs, self.own_stds, length) for length in lengths]
        most = max(one.log_likely.max() for one in each)
        whole = sum(np.exp(one.log_likely - most).sum() for one in each)
        for one in each:
            likely = np.exp(one.log_likely - most) / whole
            here, variance = one.at(matern(away / one.length_m))
            mean += here @ likely
            square += (variance + here**2) @ likely
        reach = REACH * np.sqrt(np.maximum(square - mean**2, 0) + self.shared_std**2)
        return np.exp(mean), np.exp(mean - reach), np.exp(mean + reach)

    def __str__(self) -> str:
        return f"{len(self.moduli)} points: {self.homogeneity}"


def stiffness_map(
    places_m: ArrayLike, moduli: Sequence[Modulus], own_parts: ArrayLike = 1.0
) -> StiffnessMap:
    """Map the stiffness of an object of what was found at three or more of its points.

    Parameters
    ----------
    places_m : (n, 3) array
        Of the points, object frame [m].
    moduli : sequence of Modulus
        A modulus of each point with its interval (95 %) [Pa], best the effective E*.
    own_parts : (n,) array or float, optional
        Parts of their variances that points do not share (`own_part`), above 0 and at most 1. With
        1 the test for differences is too cautious where points share errors.

    Returns
    -------
    StiffnessMap
        ``homogeneity`` says whether points differ, ``at(places_m)`` gives moduli with intervals.

    Raises
    ------
    ValueError
        If there are fewer than three points or all at one place, or a number is out of range.

    Examples
    --------
    >>> from palpate.modulus import Modulus
    >>> places_m = [(0, 0, 0), (0.03, 0, 0), (0, 0.03, 0), (0.03, 0.03, 0)]
    >>> values = [24e3, 25e3, 24.5e3, 48e3]
    >>> moduli = [Modulus(E, 0.93 * E, E / 0.93, "identified", "Pa") for E in values]
    >>> found = stiffness_map(places_m, moduli)
    >>> found.homogeneity.p_value < 0.001
    True
    >>> value_pa, low_pa, high_pa = found.at([(0.015, 0, 0), (0.2, 0.2, 0)])
    >>> bool(high_pa[1] / low_pa[1] > high_pa[0] / low_pa[0] > 1)  # least known far from all points
    True
    """
    places, count = np.asarray(places_m, dtype=float), len(moduli)
    if count < FEWEST_POINTS:
        raise ValueError(f"moduli: expected {FEWEST_POINTS} points or more, found {count}")
    if places.shape != (count, 3) or not np.isfinite(places).all():
        raise ValueError(f"places_m: expected ({count}, 3) finite, found {places.shape}")
    if pdist(places).max() == 0:
        raise ValueError("places_m: expected places apart, found one for all")
    parts = np.broadcast_to(np.asarray(own_parts, dtype=float), count)
    if not np.all((parts > 0) & (parts <= 1)):
        raise ValueError(f"own_parts: expected above 0 and at most 1, found {parts.tolist()}")
    own, logs = own_stds(moduli, parts), np.log([one.value for one in moduli])
    shared = float(np.sqrt(np.mean(own_stds(moduli, 1 - parts) ** 2)))
    return StiffnessMap(places, tuple(moduli), own, shared, homogeneity(logs, own))


def log_std(modulus: Modulus) -> float:
    """Standard deviation of a modulus' logarithm, by its interval; a `ValueError` without one."""
    value, low, high = modulus.value, modulus.low, modulus.high
    if low is None or high is None or not 0 < low <= value <= high < np.inf or low == high:
        raise ValueError(f"moduli: expected values within intervals, found {modulus}")
    return float(np.log(high / low) / (2 * REACH))


def own_stds(moduli: Sequence[Modulus], parts: ArrayLike) -> NDArray:
    """Deviations of moduli's logarithms (n,), of parts of their variances."""
    return np.array([log_std(one) for one in moduli]) * np.sqrt(parts)


def own_part(budget: Sequence[Mapping]) -> float:
    """Part of the variance of the effective E* that other points do not share.

    Of an estimate's uncertainty budget: ``found.budget.rows()``, or of its direct.json.

    Examples
    --------
    >>> part = "contribution_log_effective_reduced_modulus"
    >>> sources = {"noise of the depth": 0.03, "scale of the force": 0.04}
    >>> round(own_part([{"source": name, part: std} for name, std in sources.items()]), 2)
    0.36
    """
    capture, point, _ = _parts(budget)
    return capture + point


def point_moduli(
    captures: Sequence[Mapping], singles: Sequence[Mapping]
) -> dict[str, tuple[Modulus, float]]:
    """Effective E* by point with `own_part`, of captures with one sensor and their direct.json.

    Captures of a point are combined, by the variances that they do not share; where they differ by
    more, these are larger (Birge's ratio). The verdict is the worst of theirs and the interval's.
    What is not judged is left out.
    """
    found: dict[str, list] = {}
    for capture, single in zip(captures, singles, strict=True):
        one = Modulus(**single[MAPPED])
        if one.verdict != NOT_JUDGED:
            found.setdefault(capture["point"], []).append((one, _parts(single["budget"])))
    return {point: _combined(*zip(*found[point], strict=True)) for point in sorted(found)}


def _combined(moduli: Sequence[Modulus], parts: Sequence[tuple]) -> tuple[Modulus, float]:
    if len(moduli) == 1:
        return moduli[0], parts[0][0] + parts[0][1]
    logs = np.log([one.value for one in moduli])
    variances = np.array([log_std(one) ** 2 for one in moduli])[:, None] * parts
    weights = 1 / variances[:, 0]
    mean = weights @ logs / weights.sum()
    apart = weights @ (logs - mean) ** 2 / (len(logs) - 1)
    capture = max(1.0, apart) / weights.sum()
    _, point, shared = weights @ variances / weights.sum()
    reach = REACH * np.sqrt(whole := capture + point + shared)
    ends = map(float, np.exp([mean, mean - reach, mean + reach]))
    found = Modulus.of_pascals(*ends)
    verdict = max((found.verdict, *(one.verdict for one in moduli)), key=list(VERDICTS).index)
    return replace(found, verdict=verdict), float((capture + point) / whole)


def _parts(budget: Sequence[Mapping]) -> tuple[float, float, float]:
    """Of the variance, what each capture has for itself, each point, and what all share."""
    squares = dict.fromkeys((OF_CAPTURE, OF_POINT, ""), 0.0)
    for row in budget:
        kind = next(names for names in squares if row["source"].startswith(names))
        squares[kind] += row[f"contribution_log_{MAPPED.removesuffix('_pa')}"] ** 2
    capture, point, shared = (part / sum(squares.values()) for part in squares.values())
    return capture, point, shared


def matern(distance: NDArray) -> NDArray:
    """Matern's covariance of smoothness 3/2 and deviation 1 at distances over the length."""
    scaled = np.sqrt(3) * distance
    return (1 + scaled) * np.exp(-scaled)


class _Process:
    """Processes of one length and `DEVIATIONS` through points: how likely, and their values.

    With the points' own deviations D and D^-1 M D^-1 = U L U' of Matern's M, the inverse of
    s^2 M + D^2 is D^-1 U (s^2 L + 1)^-1 U' D^-1.
    """

    def __init__(self, places: NDArray, logs: NDArray, stds: NDArray, length_m: float) -> None:
        self.length_m = length_m
        inside = matern(cdist(places, places) / length_m) / np.outer(stds, stds)
        values, vectors = np.linalg.eigh(inside)
        self.onto = vectors / stds[:, None]
        self.inverse = 1 / (np.outer(np.maximum(values, 0), DEVIATIONS**2) + 1)
        self.one, rest = self.onto.sum(axis=0), self.onto.T @ logs
        self.precision = self.one**2 @ self.inverse
        self.mean = (self.one * rest) @ self.inverse / self.precision
        self.rest = rest[:, None] - np.outer(self.one, self.mean)
        cost = (self.rest**2 * self.inverse).sum(axis=0) - np.log(self.inverse).sum(axis=0)
        self.log_likely = -(cost + np.log(self.precision)) / 2

    def at(self, across: NDArray) -> tuple[NDArray, NDArray]:
        """Values and variances by place and deviation, of covariances (k, n) with the points."""
        across, square = across @ self.onto, DEVIATIONS**2
        here = self.mean + square * (across @ (self.inverse * self.rest))
        variance = square - square**2 * (across**2 @ self.inverse)
        to_one = square * (across @ (self.inverse * self.one[:, None]))
        return here, variance + (1 - to_one) ** 2 / self.precision
