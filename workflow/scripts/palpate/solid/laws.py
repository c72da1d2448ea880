"""Elastic moduli (Section 3.1.3) and hyperelastic laws of soft solids."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Below it the volumetric term of `blatz_ko` is taken at its limit, 2 ln J.
LEAST_EXPONENT = 1e-9


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


def reduced_modulus(E: float, nu: float) -> float:
    """E* = E / (1 - nu^2) of Eq. 5.1 [Pa].

    Examples
    --------
    >>> print(f"{reduced_modulus(25e3, 0.3):.0f}")
    27473
    """
    return E / (1 - nu**2)


@dataclass(frozen=True)
class Law:
    """Energy density W of the deformation gradient F, and its derivatives.

    All take F of shape (..., 3, 3) with positive determinant and Poisson's ratio, are for Young's
    modulus 1, and are objective and isotropic.

    Attributes
    ----------
    name : str
    energy : callable
        W, shape (...).
    stress : callable
        First Piola-Kirchhoff stress P = dW/dF, shape (..., 3, 3).
    tangent : callable
        A = dP/dF, shape (..., 3, 3, 3, 3): of row and column of P, then of F.
    """

    name: str
    energy: Callable[[NDArray, float], NDArray]
    stress: Callable[[NDArray, float], NDArray]
    tangent: Callable[[NDArray, float], NDArray]


def unit_lame(nu: float) -> tuple[float, float]:
    """Lame parameters (lam, mu) of Young's modulus 1.

    Raises
    ------
    ValueError
        If Poisson's ratio is not from 0 to below 0.5.
    """
    if not 0 <= nu < 0.5:
        raise ValueError(f"nu: expected from 0 to below 0.5, found {nu:g}")
    return lame_from_engineering(1.0, nu)


def _neo_hookean_energy(F: NDArray, nu: float) -> NDArray:
    lam, mu = unit_lame(nu)
    J = np.linalg.det(F)
    return 0.5 * mu * ((F**2).sum(axis=(-2, -1)) - 3) - mu * np.log(J) + 0.5 * lam * (J - 1) ** 2


def _neo_hookean_stress(F: NDArray, nu: float) -> NDArray:
    lam, mu = unit_lame(nu)
    J, g = _volume_and_cofactor(F)
    return mu * (F - g) + _scaled(lam * (J - 1) * J, g)


def _neo_hookean_tangent(F: NDArray, nu: float) -> NDArray:
    lam, mu = unit_lame(nu)
    J, g = _volume_and_cofactor(F)
    A = _crossed(_scaled(mu - lam * (J - 1) * J, g), g)
    A += _outer(_scaled(lam * (2 * J - 1) * J, g), g)
    for i in range(3):
        for k in range(3):
            A[..., i, k, i, k] += mu
    return A


def _blatz_ko_energy(F: NDArray, nu: float) -> NDArray:
    _, mu = unit_lame(nu)
    J, g = _volume_and_cofactor(F)
    beta = _exponent(nu)
    volume = np.expm1(2 * beta * np.log(J)) / beta if beta > LEAST_EXPONENT else 2 * np.log(J)
    return 0.5 * mu * ((g**2).sum(axis=(-2, -1)) - 3 + volume)


def _blatz_ko_stress(F: NDArray, nu: float) -> NDArray:
    _, mu = unit_lame(nu)
    J, g = _volume_and_cofactor(F)
    return mu * (_scaled(J ** (2 * _exponent(nu)), g) - g @ g.mT @ g)


def _blatz_ko_tangent(F: NDArray, nu: float) -> NDArray:
    _, mu = unit_lame(nu)
    J, g = _volume_and_cofactor(F)
    beta = _exponent(nu)
    power = J ** (2 * beta)
    left, right = g @ g.mT, g.mT @ g
    cubed = left @ g
    A = _outer(_scaled(2 * beta * power, g), g)
    A += _crossed(g, cubed - _scaled(power, g))
    A += _crossed(cubed, g)
    A += left[..., :, None, :, None] * right[..., None, :, None, :]
    A *= mu
    return A


def _exponent(nu: float) -> float:
    return nu / (1 - 2 * nu)


def _volume_and_cofactor(F: NDArray) -> tuple[NDArray, NDArray]:
    """J = det F and F^-T, faster than LAPACK one matrix at a time."""
    cofactors = np.empty_like(F)
    for i in range(3):
        for k in range(3):
            rows, columns = ((i + 1) % 3, (i + 2) % 3), ((k + 1) % 3, (k + 2) % 3)
            (a, b), (c, d) = ([F[..., row, column] for column in columns] for row in rows)
            cofactors[..., i, k] = a * d - b * c
    J = (F[..., 0, :] * cofactors[..., 0, :]).sum(axis=-1)
    return J, _scaled(1 / J, cofactors)


def _scaled(factor: NDArray, matrix: NDArray) -> NDArray:
    return factor[..., None, None] * matrix


def _outer(a: NDArray, b: NDArray) -> NDArray:
    """a_iJ b_kL in the place iJkL."""
    return a[..., :, :, None, None] * b[..., None, None, :, :]


def _crossed(a: NDArray, b: NDArray) -> NDArray:
    """a_iL b_kJ in the place iJkL."""
    return a[..., :, None, None, :] * b.mT[..., None, :, :, None]


# Eq. 2.2: mu/2 (I1 - 3) - mu ln J + lam/2 (J - 1)^2.
NEO_HOOKEAN = Law("neo_hookean", _neo_hookean_energy, _neo_hookean_stress, _neo_hookean_tangent)
# P. J. Blatz and W. L. Ko, Trans. Soc. Rheol. 6, 223 (1962), f = 0, for any Poisson's ratio:
# mu/2 (tr C^-1 - 3 + (J^(2 beta) - 1) / beta) with beta = nu / (1 - 2 nu); the foam law of Hill
# and Storakers with the single exponent -2.
BLATZ_KO = Law("blatz_ko", _blatz_ko_energy, _blatz_ko_stress, _blatz_ko_tangent)
LAWS = {law.name: law for law in (NEO_HOOKEAN, BLATZ_KO)}
LAW_NAMES = tuple(LAWS)
# Added to a law's name where what stands loose slides freely on its foot.
SLIDING = ", sliding"


def named_law(name: str) -> Law:
    """Law of a name.

    Raises
    ------
    ValueError
        If there is none of that name.
    """
    if name not in LAWS:
        raise ValueError(f"law: expected one of {', '.join(LAWS)}, found {name}")
    return LAWS[name]
