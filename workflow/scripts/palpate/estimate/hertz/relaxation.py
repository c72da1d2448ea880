"""Instantaneous reduced modulus of an indentation and its hold, relaxation allowed for.

With amplitudes g_i given, the force E* R_g[law(d - c)(1 + e x)] + b (`relaxed_force` is R_g, x the
depth's part of the maximum) is linear in E*, and about a contact c nearly so in c, e and b. The
amplitudes' prior is therefore laid out as a grid of equally likely points; at each of them weighted
least squares gives the rest and how well the record bears the point.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import logsumexp, ndtr, ndtri

from palpate.estimate.hertz.indentation import FEWEST_IN_CONTACT, Record
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
# Ratio of likelihoods from which evidence is called positive (Kass and Raftery, JASA 90, 1995).
POSITIVE = float(np.log(3))


@dataclass(frozen=True)
class RelaxationFit:
    """Medians and 95 % intervals.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        Instantaneous E* and its standard deviation [Pa].
    reduced_modulus_interval_pa : (float, float)
        Of scatter, the common errors of depth, force and law, and relaxation [Pa].
    later_reduced_modulus_pa, later_reduced_modulus_interval_pa
        The same, a stated time after a step [Pa].
    later_s : float
        That time [s].
    relaxed_share, relaxed_share_interval
        Part of the elastic force that is gone when the loading ends.
    times_s, fractions : tuple of float
        Relaxation times [s] and mean amplitudes.
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    poisson_ratio, poisson_ratio_std : float
        Mean and standard deviation among the laws' ratios: what the force alone says of nu.
    law_growth : float
        Mean of the law's error that grows over the indentation.
    log_evidence : float
        Natural logarithm of the evidence for relaxation over none.
    chi_square_per_sample : float
        Of the best point; above 1 it widens the intervals.
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    reduced_modulus_std_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    later_reduced_modulus_pa: float
    later_reduced_modulus_interval_pa: tuple[float, float]
    later_s: float
    relaxed_share: float
    relaxed_share_interval: tuple[float, float]
    times_s: tuple[float, ...]
    fractions: tuple[float, ...]
    contact_depth_m: float
    contact_depth_std_m: float
    poisson_ratio: float
    poisson_ratio_std: float
    law_growth: float
    log_evidence: float
    chi_square_per_sample: float
    rms_n: float


def relaxation_times(time_s: NDArray) -> NDArray:
    """Times spread over a contact that its samples can tell apart.

    Parameters
    ----------
    time_s : (n,) array
        Times of the samples from the onset of force to the end of the hold, increasing [s].

    Returns
    -------
    (p,) array
        Two to four times from two median intervals to the whole length, in geometric steps [s].

    Raises
    ------
    ValueError
        If there are fewer than four samples.
    """
    if len(time_s) < FEWEST_IN_CONTACT:
        raise ValueError(f"time_s: expected at least 4 samples in contact, found {len(time_s)}")
    first = FIRST_INTERVALS * float(np.median(np.diff(time_s)))
    last = max(float(time_s[-1] - time_s[0]), FACTOR * first)
    count = 1 + round(np.log(last / first) / np.log(FACTOR))
    return np.geomspace(first, last, int(np.clip(count, FEWEST, MOST)))


def fit_relaxation(
    record: Record, laws: Mapping[float, Law], *, times_s: NDArray, beliefs: Beliefs
) -> RelaxationFit:
    """Fit E*, contact and relaxation to an indentation and its hold.

    Parameters
    ----------
    record : Record
    laws : mapping of float to callable
        Force per reduced modulus over depth by Poisson's ratio, each as likely as the others.
    times_s : (p,) array
        Relaxation times to choose among (`relaxation_times`) [s].
    beliefs : Beliefs

    Raises
    ------
    ValueError
        If fewer than four samples are in contact, or a stated error is not positive.
    """
    _check(record)
    times = np.asarray(times_s, float)
    parts = [_settled(record, law, times, beliefs) for law in laws.values()]
    return _summary(record, _joined(record, parts, beliefs), np.array(list(laws)), times, beliefs)


def verdict(fit: RelaxationFit, *, held: bool) -> str:
    """Say in a word whether the record holds relaxation.

    ``no hold`` if the probe was not held; else ``relaxes`` or ``none seen`` if the evidence is
    three to one or more, or ``undecided``.
    """
    if not held:
        return "no hold"
    if abs(fit.log_evidence) < POSITIVE:
        return "undecided"
    return "relaxes" if fit.log_evidence > 0 else "none seen"


@dataclass(frozen=True)
class _Mixture:
    """Points of the grid, of one law or of several, and least squares at each.

    Attributes
    ----------
    law : (g,) int array
        Which law.
    amplitudes : (g, p) array
        The first of each law are none.
    log_likelihood, weights : (g,) arrays
        Natural logarithm, up to a constant, and probability.
    found : (g, 4) array
        E* [Pa], contact [m], the law's growth and the baseline [N].
    covariance : (g, 4, 4) array
    chi_square, taken : (g,) arrays
        Weighted sum of squares, and the part of the elastic force gone when the loading ends.
    residual_n : (g, n) array
        Measured less fitted force [N].
    """

    law: NDArray
    amplitudes: NDArray
    log_likelihood: NDArray
    weights: NDArray
    found: NDArray
    covariance: NDArray
    chi_square: NDArray
    taken: NDArray
    residual_n: NDArray

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence for relaxation over none."""
        none = ~self.amplitudes.any(axis=1)
        with_it, without = self.log_likelihood[~none], self.log_likelihood[none]
        size = np.log(len(with_it) / len(without))
        return float(logsumexp(with_it) - size - logsumexp(without))


def _settled(record: Record, law: Law, times_s: NDArray, beliefs: Beliefs) -> _Mixture:
    """Mixture of one law, linear about the contact that it comes to itself."""
    unit = law(record.depth_m)
    contact, modulus = 0.0, float(unit @ record.force_n / (unit @ unit))
    deepest = float(record.depth_m.max())
    for _ in range(ROUNDS):
        mixture = _linear(record, law, times_s, beliefs, contact, modulus)
        mean = mixture.weights @ mixture.found
        move = float(mean[1]) - contact
        contact += float(np.clip(move, -LARGEST_MOVE * deepest, LARGEST_MOVE * deepest))
        contact = min(contact, LATEST * deepest)
        modulus = max(float(mean[0]), 0.1 * modulus)
        if abs(move) < CONVERGED * deepest:
            break
    return mixture


def _joined(record: Record, parts: Sequence[_Mixture], beliefs: Beliefs) -> _Mixture:
    """Mixture of several laws, each as likely as the others before the record is seen."""
    whole = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in _Mixture.__dataclass_fields__
    }
    whole["law"] = np.repeat(np.arange(len(parts)), [len(part.law) for part in parts])
    # Each law has scaled its scatter to its own best point.
    best = min(_excess(record, part.chi_square) for part in parts)
    scale = [_excess(record, part.chi_square) / best for part in parts]
    whole["covariance"] = whole["covariance"] / np.array(scale)[whole["law"], None, None]
    whole["log_likelihood"] = _log_likelihood(whole["chi_square"], whole["covariance"], best)
    whole["weights"] = _weights(whole["log_likelihood"], whole["amplitudes"], beliefs)
    return _Mixture(**whole)


def _freedom(record: Record) -> int:
    """Degrees of freedom: all unknowns but E* and the whole share have a row of their prior."""
    return max(len(record.force_n) - 2, 1)


def _linear(
    record: Record, law: Law, tau: NDArray, beliefs: Beliefs, contact: float, modulus: float
) -> _Mixture:
    """Least squares in E*, the contact, the law's growth and the baseline."""
    grid = _amplitude_grid(len(tau), scale=beliefs.share)
    grid = np.concatenate([np.zeros((1, len(tau))), grid])
    columns = _columns(record, law, contact, modulus)
    std = _force_std(record, law, contact, modulus)
    relaxed = _relaxed(record.time_s, columns, tau, grid)
    design = np.concatenate([relaxed, np.ones((*relaxed.shape[:2], 1))], axis=2) / std[:, None]
    wanted = record.force_n / std
    variances = np.array([record.contact_std_m, beliefs.law_std, record.force_std_n]) ** 2
    precision, centre = np.diag(np.r_[0, 1 / variances]), np.array([0, -contact, 0, 0])
    normal = np.swapaxes(design, 1, 2) @ design + precision
    found = np.linalg.solve(normal, (wanted @ design + precision @ centre)[..., None])[..., 0]
    residual, off = wanted - np.einsum("gnk,gk->gn", design, found), found - centre
    chi_square = (residual**2).sum(1) + ((off @ precision) * off).sum(1)
    excess = _excess(record, chi_square)
    covariance = np.linalg.inv(normal) * excess
    likelihood = _log_likelihood(chi_square, covariance, excess)
    return _Mixture(
        law=np.zeros(len(grid), dtype=int),
        amplitudes=grid,
        log_likelihood=likelihood,
        weights=_weights(likelihood, grid, beliefs),
        found=found + np.array([0, contact, 0, 0]),
        covariance=covariance,
        chi_square=chi_square,
        taken=1 - relaxed[:, record.deepest, 0] / columns[record.deepest, 0],
        residual_n=residual * std,
    )


def _excess(record: Record, chi_square: NDArray) -> float:
    """What the stated errors fall short of, in variance; 1 if they do not."""
    return max(float(chi_square.min()) / _freedom(record), 1.0)


def _log_likelihood(chi_square: NDArray, covariance: NDArray, excess: float) -> NDArray:
    """Of each point, the linear unknowns integrated over."""
    return 0.5 * (np.linalg.slogdet(covariance)[1] - chi_square / excess)


def _weights(log_likelihood: NDArray, amplitudes: NDArray, beliefs: Beliefs) -> NDArray:
    none = ~amplitudes.any(axis=1)
    prior = np.where(none, beliefs.none / none.sum(), (1 - beliefs.none) / (~none).sum())
    weights = prior * np.exp(log_likelihood - log_likelihood.max())
    return weights / weights.sum()


def _columns(record: Record, law: Law, contact: float, modulus: float) -> NDArray:
    """Elastic force's derivatives by E*, contact and the law's growth, (n, 3)."""
    depth = record.depth_m - contact
    step = STEP * float(depth.max())
    slope = (law(depth + step) - law(depth - step)) / (2 * step)
    unit = law(depth)
    part = np.clip(depth / depth.max(), 0, 1) - 0.5
    return np.stack([unit, -modulus * slope, modulus * unit * part], axis=1)


def _force_std(record: Record, law: Law, contact: float, modulus: float) -> NDArray:
    """Standard deviation of each force, with what its depth's own error adds, (n,) [N]."""
    depth, own = record.depth_m - contact, record.frame_std_m
    rise = modulus * (law(depth + own) - law(depth - own)) / 2
    return np.hypot(record.force_std_n, rise)


def _relaxed(time: NDArray, columns: NDArray, tau: NDArray, grid: NDArray) -> NDArray:
    """R_g of every column at every point of the grid, (g, n, k); linear in the amplitudes."""
    lost = [
        2 * (columns - relaxed_force(time, columns, fractions=[0.5], times_s=[one])) for one in tau
    ]
    return columns - np.tensordot(grid, np.array(lost), 1)


@cache
def _amplitude_grid(terms: int, *, scale: float) -> NDArray:
    """Equally likely amplitudes of a Prony series, (g, terms).

    The whole share has a half-normal prior of a scale and every split of it is as likely as any
    other: a Dirichlet distribution of ones, by the quantiles of breaking a stick.
    """
    share = scale * ndtri(0.5 + (np.arange(SHARES) + 0.5) / (2 * SHARES))
    share = share[share < LARGEST_SHARE]
    middles = (np.arange(BREAKS) + 0.5) / BREAKS
    splits = np.array([_split(u) for u in product(middles, repeat=terms - 1)])
    grid = (share[:, None, None] * splits).reshape(-1, terms)
    grid.flags.writeable = False
    return grid


def _split(quantiles: tuple[float, ...]) -> list[float]:
    """Parts of a stick broken at Beta(1, k) quantiles, k the number of parts still to come."""
    left, parts = 1.0, []
    for k, u in zip(range(len(quantiles), 0, -1), quantiles, strict=True):
        part = 1 - (1 - u) ** (1 / k)
        parts.append(left * part)
        left *= 1 - part
    return [*parts, left]


def _summary(
    record: Record, mixture: _Mixture, nu: NDArray, tau: NDArray, beliefs: Beliefs
) -> RelaxationFit:
    weights, moduli = mixture.weights, mixture.found[:, 0]
    # The law's own scale multiplies E* whatever the record says.
    std = np.hypot(np.sqrt(mixture.covariance[:, 0, 0]), beliefs.law_std * moduli)
    left = 1 - relaxed_share(beliefs.at_s, fractions=mixture.amplitudes.T, times_s=tau)
    now, *interval = (_quantile(weights, moduli, std, p) for p in LEVELS)
    later, *later_interval = (_quantile(weights, moduli * left, std * left, p) for p in LEVELS)
    taken = np.quantile(mixture.taken, LEVELS, weights=weights, method="inverted_cdf").tolist()
    contact = _moments(weights, mixture.found[:, 1], mixture.covariance[:, 1, 1])
    ratio = _moments(weights, nu[mixture.law], 0.0)
    return RelaxationFit(
        reduced_modulus_pa=now,
        reduced_modulus_std_pa=_moments(weights, moduli, std**2)[1],
        reduced_modulus_interval_pa=tuple(interval),
        later_reduced_modulus_pa=later,
        later_reduced_modulus_interval_pa=tuple(later_interval),
        later_s=beliefs.at_s,
        relaxed_share=taken[0],
        relaxed_share_interval=tuple(taken[1:]),
        times_s=tuple(tau.tolist()),
        fractions=tuple((weights @ mixture.amplitudes).tolist()),
        contact_depth_m=contact[0],
        contact_depth_std_m=contact[1],
        poisson_ratio=ratio[0],
        poisson_ratio_std=ratio[1],
        law_growth=float(weights @ mixture.found[:, 2]),
        log_evidence=mixture.log_evidence,
        chi_square_per_sample=float(mixture.chi_square.min() / _freedom(record)),
        rms_n=float(np.sqrt(np.mean(np.square(weights @ mixture.residual_n)))),
    )


def _moments(weights: NDArray, means: NDArray, variances: NDArray | float) -> tuple[float, float]:
    """Mean and standard deviation of a mixture."""
    mean = float(weights @ means)
    return mean, float(np.sqrt(weights @ (variances + (means - mean) ** 2)))


def _quantile(weights: NDArray, means: NDArray, stds: NDArray, level: float) -> float:
    """Quantile of a mixture of normal distributions."""
    ends = float((means - 9 * stds).min()), float((means + 9 * stds).max())
    return float(brentq(lambda z: weights @ ndtr((z - means) / stds) - level, *ends))


def _check(record: Record) -> None:
    found = int((record.depth_m > 0).sum())
    if found < FEWEST_IN_CONTACT:
        raise ValueError(f"depth_m: expected at least 4 samples in contact, found {found}")
    for name in ("frame_std_m", "contact_std_m", "force_std_n"):
        if not getattr(record, name) > 0:
            raise ValueError(f"{name}: expected above 0, found {getattr(record, name):g}")
