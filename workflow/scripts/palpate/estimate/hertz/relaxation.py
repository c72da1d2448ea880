"""Instantaneous reduced modulus from a press and its hold, relaxation allowed for."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

from palpate.estimate.hertz.fit import Law
from palpate.estimate.hertz.indentation import Record
from palpate.estimate.hertz.mixture import Mixture, freedom, joined, settled
from palpate.estimate.hertz.options import Beliefs
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import CONFIDENCE

# Median and ends of the interval.
LEVELS = (0.5, (1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)
# Ratio of likelihoods from which evidence is called positive (Kass and Raftery, JASA 90, 1995).
POSITIVE = float(np.log(3))

Laws = Mapping[float, Law]


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
    poisson_ratio, poisson_ratio_std : float
        Mean and standard deviation among the laws' ratios: what the force alone says of nu.
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
    poisson_ratio: float
    poisson_ratio_std: float
    law_growth: float
    log_evidence: float
    chi_square_per_sample: float
    rms_n: float


def fit_relaxation(
    record: Record, laws: Laws, *, times_s: NDArray, beliefs: Beliefs
) -> RelaxationFit:
    """Fit E*, contact and relaxation to a press and its hold.

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
    parts = [settled(record, law, times, beliefs) for law in laws.values()]
    return _summary(record, joined(record, parts, beliefs), np.array(list(laws)), times, beliefs)


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


def _summary(
    record: Record, mixture: Mixture, nu: NDArray, tau: NDArray, beliefs: Beliefs
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
        chi_square_per_sample=float(mixture.chi_square.min() / freedom(record)),
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
    if found < 4:
        raise ValueError(f"depth_m: expected at least 4 samples in contact, found {found}")
    for name in ("frame_std_m", "contact_std_m", "force_std_n"):
        if not getattr(record, name) > 0:
            raise ValueError(f"{name}: expected above 0, found {getattr(record, name):g}")
