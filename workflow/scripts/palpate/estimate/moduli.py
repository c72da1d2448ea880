"""Pairs of elastic moduli (Section 3.1.3)."""


def lame_from_engineering(E: float, nu: float) -> tuple[float, float]:
    """Lame parameters lam, mu [Pa] from Young's modulus [Pa] and Poisson's ratio."""
    return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))


def engineering_from_lame(lam: float, mu: float) -> tuple[float, float]:
    """Young's modulus [Pa] and Poisson's ratio from the Lame parameters [Pa]."""
    return mu * (2 * mu + 3 * lam) / (mu + lam), lam / (2 * (mu + lam))


def reduced_modulus(E: float, nu: float) -> float:
    """E* = E / (1 - nu^2) of Eq. 5.1 [Pa]."""
    return E / (1 - nu**2)
