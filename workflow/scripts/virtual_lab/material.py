"""Materials of the lab's objects: hyperelastic laws and their relaxation."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

GENT_LIMIT, HILL_EXPONENT = 10.0, 8.0
# Squares of stretches so near to each other are one.
SAME = 1e-5

Law = Callable[[NDArray], tuple[NDArray, NDArray, NDArray]]


def lame(E: float, nu: float) -> tuple[float, float]:
    """Lame parameters of small strains [Pa]."""
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
        J, G, GT = _inverse(F)
        W = mu / 2 * ((F**2).sum(axis=(-2, -1)) - 3) - mu * np.log(J) + lam / 2 * (J - 1) ** 2
        p = lam * J * (J - 1)
        q = lam * J * (2 * J - 1)
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

    Parameters and result as of `neo_hookean`, but nu > 0.
    """
    lam, mu = lame(E, nu)
    beta = lam / (2 * mu)

    def law(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        J, G, GT = _inverse(F)
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


def gent(E: float, nu: float) -> Law:
    """Rubber of Gent 1996, whose chains are stretched out where I1' - 3 comes to 10.

    W = -5 mu ln(1 - (I1' - 3)/10) + K/2 (J - 1)^2, with I1' of the isochoric part.

    Parameters and result as of `neo_hookean`.
    """
    lam, mu = lame(E, nu)
    K = lam + 2 * mu / 3

    def law(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        J, G, GT = _inverse(F)
        shrunk, I1 = J ** (-2 / 3), (F**2).sum(axis=(-2, -1))
        stretched = shrunk * I1 - 3
        if stretched.max() >= GENT_LIMIT:
            raise FloatingPointError("the chains are stretched out")
        left = 1 - stretched / GENT_LIMIT
        W = -mu / 2 * GENT_LIMIT * np.log(left) + K / 2 * (J - 1) ** 2
        J, I1, shrunk, left = (x[..., None, None] for x in (J, I1, shrunk, left))
        first, second = mu / 2 / left, mu / 2 / GENT_LIMIT / left**2
        D = shrunk * (2 * F - 2 / 3 * I1 * GT)
        P = first * D + K * J * (J - 1) * GT
        turned = np.einsum("...Jk,...Li->...iJkL", G, G)
        A = _outer(D, second * D - 2 / 3 * first * GT)
        A += _outer(GT, K * J * (2 * J - 1) * GT - 4 / 3 * first * shrunk * F)
        A += (2 / 3 * first * shrunk * I1 - K * J * (J - 1))[..., None, None] * turned
        A += (2 * first * shrunk)[..., None, None] * np.einsum("ik,JL->iJkL", np.eye(3), np.eye(3))
        return W, P, A

    return law


def hill_foam(E: float, nu: float) -> Law:
    """Foam of Hill 1978 and Storakers 1986 with the one exponent 8, which yields in compression.

    W = 2 mu/a^2 [sum l^a - 3 + (J^(-a beta) - 1)/beta], with stretches l and beta as `blatz_ko`:
    in compression the stress comes to a plateau, as cells that buckle.

    Parameters and result as of `neo_hookean`.
    """
    lam, mu = lame(E, nu)
    a, beta = HILL_EXPONENT, lam / (2 * mu)

    def law(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        J, G, GT = _inverse(F)
        squares, N = np.linalg.eigh(np.swapaxes(F, -2, -1) @ F)
        n, grown = F @ N, np.log(J)
        volume = np.expm1(-a * beta * grown) / beta if beta else -a * grown
        W = 2 * mu / a**2 * ((squares ** (a / 2)).sum(axis=-1) - 3 + volume)
        pull = (N * squares[..., None, :] ** (a / 2 - 1)) @ np.swapaxes(N, -2, -1)
        push = (J ** (-a * beta))[..., None, None]
        P = 2 * mu / a * (F @ pull - push * GT)
        slopes = _divided(squares, a / 2 - 1)
        A = np.einsum("ik,...JL->...iJkL", np.eye(3), pull)
        for one, other in (("Lb", "ka"), ("La", "kb")):
            indices = f"...ab,...ia,...Jb,...{one},...{other}->...iJkL"
            A = A + np.einsum(indices, slopes, n, N, N, n, optimize=True)
        push = push[..., None, None]
        A += push * np.einsum("...Jk,...Li->...iJkL", G, G)
        A += a * beta * push * _outer(GT, GT)
        return W, P, 2 * mu / a * A

    return law


def _inverse(F: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Determinants (...), inverses and their transposes (..., 3, 3)."""
    J = np.linalg.det(F)
    if J.min() <= 0:
        raise FloatingPointError("an element is turned inside out")
    G = np.linalg.inv(F)
    return J, G, np.swapaxes(G, -2, -1)


def _outer(left: NDArray, right: NDArray) -> NDArray:
    """left_iJ right_kL, (..., i, J, k, L)."""
    return left[..., :, :, None, None] * right[..., None, None, :, :]


def _divided(c: NDArray, power: float) -> NDArray:
    """(c_a^power - c_b^power)/(c_a - c_b), or the slope where both are one, (..., 3, 3)."""
    first, second = np.broadcast_arrays(c[..., :, None], c[..., None, :])
    apart, mean = first - second, (first + second) / 2
    same = np.abs(apart) < SAME * mean
    slope = power * mean ** (power - 1)
    return np.where(same, slope, (first**power - second**power) / np.where(same, 1, apart))


LAWS = {law.__name__: law for law in (neo_hookean, blatz_ko, gent, hill_foam)}


def relaxed_force(
    time_s: NDArray,
    elastic_force_n: NDArray,
    *,
    fractions: Sequence[float],
    times_s: Sequence[float],
) -> NDArray:
    """Hereditary integral of a Prony series over the elastic force, (n,) [N].

    G(t) = 1 - sum g_i (1 - exp(-t / tau_i)), as part of the instantaneous modulus; exact for an
    elastic force that is linear between the samples.

    Parameters
    ----------
    time_s : (n,) array
        Increasing times [s].
    elastic_force_n : (n,) array
        Force that the instantaneous modulus would give [N].
    fractions, times_s : sequences of float
        g_i and tau_i [s].
    """
    force = np.asarray(elastic_force_n) * (1 - sum(fractions))
    steps, changes = np.diff(time_s), np.diff(elastic_force_n)
    for fraction, tau in zip(fractions, times_s, strict=True):
        decay = np.exp(-steps / tau)
        gain = fraction * changes * (1 - decay) * tau / steps
        part = np.zeros(len(time_s))
        part[0] = fraction * elastic_force_n[0]
        for k in range(len(steps)):
            part[k + 1] = decay[k] * part[k] + gain[k]
        force = force + part
    return force
