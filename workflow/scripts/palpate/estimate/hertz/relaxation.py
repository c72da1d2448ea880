"""Instantaneous reduced modulus of an indentation and its hold, relaxation allowed for.

With amplitudes g_i given, the force E* R_g[law(d - c)(1 + e sqrt(d/R))] + b, where R_g is
`relaxed_force`, is linear in E*, and about a contact c nearly so in c, e and b. The amplitudes'
prior is therefore a grid of equally likely points; at each, and for each law, weighted least
squares gives the rest and how well the samples bear the point.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import logsumexp, ndtr, ndtri

from palpate.estimate.hertz.indentation import Indentation
from palpate.estimate.hertz.laws import Law
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.relaxation import relaxed_force, relaxed_share
from palpate.modulus import CONFIDENCE

# Relaxation times from two frame intervals to the length of the contact, about a factor apart.
FIRST_INTERVALS, FACTOR = 2.0, 3.0
FEWEST, MOST = 2, 4
# Points of the whole share, and of each breaking of it.
SHARES, BREAKS = 24, 6
# A material keeps something.
LARGEST_SHARE = 0.95
# Rounds of linearisation; in one the contact moves by no more than this part of the maximum depth,
# nor ever beyond this part of it.
ROUNDS, LARGEST_MOVE, LATEST, CONVERGED = 12, 0.1, 0.9, 1e-6
# Of differences, by the maximum depth.
STEP = 1e-6
# Median and ends of the interval.
LEVELS = (0.5, (1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)
# Evidence that is called positive (Kass and Raftery, JASA 90, 1995).
POSITIVE = float(np.log(3))


@dataclass(frozen=True)
class RelaxationFit:
    """Medians and 95 % intervals.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_interval_pa
        Instantaneous E*, and its interval by scatter, the common errors of depth, force and law,
        and relaxation [Pa].
    later_reduced_modulus_pa, later_reduced_modulus_interval_pa
        The same, a stated time after a step [Pa].
    later_s : float
        That time [s].
    times_s, fractions : tuple of float
        Relaxation times [s] and mean amplitudes.
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    log_evidence : float
        Natural logarithm of the evidence for relaxation over none.
    chi_square_per_sample : float
        Of the best point; above 1 it widens the intervals.
    """

    reduced_modulus_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    later_reduced_modulus_pa: float
    later_reduced_modulus_interval_pa: tuple[float, float]
    later_s: float
    times_s: tuple[float, ...]
    fractions: tuple[float, ...]
    contact_depth_m: float
    contact_depth_std_m: float
    log_evidence: float
    chi_square_per_sample: float


def relaxation_times(time_s: NDArray) -> NDArray:
    """Times spread over a contact that its samples can tell apart, (p,) [s].

    Two to four from two median intervals to the whole length, in geometric steps, of increasing
    times (n,), two samples or more from the onset of force to the end of the hold [s].
    """
    first = FIRST_INTERVALS * float(np.median(np.diff(time_s)))
    last = max(float(time_s[-1] - time_s[0]), FACTOR * first)
    count = 1 + round(np.log(last / first) / np.log(FACTOR))
    return np.geomspace(first, last, int(np.clip(count, FEWEST, MOST)))


def fit_relaxation(
    indentation: Indentation,
    laws: Mapping[float, Law],
    *,
    times_s: NDArray,
    beliefs: Beliefs,
    contact_m: float = 0.0,
) -> RelaxationFit:
    """Fit E*, contact and relaxation to an indentation that `allows_relaxation`, and its hold.

    Laws are forces per reduced modulus over depth by Poisson's ratio, each as likely as the others;
    times (p,) those to choose among (`relaxation_times`) [s]; ``contact_m`` is the depth at which
    contact begins, to start from [m].
    """
    tau, deepest = np.asarray(times_s, float), float(indentation.depth_m.max())
    contact, modulus = min(contact_m, LATEST * deepest), 0.0
    for _ in range(ROUNDS):
        about = (indentation, tau, beliefs, contact, modulus)
        every = zip(*(_linear(law, *about) for law in laws.values()), strict=True)
        at = _Points(*map(np.concatenate, every))
        # E* and the whole share have no prior. Above 1 it is what the stated errors fall short of,
        # in variance.
        excess = float(at.chi_square.min()) / max(len(indentation.force_n) - 2, 1)
        weights, evidence = _judged(at, excess, beliefs)
        mean = weights @ at.found
        move = float(mean[1]) - contact
        if abs(move) < CONVERGED * deepest:
            break
        modulus = max(float(mean[0]), 0.1 * modulus)
        contact += float(np.clip(move, -LARGEST_MOVE * deepest, LARGEST_MOVE * deepest))
        contact = min(contact, LATEST * deepest)
    kept, variance = weights > 0, max(excess, 1) * at.covariance
    left = 1 - relaxed_share(beliefs.at_s, fractions=at.amplitudes.T, times_s=tau)
    # The law's own scale multiplies E* whatever the record says.
    E, parts = at.found[kept, 0], weights[kept]
    std = np.hypot(np.sqrt(variance[kept, 0, 0]) / E, beliefs.law_std)
    now, *interval = _quantiles(parts, np.log(E), std)
    later, *later_interval = _quantiles(parts, np.log(E * left[kept]), std)
    contact = float(weights @ at.found[:, 1])
    spread = weights @ (variance[:, 1, 1] + (at.found[:, 1] - contact) ** 2)
    return RelaxationFit(
        reduced_modulus_pa=now,
        reduced_modulus_interval_pa=tuple(interval),
        later_reduced_modulus_pa=later,
        later_reduced_modulus_interval_pa=tuple(later_interval),
        later_s=beliefs.at_s,
        times_s=tuple(tau.tolist()),
        fractions=tuple((weights @ at.amplitudes).tolist()),
        contact_depth_m=contact,
        contact_depth_std_m=float(np.sqrt(spread)),
        log_evidence=evidence,
        chi_square_per_sample=excess,
    )


def verdict(fit: RelaxationFit, *, held: bool) -> str:
    """Whether relaxation is seen: by an evidence of three to one or more, if the probe was held."""
    if not held:
        return "no hold"
    if abs(fit.log_evidence) < POSITIVE:
        return "undecided"
    return "relaxes" if fit.log_evidence > 0 else "none seen"


class _Points(NamedTuple):
    """Points of the grid with each law, g of them, and least squares at each.

    Of amplitudes (g, p) what is found (g, 4), E* [Pa], contact [m], place of the law and baseline
    [N], with its covariance by errors as stated, (g, 4, 4); the weighted sum of squares and the sum
    of the logarithms of the forces' deviations, (g,).
    """

    amplitudes: NDArray
    found: NDArray
    covariance: NDArray
    chi_square: NDArray
    log_std: NDArray


def _judged(at: _Points, excess: float, beliefs: Beliefs) -> tuple[NDArray, float]:
    """Probability of each point, (g,), and the log evidence for relaxation over none."""
    none = ~at.amplitudes.any(axis=1)
    volume = np.linalg.slogdet(at.covariance)[1] / 2
    likelihood = volume - at.log_std - at.chi_square / (2 * max(excess, 1))
    likelihood[at.found[:, 0] <= 0] = -np.inf
    if not np.isfinite(likelihood).any():
        raise ValueError("force: expected one that grows with the depth, found another")
    without, with_it = (logsumexp(likelihood[of]) - np.log(of.sum()) for of in (none, ~none))
    prior = np.where(none, beliefs.none / none.sum(), (1 - beliefs.none) / (~none).sum())
    weights = prior * np.exp(likelihood - likelihood.max())
    return weights / weights.sum(), float(with_it - without)


def _linear(
    law: Law,
    indentation: Indentation,
    tau: NDArray,
    beliefs: Beliefs,
    contact: float,
    modulus: float,
) -> _Points:
    """Least squares in E*, the contact, the law's place and the baseline, about a contact."""
    depth = indentation.depth_m - contact
    unit, step, own = law(depth), STEP * float(depth.max()), indentation.frame_std_m
    modulus = modulus or float(unit @ indentation.force_n / (unit @ unit))
    slope = (law(depth + step) - law(depth - step)) / (2 * step)
    stiffer = unit * np.sqrt(np.maximum(depth, 0) / indentation.radius_m)
    columns = np.stack([unit, -modulus * slope, modulus * stiffer], axis=1)
    # A depth's own error moves its force.
    std = np.hypot(indentation.force_std_n, modulus * (law(depth + own) - law(depth - own)) / 2)
    grid = _amplitude_grid(len(tau), scale=beliefs.share)
    # R_g of every column at every point of the grid, (g, n, k), is linear in the amplitudes.
    half, time = {"fractions": [0.5]}, indentation.time_s
    lost = [2 * (columns - relaxed_force(time, columns, **half, times_s=[one])) for one in tau]
    relaxed = columns - np.tensordot(grid, np.array(lost), 1)
    design = np.concatenate([relaxed, np.ones((*relaxed.shape[:2], 1))], axis=2) / std[:, None]
    wanted = indentation.force_n / std
    known = np.array([indentation.contact_std_m, beliefs.law_growth_std, indentation.force_std_n])
    precision, centre = np.diag(np.r_[0, known**-2]), np.array([0, -contact, 0, 0])
    covariance = np.linalg.inv(np.swapaxes(design, 1, 2) @ design + precision)
    found = np.einsum("gij,gj->gi", covariance, wanted @ design + precision @ centre)
    residual, off = wanted - np.einsum("gnk,gk->gn", design, found), found - centre
    return _Points(
        amplitudes=grid,
        found=found + np.array([0, contact, 0, 0]),
        covariance=covariance,
        chi_square=(residual**2).sum(1) + ((off @ precision) * off).sum(1),
        log_std=np.full(len(grid), np.log(std).sum()),
    )


@cache
def _amplitude_grid(terms: int, *, scale: float) -> NDArray:
    """No relaxation, then equally likely amplitudes of a Prony series, (g, terms).

    The whole share has a half-normal prior of a scale and every split of it is as likely as any
    other: a Dirichlet distribution of ones, by the quantiles of breaking a stick.
    """
    share = scale * ndtri(0.5 + (np.arange(SHARES) + 0.5) / (2 * SHARES))
    share = share[share < LARGEST_SHARE]
    quantiles = np.array(list(product((np.arange(BREAKS) + 0.5) / BREAKS, repeat=terms - 1)))
    # Of what is left each break leaves a part, Beta(k, 1) with k parts still to come.
    left = np.cumprod((1 - quantiles) ** (1 / np.arange(terms - 1, 0, -1)), axis=1)
    splits = -np.diff(left, axis=1, prepend=1, append=0)
    grid = (share[:, None, None] * splits).reshape(-1, terms)
    grid = np.concatenate([np.zeros((1, terms)), grid])
    grid.flags.writeable = False
    return grid


def _quantiles(weights: NDArray, means: NDArray, stds: NDArray) -> list[float]:
    """Median and ends of the interval of a mixture of log-normal distributions."""
    ends = float((means - 9 * stds).min()), float((means + 9 * stds).max())

    def beyond(z: float, level: float) -> float:
        return float(weights @ ndtr((z - means) / stds)) - level

    return [float(np.exp(brentq(beyond, *ends, args=(level,)))) for level in LEVELS]
