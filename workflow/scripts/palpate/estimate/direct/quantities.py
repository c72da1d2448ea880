"""Moduli as functions of an estimate's unknowns, and the one that depends least on models.

E* and E at small strain depend on the first millimetre, and carry the whole uncertainty of the
material law; E right at the touch carries that of the relaxation. The effective reduced modulus is
that of the neo-Hookean solid with the same force at a depth that was reached and after a second.
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
# Depth of the effective modulus where no other is asked for, as part of the maximum depth.
EFFECTIVE_PART = 0.7
# Mean strain of a contact over its radius divided by the sphere's (D. Tabor, The hardness of
# metals, 1951).
TABOR = 0.2
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
        Of the effective modulus [m].
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


def quantities_of(best: Solution, options: Fit, *, radius_m: float) -> Quantities:
    """Moduli of an estimate and their slopes.

    Parameters
    ----------
    best : Solution
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
    relaxed = np.zeros(len(vector))
    relaxed[fractions] = np.expm1(-ONE_SECOND_S / times) / left
    depth = effective_depth(best, options)
    each = [one.table.stiffening_at(np.array([depth]), nu) for one in best.indentations]
    harder, by_nu = np.mean(each, axis=0)[:, 0]
    effective = star + q * harder + np.log(left)
    by_effective = by_star + harder * unit[FORCE_LAW] + q * by_nu * unit[NU] + relaxed
    further = by_star + by_ratio(nu)[:, None] * unit[NU]
    return Quantities(
        np.array([effective, log_E, log_E + np.log(left), nu, star, *star + over(nu)]),
        np.stack([by_effective, unit[LOG_E], unit[LOG_E] + relaxed, unit[NU], by_star, *further]),
        depth,
        depth / radius_m,
        float(TABOR * np.sqrt(depth / radius_m)),
    )


def effective_depth(best: Solution, options: Fit) -> float:
    """Depth of the effective modulus: the option's, or a part of the captures' maximum depth [m].

    Of several captures the median counts.
    """
    if options.effective_depth_m is not None:
        return options.effective_depth_m
    pairs = zip(best.indentations, best.parameters, strict=True)
    return EFFECTIVE_PART * float(np.median([one.depth_m.max() + p.offset_m for one, p in pairs]))


def over(nu: ArrayLike) -> NDArray:
    """Logarithms of G and of K over E* at nu, (2, ...).

    G = E*(1 - nu)/2 and K = E*(1 - nu^2)/(3(1 - 2 nu)), of E = E*(1 - nu^2).
    """
    nu = np.asarray(nu, dtype=float)
    return np.stack([np.log((1 - nu) / 2), np.log((1 - nu**2) / (3 * (1 - 2 * nu)))])


def by_ratio(nu: float) -> NDArray:
    """Derivatives of `over` by nu, (2,)."""
    return np.array([-1 / (1 - nu), 2 / (1 - 2 * nu) - 2 * nu / (1 - nu**2)])
