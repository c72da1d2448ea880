"""Hyperelastic laws of the lab's objects."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Law = Callable[[NDArray], tuple[NDArray, NDArray, NDArray]]


def lame(E: float, nu: float) -> tuple[float, float]:
    """Lame parameters of small strains [Pa].

    Raises
    ------
    ValueError
        If E is not positive or nu outside [0, 0.5).
    """
    if not E > 0:
        raise ValueError(f"youngs_modulus_pa: expected a number > 0, found {E}")
    if not 0 <= nu < 0.5:
        raise ValueError(f"poisson_ratio: expected 0 <= nu < 0.5, found {nu}")
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def neo_hookean(E: float, nu: float) -> Law:
    """Compressible neo-Hookean law of Eq. 2.2.

    W = mu/2 (I1 - 3) - mu ln J + lam/2 (J - 1)^2, with the Lame parameters of small strains.

    Parameters
    ----------
    E, nu : float
        Young's modulus [Pa] and Poisson's ratio at small strain.

    Returns
    -------
    callable
        Takes deformation gradients F (..., 3, 3); gives the energy density W (...) [Pa], the first
        Piola-Kirchhoff stress P (..., 3, 3) [Pa] and its derivative dP_iJ/dF_kL
        (..., i, J, k, L) [Pa].
    """
    lam, mu = lame(E, nu)

    def law(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        J = np.linalg.det(F)
        if J.min() <= 0:
            raise FloatingPointError("an element is turned inside out")
        G = np.linalg.inv(F)
        W = mu / 2 * ((F**2).sum(axis=(-2, -1)) - 3) - mu * np.log(J) + lam / 2 * (J - 1) ** 2
        p = lam * J * (J - 1)
        q = lam * J * (2 * J - 1)
        GT = np.swapaxes(G, -2, -1)
        P = mu * (F - GT) + p[..., None, None] * GT
        A = np.einsum("...Ji,...Lk->...iJkL", G, G) * q[..., None, None, None, None]
        A += np.einsum("...Jk,...Li->...iJkL", G, G) * (mu - p)[..., None, None, None, None]
        A += mu * np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
        return W, P, A

    return law


def blatz_ko(E: float, nu: float) -> Law:
    """Foam law of Blatz and Ko 1962 with their f = 0 (polyurethane foam).

    W = mu/2 [I2/I3 - 3 + (J^(2 beta) - 1)/beta] with beta = nu/(1 - 2 nu): the law of Ogden and
    Hill with the one exponent -2. It stiffens in compression.

    Parameters
    ----------
    E, nu : float
        Young's modulus [Pa] and Poisson's ratio at small strain; nu > 0.

    Returns
    -------
    callable
        As `neo_hookean`.
    """
    lam, mu = lame(E, nu)
    if not lam > 0:
        raise ValueError(f"poisson_ratio: expected 0 < nu < 0.5 for blatz_ko, found {nu}")
    beta = lam / (2 * mu)

    def law(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        J = np.linalg.det(F)
        if J.min() <= 0:
            raise FloatingPointError("an element is turned inside out")
        G = np.linalg.inv(F)
        GT = np.swapaxes(G, -2, -1)
        M, B = G @ GT, GT @ G
        N, power = GT @ M, (J ** (2 * beta))[..., None, None]
        W = mu / 2 * (np.trace(M, axis1=-2, axis2=-1) - 3 + (power[..., 0, 0] - 1) / beta)
        P = mu * (power * GT - N)
        power = power[..., None, None]
        A = np.einsum("...Li,...kJ->...iJkL", G, N) + np.einsum("...iL,...Jk->...iJkL", N, G)
        A += np.einsum("...ik,...JL->...iJkL", B, M)
        A += 2 * beta * power * np.einsum("...Ji,...Lk->...iJkL", G, G)
        A -= power * np.einsum("...Jk,...Li->...iJkL", G, G)
        return W, P, mu * A

    return law


LAWS = {"neo_hookean": neo_hookean, "blatz_ko": blatz_ko}
