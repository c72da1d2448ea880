"""Mixture of normal distributions that a press and its hold leave of modulus and contact.

With amplitudes g_i given, the force E* R_g[law(d - c)(1 + e x)] + b (`relaxed_force` is R_g, x the
depth's part of the deepest) is linear in E*, and about a contact c nearly so in c, e and b.
The amplitudes' prior is therefore laid out as a grid of equally likely points; at each of them
weighted least squares gives the rest and how well the record bears the point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from palpate.estimate.hertz.fit import Law
from palpate.estimate.hertz.indentation import Record
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.hertz.relaxation_prior import amplitude_grid
from palpate.estimate.relaxation import relaxed_force

ROUNDS = 12
# The contact is moved by no more than this part of the deepest depth in one round.
LARGEST_MOVE = 0.1
# Nor beyond this part of it.
LATEST = 0.9
CONVERGED = 1e-6
STEP = 1e-6


@dataclass(frozen=True)
class Mixture:
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
        E* [Pa], contact [m], the law's growth and the force's zero [N].
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


def settled(record: Record, law: Law, times_s: NDArray, beliefs: Beliefs) -> Mixture:
    """Mixture of one law, linear about the contact that it comes to itself.

    Parameters
    ----------
    record : Record
    law : callable
        Force per reduced modulus over depth.
    times_s : (p,) array
        Relaxation times [s].
    beliefs : Beliefs
    """
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


def joined(record: Record, parts: Sequence[Mixture], beliefs: Beliefs) -> Mixture:
    """Mixture of several laws, each as likely as the others before the record is seen."""
    whole = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in Mixture.__dataclass_fields__
    }
    whole["law"] = np.repeat(np.arange(len(parts)), [len(part.law) for part in parts])
    # Each law has scaled its scatter to its own best point.
    best = min(_excess(record, part.chi_square) for part in parts)
    scale = [_excess(record, part.chi_square) / best for part in parts]
    whole["covariance"] = whole["covariance"] / np.array(scale)[whole["law"], None, None]
    whole["log_likelihood"] = _log_likelihood(whole["chi_square"], whole["covariance"], best)
    whole["weights"] = _weights(whole["log_likelihood"], whole["amplitudes"], beliefs)
    return Mixture(**whole)


def freedom(record: Record) -> int:
    """Degrees of freedom: all unknowns bring a row of their prior but E* and the whole share."""
    return max(len(record.force_n) - 2, 1)


def _linear(
    record: Record, law: Law, tau: NDArray, beliefs: Beliefs, contact: float, modulus: float
) -> Mixture:
    """Least squares in E*, the contact, the law's growth and the force's zero."""
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
    residual, off = wanted - np.einsum("gnk,gk->gn", design, found), found - centre
    chi_square = (residual**2).sum(1) + ((off @ precision) * off).sum(1)
    excess = _excess(record, chi_square)
    covariance = np.linalg.inv(normal) * excess
    likelihood = _log_likelihood(chi_square, covariance, excess)
    return Mixture(
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
    return max(float(chi_square.min()) / freedom(record), 1.0)


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
