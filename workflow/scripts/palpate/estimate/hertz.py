"""Hertz's contact of a rigid sphere and a half-space (Section 5.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, minimize
from scipy.stats import t as student

CONFIDENCE = 0.95
TOLERANCE = 1e-10


# How far from the surface a press may begin: tracking, frame rate and clocks leave a few mm [m].
FARTHEST_ONSET_M = 0.005


@dataclass(frozen=True)
class HertzRange:
    """Samples used for the fit: from the onset of force to the end of deformation, inclusive."""

    start: int
    stop: int


@dataclass(frozen=True)
class StudyFit:
    """Fit of the coefficient alone, as the study does it.

    Attributes
    ----------
    reduced_modulus_pa : float
        E* [Pa].
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    rms_n: float


@dataclass(frozen=True)
class ContactFit:
    """Fit with the contact point free.

    Attributes
    ----------
    reduced_modulus_pa, reduced_modulus_std_pa : float
        E* and its standard error [Pa].
    reduced_modulus_interval_pa : (float, float)
        Confidence interval of 95 % [Pa], for independent residuals of equal variance.
    contact_depth_m, contact_depth_std_m : float
        Depth at which contact begins [m].
    baseline_n : float
        Constant force before contact [N].
    rms_n : float
        Root mean square of the force residual [N].
    """

    reduced_modulus_pa: float
    reduced_modulus_std_pa: float
    reduced_modulus_interval_pa: tuple[float, float]
    contact_depth_m: float
    contact_depth_std_m: float
    baseline_n: float
    rms_n: float


def hertz_force(depth_m: NDArray, E_star: float, radius_m: float) -> NDArray:
    """Force of Eq. 5.1, F = 4/3 E* R^(1/2) u^(3/2), zero before contact [N]."""
    return 4 / 3 * E_star * np.sqrt(radius_m) * np.maximum(depth_m, 0) ** 1.5


def force_onset(force_n: NDArray, *, onset_force_n: float) -> int:
    """First sample of the loading from which the force stays above a threshold.

    Parameters
    ----------
    force_n : (n,) array
        Magnitude of the force [N].
    onset_force_n : float
        Smallest force that counts as contact [N].

    Raises
    ------
    ValueError
        If the force never exceeds the threshold, or does so from the first sample.
    """
    peak = int(np.argmax(force_n))
    if force_n[peak] <= onset_force_n:
        found = f"{force_n[peak]:.3g}"
        raise ValueError(f"force: expected above {onset_force_n:g} N, found at most {found} N")
    below = np.flatnonzero(force_n[:peak] <= onset_force_n)
    if not len(below):
        raise ValueError("force: expected samples before contact, found contact from the first")
    return int(below[-1]) + 1


def hertz_range(force_n: NDArray, *, onset_force_n: float) -> HertzRange:
    """Samples from the onset of force to where it starts to fall (Section 5.1)."""
    return HertzRange(force_onset(force_n, onset_force_n=onset_force_n), int(np.argmax(force_n)))


def check_contact(depth_m: NDArray, onset: int) -> None:
    """Refuse a press whose force begins elsewhere than at the surface.

    Parameters
    ----------
    depth_m : (n,) array
        Depth of the sphere's lowest point below the undeformed surface in each frame [m].
    onset : int
        First frame with force.

    Raises
    ------
    ValueError
        If the tip is then more than 5 mm from the surface.
    """
    if abs(depth_m[onset]) > FARTHEST_ONSET_M:
        place = "below" if depth_m[onset] > 0 else "above"
        raise ValueError(
            f"depth: expected the tip within {FARTHEST_ONSET_M * 1e3:g} mm of the surface when the"
            f" force begins, found it {abs(depth_m[onset]) * 1e3:.1f} mm {place} in frame {onset}"
            " (square_m and transforms of the probe, optics, clocks?)"
        )


def fit_study(depth_m: NDArray, force_n: NDArray, radius_m: float) -> StudyFit:
    """Fit E* by Nelder-Mead on the squared force residuals, contact point taken as known.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth below the undeformed surface [m] and force [N] of the samples in range.
    radius_m : float

    Raises
    ------
    ValueError
        If there are fewer than two samples in contact.
    """
    if (depth_m > 0).sum() < 2:
        found = int((depth_m > 0).sum())
        raise ValueError(f"depth: expected at least 2 samples in contact, found {found}")
    unit = hertz_force(depth_m, 1.0, radius_m)
    start = float(unit @ force_n / (unit @ unit))
    scale = float(force_n @ force_n)

    def cost(x: NDArray) -> float:
        residual = x[0] * start * unit - force_n
        return float(residual @ residual) / scale

    options = {"xatol": TOLERANCE, "fatol": TOLERANCE**2}
    found = minimize(cost, [1.1], method="Nelder-Mead", options=options)
    E_star = float(found.x[0]) * start
    return StudyFit(E_star, _rms(E_star * unit - force_n))


def fit_free_contact(
    depth_m: NDArray, force_n: NDArray, radius_m: float, *, baseline: bool = False
) -> ContactFit:
    """Fit E* and the depth of first contact by least squares.

    Assumes Eq. 5.1 and independent residuals of equal variance.

    Parameters
    ----------
    depth_m, force_n : (n,) arrays
        Depth along the approach [m] and force [N]; samples before contact help.
    radius_m : float
    baseline : bool
        Fit a constant force too.

    Raises
    ------
    ValueError
        If there are no more samples than parameters.
    """
    count = 3 if baseline else 2
    if len(force_n) <= count:
        raise ValueError(f"samples: expected more than {count}, found {len(force_n)}")
    length, force_scale = float(np.ptp(depth_m)), float(np.ptp(force_n))
    modulus = force_scale / float(hertz_force(np.array(length), 1.0, radius_m))

    def residual(x: NDArray) -> NDArray:
        shifted = depth_m - x[1] * length
        level = x[2] * force_scale if baseline else 0.0
        force = hertz_force(shifted, np.exp(x[0]) * modulus, radius_m) + level
        return (force - force_n) / force_scale

    starts = [np.r_[0.0, place, [0.0] * baseline] for place in _contact_guesses(depth_m, force_n)]
    fits = [
        least_squares(residual, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
        for start in starts
    ]
    best = min(fits, key=lambda fit: fit.cost)
    E_star = float(np.exp(best.x[0])) * modulus
    std = _standard_errors(best.jac, best.fun)
    width = student.ppf((1 + CONFIDENCE) / 2, len(force_n) - count) * std[0]
    return ContactFit(
        reduced_modulus_pa=E_star,
        reduced_modulus_std_pa=E_star * float(std[0]),
        reduced_modulus_interval_pa=(
            E_star * float(np.exp(-width)),
            E_star * float(np.exp(width)),
        ),
        contact_depth_m=float(best.x[1]) * length,
        contact_depth_std_m=float(std[1]) * length,
        baseline_n=float(best.x[2]) * force_scale if baseline else 0.0,
        rms_n=_rms(best.fun) * force_scale,
    )


def _contact_guesses(depth_m: NDArray, force_n: NDArray) -> list[float]:
    """Places of first contact to start from, as parts of the depth's range."""
    length = np.ptp(depth_m)
    risen = np.flatnonzero(force_n > force_n.min() + 0.05 * np.ptp(force_n))
    first = depth_m[risen[0]] if len(risen) else depth_m.min()
    return [(first - back * length) / length for back in (0.0, 0.1, 0.3)]


def _standard_errors(jacobian: NDArray, residual: NDArray) -> NDArray:
    freedom = len(residual) - jacobian.shape[1]
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * (residual @ residual) / freedom
    return np.sqrt(np.diag(covariance))


def _rms(residual: NDArray) -> float:
    return float(np.sqrt(np.mean(np.square(residual))))
