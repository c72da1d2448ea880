"""Moduli as functions of an estimate's unknowns, and the one that hangs least on the law.

E* and E at small strain are told by the first millimetre, and carry the whole doubt of the law. The
neo-Hookean solid that answers with the same force at one greater depth is known much better.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import SHARED
from palpate.estimate.direct.options import Fit
from palpate.estimate.relaxation import relaxed_share
from palpate.modulus import LABELS

# Places of unknowns in a solution's vector.
LOG_E, NU, FORCE_LAW, MOTION_LAW = range(4)
ONE_SECOND_S = 1.0
# Mean strain of a contact over its radius divided by the sphere's (D. Tabor, The hardness of
# metals, 1951).
TABOR = 0.2
# Depths that are tried, as parts of the greatest.
PARTS = np.linspace(0.1, 1.0, 91)
SHEAR, BULK = "shear_modulus_pa", "bulk_modulus_pa"
NAMES = (*LABELS, SHEAR, BULK)
LOG_MODULI = tuple(name.endswith("_pa") for name in NAMES)


@dataclass(frozen=True)
class Quantities:
    """Logarithms of moduli and Poisson's ratio, in the order of `NAMES`, by an estimate's unknowns.

    Attributes
    ----------
    values : (7,) array
    slopes : (7, size) array
        Derivatives by `Solution.vector`.
    depth_m : float
        Where the equivalent modulus is told [m].
    strain : float
        Mean strain under the sphere there.
    depth_radii : float
        The depth over the sphere's radius.
    """

    values: NDArray
    slopes: NDArray
    depth_m: float
    depth_radii: float
    strain: float


def quantities_of(
    best: Solution, covariance: NDArray, options: Fit, *, radius_m: float
) -> Quantities:
    """Moduli of an estimate and their slopes, the equivalent where it is told best at its nu.

    Parameters
    ----------
    best : Solution
    covariance : (size, size) array
        Of its unknowns.
    options : Fit
    radius_m : float
        Of the sphere.
    """
    vector = best.vector
    log_E, nu, q = vector[[LOG_E, NU, FORCE_LAW]]
    unit = np.eye(len(vector))
    star = log_E - np.log1p(-(nu**2))
    by_star = unit[LOG_E] + 2 * nu / (1 - nu**2) * unit[NU]
    times = np.array(options.relaxation_times_s, dtype=float)
    fractions = slice(SHARED, SHARED + len(times))
    left = 1 - float(relaxed_share(ONE_SECOND_S, fractions=vector[fractions], times_s=times))
    later = unit[LOG_E].copy()
    later[fractions] = np.expm1(-ONE_SECOND_S / times) / left
    pairs = zip(best.indentations, best.parameters, strict=True)
    depths = PARTS * max(float(one.depth_m.max()) + p.offset_m for one, p in pairs)
    harder, by_nu = _stiffening(best, depths, nu)
    slopes = by_star + harder[:, None] * unit[FORCE_LAW] + q * by_nu[:, None] * unit[NU]
    # Where nu is not told its doubt would choose the depth.
    column = covariance[:, NU]
    fixed = covariance - np.outer(column, column) / covariance[NU, NU]
    at = int(np.argmin(np.einsum("di,ij,dj->d", slopes, fixed, slopes)))
    further = by_star + by_ratio(nu)[:, None] * unit[NU]
    return Quantities(
        np.array([star, star + q * harder[at], log_E, nu, log_E + np.log(left), *star + over(nu)]),
        np.stack([by_star, slopes[at], unit[LOG_E], unit[NU], later, *further]),
        float(depths[at]),
        float(depths[at] / radius_m),
        float(TABOR * np.sqrt(depths[at] / radius_m)),
    )


def over(nu: ArrayLike) -> NDArray:
    """Logarithms of G and of K over E* at nu, (2, ...).

    G = E*(1 - nu)/2 and K = E*(1 - nu^2)/(3(1 - 2 nu)), of E = E*(1 - nu^2).
    """
    nu = np.asarray(nu, dtype=float)
    return np.stack([np.log((1 - nu) / 2), np.log((1 - nu**2) / (3 * (1 - 2 * nu)))])


def by_ratio(nu: float) -> NDArray:
    """Derivatives of `over` by nu, (2,)."""
    return np.array([-1 / (1 - nu), 2 / (1 - 2 * nu) - 2 * nu / (1 - nu**2)])


def _stiffening(best: Solution, depths_m: NDArray, nu: float) -> tuple[NDArray, NDArray]:
    """Mean over captures of the second law's log force over the first's, and its slope by nu."""
    each = [one.table.stiffening_at(depths_m, nu) for one in best.indentations]
    value, slope = np.mean(each, axis=0)
    return value, slope
