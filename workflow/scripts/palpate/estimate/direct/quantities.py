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
EFFECTIVE, E, E_1S, POISSON, STAR = range(len(LABELS))
LOG_MODULI = np.array([name.endswith("_pa") for name in NAMES])


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
    by_star = unit[LOG_E] + 2 * nu / (1 - nu**2) * unit[NU]
    values = LOG_MODULI * (log_E - np.log1p(-(nu**2))) + over_star(nu)
    slopes = np.outer(LOG_MODULI, by_star) + np.outer(over_star_by_nu(nu), unit[NU])
    values[POISSON], slopes[POISSON] = nu, unit[NU]
    times = np.array(options.relaxation_times_s, dtype=float)
    fractions = slice(SHARED, SHARED + len(times))
    left = 1 - float(relaxed_share(ONE_SECOND_S, fractions=vector[fractions], times_s=times))
    values[[EFFECTIVE, E_1S]] += np.log(left)
    slopes[[EFFECTIVE, E_1S], fractions] += np.expm1(-ONE_SECOND_S / times) / left
    depth = effective_depth(best, options)
    each = [one.table.stiffening_at(np.array([depth]), nu) for one in best.indentations]
    harder, by_nu = np.mean(each, axis=0)[:, 0]
    values[EFFECTIVE] += q * harder
    slopes[EFFECTIVE] += harder * unit[FORCE_LAW] + q * by_nu * unit[NU]
    strain = float(TABOR * np.sqrt(depth / radius_m))
    return Quantities(values, slopes, depth, depth / radius_m, strain)


def effective_depth(best: Solution, options: Fit) -> float:
    """Depth of the effective modulus: the option's, or a part of the captures' maximum depth [m].

    Of several captures the median counts.
    """
    if options.effective_depth_m is not None:
        return options.effective_depth_m
    pairs = zip(best.indentations, best.parameters, strict=True)
    return EFFECTIVE_PART * float(np.median([one.depth_m.max() + p.offset_m for one, p in pairs]))


def over_star(nu: ArrayLike) -> NDArray:
    """Logarithms of moduli over E* at a Poisson's ratio, in the order of `NAMES`, (7, ...).

    E = E*(1 - nu^2), G = E*(1 - nu)/2 and K = E/(3(1 - 2 nu)); 0 for E* and for nu itself.
    """
    nu = np.asarray(nu, dtype=float)
    none, young = np.zeros_like(nu), np.log1p(-(nu**2))
    bulk = young - np.log(3 * (1 - 2 * nu))
    return np.stack([none, young, young, none, none, np.log((1 - nu) / 2), bulk])


def over_star_by_nu(nu: float) -> NDArray:
    """Derivatives of `over_star` by nu, (7,)."""
    young = -2 * nu / (1 - nu**2)
    return np.array([0.0, young, young, 0.0, 0.0, -1 / (1 - nu), young + 2 / (1 - 2 * nu)])
