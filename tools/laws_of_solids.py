"""Laws that soft solids follow and the estimate does not know, of equal E and nu at small strain.

Energy and stress in closed form; the tangent is a central difference of the stress.
"""

import numpy as np
from palpate.solid.laws import BLATZ_KO, NEO_HOOKEAN, Law, unit_lame

STEP = 1e-6


def isochoric(name, energy, slopes):
    """mu f(I1' - 3, I2' - 3) + K/2 (J - 1)^2, with the invariants of the isochoric part."""

    def parts(F):
        C, J = np.swapaxes(F, -1, -2) @ F, np.linalg.det(F)
        I1 = np.trace(C, axis1=-2, axis2=-1)
        I2 = (I1**2 - np.einsum("...ij,...ji->...", C, C)) / 2
        return C, J, I1, I2, J ** (-2 / 3) * I1 - 3, J ** (-4 / 3) * I2 - 3

    def W(F, nu):
        lam, mu = unit_lame(nu)
        _, J, _, _, a, b = parts(F)
        return mu * energy(a, b) + (lam / 2 + mu / 3) * (J - 1) ** 2

    def P(F, nu):
        lam, mu = unit_lame(nu)
        C, J, I1, I2, a, b = parts(F)
        first, second = slopes(a, b)
        J, I1, I2, first, second = (x[..., None, None] for x in (J, I1, I2, first, second))
        g = np.swapaxes(np.linalg.inv(F), -1, -2)
        stress = first * J ** (-2 / 3) * (2 * F - 2 / 3 * I1 * g)
        stress = stress + second * J ** (-4 / 3) * (2 * I1 * F - 2 * F @ C - 4 / 3 * I2 * g)
        return mu * stress + (lam + 2 * mu / 3) * (J - 1) * J * g

    return Law(name, W, P, differences(P))


def hill_foam(alpha):
    """Hill and Storakers' foam with one exponent: 2 mu/alpha^2 (sum l^alpha - 3 + vol(J))."""

    def split(F, nu):
        squares, axes = np.linalg.eigh(np.swapaxes(F, -1, -2) @ F)
        return np.sqrt(squares), axes, np.linalg.det(F), nu / (1 - 2 * nu)

    def W(F, nu):
        stretch, _, J, beta = split(F, nu)
        volume = np.expm1(-alpha * beta * np.log(J)) / beta if beta else -alpha * np.log(J)
        return 2 * unit_lame(nu)[1] / alpha**2 * ((stretch**alpha).sum(axis=-1) - 3 + volume)

    def P(F, nu):
        stretch, axes, J, beta = split(F, nu)
        pull = F @ (axes * stretch[..., None, :] ** (alpha - 2)) @ np.swapaxes(axes, -1, -2)
        g = np.swapaxes(np.linalg.inv(F), -1, -2)
        push = (J ** (-alpha * beta))[..., None, None] * g
        return 2 * unit_lame(nu)[1] / alpha * (pull - push)

    return Law(f"hill_{alpha:g}", W, P, differences(P))


def log_volume():
    """mu/2 (I1 - 3) - mu ln J + lambda/2 (ln J)^2."""

    def W(F, nu):
        lam, mu = unit_lame(nu)
        log_J = np.log(np.linalg.det(F))
        return mu / 2 * ((F**2).sum(axis=(-2, -1)) - 3) - mu * log_J + lam / 2 * log_J**2

    def P(F, nu):
        lam, mu = unit_lame(nu)
        g = np.swapaxes(np.linalg.inv(F), -1, -2)
        return mu * (F - g) + lam * np.log(np.linalg.det(F))[..., None, None] * g

    return Law("neo_hookean_log", W, P, differences(P))


def differences(stress):
    """dP/dF, (..., 3, 3, 3, 3)."""

    def tangent(F, nu):
        A = np.empty((*F.shape, 3, 3))
        for k in range(3):
            for m in range(3):
                step = np.zeros((3, 3))
                step[k, m] = STEP
                change = stress(F + step, nu) - stress(F - step, nu)
                A[..., k, m] = change / (2 * STEP)
        return A

    return tangent


def constant(first, second):
    return lambda a, b: (np.full_like(a, first), np.full_like(b, second))


# Yeoh's by the curve of natural rubber's usual ratio; Gent's with its limit at I1 - 3 = 10.
LAWS = (
    NEO_HOOKEAN,
    BLATZ_KO,
    log_volume(),
    isochoric("neo_hookean_isochoric", lambda a, b: a / 2, constant(0.5, 0.0)),
    isochoric("mooney_rivlin", lambda a, b: (a + b) / 4, constant(0.25, 0.25)),
    isochoric("yeoh", lambda a, b: a / 2 + 0.05 * a**2, lambda a, b: (0.5 + 0.1 * a, 0 * b)),
    isochoric("gent", lambda a, b: -5 * np.log1p(-a / 10), lambda a, b: (5 / (10 - a), 0 * b)),
    hill_foam(2.0),
    hill_foam(4.0),
    hill_foam(8.0),
)
POPULATION = {law.name: law for law in LAWS}
