"""Pairs of elastic moduli (Section 3.1.3)."""

import numpy as np
from numpy.typing import NDArray


def lame_from_engineering(E: float, nu: float) -> tuple[float, float]:
    """Lame parameters lam, mu [Pa] from Young's modulus [Pa] and Poisson's ratio.

    Examples
    --------
    >>> lame_from_engineering(25e3, 0.25)
    (10000.0, 10000.0)
    """
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def engineering_from_lame(lam: float, mu: float) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio from the Lame parameters [Pa].

    Examples
    --------
    >>> engineering_from_lame(10e3, 10e3)
    (25000.0, 0.25)
    """
    return mu * (2 * mu + 3 * lam) / (mu + lam), poisson_ratio(lam, mu)


def poisson_ratio(lam: float, mu: float) -> float:
    """Poisson's ratio from the Lame parameters."""
    return lam / (2 * (mu + lam))


def lame_ratio(nu: float) -> float:
    """Ratio lam / mu."""
    return 2 * nu / (1 - 2 * nu)


def lame_derivatives(E: float, nu: float) -> NDArray:
    """Derivatives of (lam, mu) with respect to (log E, nu), shape (2, 2) [Pa].

    Rows belong to lam and mu, columns to log E and nu.
    """
    lam, mu = lame_from_engineering(E, nu)
    by_nu = E * (1 + 2 * nu**2) / ((1 + nu) * (1 - 2 * nu)) ** 2
    return np.array([[lam, by_nu], [mu, -mu / (1 + nu)]])


def reduced_modulus(E: float, nu: float) -> float:
    """E* = E / (1 - nu^2) of Eq. 5.1 [Pa].

    Examples
    --------
    >>> print(f"{reduced_modulus(25e3, 0.3):.0f}")
    27473
    """
    return E / (1 - nu**2)
