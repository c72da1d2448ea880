"""Instantaneous reduced modulus from a press and its hold, relaxation allowed for.

With amplitudes g_i given, the force E* R_g[law(d - c)(1 + e x)] + b (`relaxed_force` is R_g, x the
depth's part of the deepest) is linear in E*, and about a contact c nearly so in c, e and b.
The amplitudes' prior is therefore laid out as a grid of equally likely points; at each of them
weighted least squares gives the rest and how well the record bears the point. What comes out is
a mixture of normal distributions, with its quantiles.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import logsumexp, ndtr

from palpate.estimate.hertz import CONFIDENCE, Law
from palpate.estimate.hertz_record import Record
from palpate.estimate.relaxation import relaxed_force, relaxed_share
from palpate.estimate.relaxation_prior import amplitude_grid

ROUNDS = 12
# The contact is moved by no more than this part of the deepest depth in one round.
LARGEST_MOVE = 0.1
CONVERGED = 1e-6
STEP = 1e-6
# Ratio of likelihoods from which evidence is called positive (Kass and Raftery, JASA 90, 1995).
POSITIVE = float(np.log(3))


@dataclass(frozen=True)
class Beliefs:
    """What is held likely before a record is seen.

    Attributes
    ----------
    share : float
        Scale of the half-normal prior of the whole relaxed share; any split of it among the
        relaxation times is as likely as any other.
    none : float
        Probability that the material does not relax at all, from 0 to below 1.
    law_std : float
        Standard deviation of the law's relative error, and of its growth over the press.
    at_s : float
        Time after a step at which the modulus is also stated [s].
    """

    share: float
    none: float
    law_std: float
    at_s: float


@dataclass(frozen=True)
class RelaxationFit:
    """Medians, 95 % intervals and what they rest on.

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
    law_growth : float
        Mean of the law's error that grows over the press.
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
    law_growth: float
    log_evidence: float
    chi_square_per_sample: float
    rms_n: float


@dataclass(frozen=True)
class _Mixture:
    """Log likelihoods and weights (g,) of the grid's points, and least squares at each."""

    amplitudes: NDArray
    log_likelihood: NDArray
    weights: NDArray
    found: NDArray
    covariance: NDArray
    chi_square: NDArray
    forces_n: NDArray
    taken: NDArray


def fit_relaxation(
    record: Record, law: Law, *, times_s: NDArray, beliefs: Beliefs
) -> RelaxationFit:
    """Fit E*, contact and relaxation to a press and its hold.

    Parameters
    ----------
    record : Record
    law : callable
        Force per reduced modulus over depth (`contact_law`).
    times_s : (p,) array
        Relaxation times to choose among (`relaxation_times`) [s].
    beliefs : Beliefs

    Raises
    ------
    ValueError
        If fewer than four samples are in contact, or a stated error is not positive.
    """
    _check(record, law)
    contact, modulus = 0.0, _modulus(record, law, 0.0)
    for _ in range(ROUNDS):
        mixture = _mixture(record, law, np.asarray(times_s), beliefs, contact, modulus)
        mean = mixture.weights @ mixture.found
        largest = LARGEST_MOVE * float(record.depth_m.max())
        contact += float(np.clip(mean[1], -largest, largest))
        modulus = max(float(mean[0]), 0.1 * modulus)
        if abs(mean[1]) < CONVERGED * record.depth_m.max():
            break
    return _summary(record, mixture, np.asarray(times_s), beliefs, contact)


def with_other_shares(
    record: Record, law: Law, *, times_s: NDArray, beliefs: Beliefs, factors: tuple[float, ...]
) -> list[dict]:
    """Instantaneous E* with the prior's scale multiplied: what the prior alone decides.

    Returns
    -------
    list of dict
        ``share``, ``reduced_modulus_pa`` and its interval for each factor.
    """
    rows = []
    for factor in factors:
        other = replace(beliefs, share=factor * beliefs.share)
        fit = fit_relaxation(record, law, times_s=times_s, beliefs=other)
        rows.append(
            {
                "share": other.share,
                "reduced_modulus_pa": fit.reduced_modulus_pa,
                "reduced_modulus_interval_pa": fit.reduced_modulus_interval_pa,
            }
        )
    return rows


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


def _mixture(
    record: Record, law: Law, tau: NDArray, beliefs: Beliefs, contact: float, modulus: float
) -> _Mixture:
    """Least squares in E*, the contact's change, the law's growth and the force's zero."""
    grid = amplitude_grid(len(tau), scale=beliefs.share)
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
    residual = wanted - np.einsum("gnk,gk->gn", design, found)
    off = found - centre
    chi_square = (residual**2).sum(1) + ((off @ precision) * off).sum(1)
    excess = max(chi_square.min() / _freedom(record), 1)
    log_likelihood = -0.5 * (chi_square / excess + np.linalg.slogdet(normal)[1])
    prior = np.full(len(grid), (1 - beliefs.none) / (len(grid) - 1))
    prior[0] = beliefs.none
    weights = prior * np.exp(log_likelihood - log_likelihood.max())
    taken = 1 - relaxed[:, record.deepest, 0] / columns[record.deepest, 0]
    covariance = np.linalg.inv(normal) * excess
    weights /= weights.sum()
    return _Mixture(
        grid, log_likelihood, weights, found, covariance, chi_square, residual * std, taken
    )


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
    # What one term of half the modulus leaves is 1 - its share of the loss.
    lost = [
        2 * (columns - relaxed_force(time, columns, fractions=[0.5], times_s=[one])) for one in tau
    ]
    return columns - np.tensordot(grid, np.array(lost), 1)


def _summary(
    record: Record, mixture: _Mixture, tau: NDArray, beliefs: Beliefs, contact: float
) -> RelaxationFit:
    weights, mean = mixture.weights, mixture.weights @ mixture.found
    moduli = mixture.found[:, 0]
    # The law's own scale multiplies E* whatever the record says.
    std = np.hypot(np.sqrt(mixture.covariance[:, 0, 0]), beliefs.law_std * moduli)
    left = 1 - relaxed_share(beliefs.at_s, fractions=mixture.amplitudes.T, times_s=tau)
    level = np.array([0.5, (1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    now = [_quantile(weights, moduli, std, p) for p in level]
    later = [_quantile(weights, moduli * left, std * left, p) for p in level]
    taken = np.quantile(mixture.taken, level, weights=weights, method="inverted_cdf")
    contact_variance = weights @ (
        mixture.covariance[:, 1, 1] + (mixture.found[:, 1] - mean[1]) ** 2
    )
    relaxing, none = mixture.log_likelihood[1:], mixture.log_likelihood[0]
    return RelaxationFit(
        reduced_modulus_pa=now[0],
        reduced_modulus_std_pa=float(np.sqrt(weights @ (std**2 + (moduli - mean[0]) ** 2))),
        reduced_modulus_interval_pa=(now[1], now[2]),
        later_reduced_modulus_pa=later[0],
        later_reduced_modulus_interval_pa=(later[1], later[2]),
        later_s=beliefs.at_s,
        relaxed_share=float(taken[0]),
        relaxed_share_interval=(float(taken[1]), float(taken[2])),
        times_s=tuple(tau.tolist()),
        fractions=tuple((weights @ mixture.amplitudes).tolist()),
        contact_depth_m=contact,
        contact_depth_std_m=float(np.sqrt(contact_variance)),
        law_growth=float(mean[2]),
        log_evidence=float(logsumexp(relaxing) - np.log(len(relaxing)) - none),
        chi_square_per_sample=float(mixture.chi_square.min() / _freedom(record)),
        rms_n=float(np.sqrt(np.mean(np.square(weights @ mixture.forces_n)))),
    )


def _quantile(weights: NDArray, means: NDArray, stds: NDArray, level: float) -> float:
    """Quantile of a mixture of normal distributions."""
    ends = [float((means + side * 9 * stds).min()) for side in (-1, 1)]
    ends[1] = float((means + 9 * stds).max())
    return float(brentq(lambda z: weights @ ndtr((z - means) / stds) - level, *ends))


def _freedom(record: Record) -> int:
    """Each unknown with a prior brings its own row; E* and the whole share do not."""
    return max(len(record.force_n) - 2, 1)


def _modulus(record: Record, law: Law, contact: float) -> float:
    unit = law(record.depth_m - contact)
    return float(unit @ record.force_n / (unit @ unit))


def _check(record: Record, law: Law) -> None:
    found = int((law(record.depth_m) > 0).sum())
    if found < 4:
        raise ValueError(f"depth_m: expected at least 4 samples in contact, found {found}")
    for name in ("frame_std_m", "contact_std_m", "force_std_n"):
        if not getattr(record, name) > 0:
            raise ValueError(f"{name}: expected above 0, found {getattr(record, name):g}")
