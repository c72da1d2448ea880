"""Force over depth of a rigid indenter, per reduced modulus: shallow, deep, on a layer.

Sources
-------
Eq. 5.1 of the study (Hertz). I. N. Sneddon, Int. J. Eng. Sci. 3 (1965) 47: deep sphere, cone, flat
punch. G. G. Bilodeau, J. Appl. Mech. 59 (1992) 519: pyramid.
E. K. Dimitriadis et al., Biophys. J. 82 (2002) 2798: layer on a rigid base. P. D. Garcia and
R. Garcia, Biophys. J. 114 (2018) 2923: consistent series of the same at nu 0.5. Finite strain by
finite elements (palpate.solid).
"""

from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

INDENTERS = ("parabola", "sneddon")
SUPPORTS = ("half_space", "bonded", "not_bonded")
LAYERS = SUPPORTS[1:]
# An unbonded object that stands on a round base, which is indented too.
FOOT = "round_foot"
# Beyond this depth over radius the paraboloid is too blunt by more than a hundredth; and above this
# chi the series of a layer is no better than its own last terms (see `layer_factor`).
SHALLOW, LARGEST_CHI = 0.1, 0.6
# Beyond it the kernel's transform differs from the half-space's by less than 1e-20.
TRANSFORM_END = 30.0
# Of Sneddon's t, whose powers cancel below the first; splines between them are right to 1e-11.
TANGENTS = np.geomspace(1e-2, 1e12, 20000)
# Force of finite elements (neo-Hookean block of 47.5 mm, bonded, frictionless sphere of 6.22 mm, 13
# depths to 9 mm) over Sneddon's on the same layer, less 1: coefficients of s, s^2 and s^3,
# s = sqrt(d/R), by Poisson's ratio. Residuals are 1 % at most, 0.4 % rms.
STRAIN = [[0.3012, -0.0933, -0.006], [0.0627, 0.0062, -0.0608], [0.0172, -0.1101, -0.024]]
# The same by powers of Poisson's ratio, which was 0, 0.3 and 0.49.
STRAIN_BY_RATIO = np.linalg.solve(np.vander([0.0, 0.3, 0.49]), STRAIN)
# Largest d/R computed; beyond it the factor stays what it is there.
DEEPEST = 1.45

Law = Callable[[NDArray], NDArray]


# Forces are at E* = 1 (n,) [N/Pa], of depths (n,) [m], and 0 before contact.
def parabola_force(
    depth_m: NDArray, radius_m: float, object_per_m: float = 0.0, base_per_m: float = 0.0
) -> NDArray:
    """Eq. 5.1, F = 4/3 R^(1/2) d^(3/2), 1/R the sphere's and the object's curvature.

    At a base of a curvature too, as of two contacts in series, the depths add up, and so do the
    powers -1/3 of the radii.
    """
    radius = (np.cbrt(1 / radius_m + object_per_m) + np.cbrt(base_per_m)) ** -3
    return 4 / 3 * np.sqrt(radius) * np.maximum(depth_m, 0) ** 1.5


def sneddon_force(
    depth_m: NDArray, radius_m: float, object_per_m: float = 0.0, base_per_m: float = 0.0
) -> NDArray:
    """Sneddon's sphere, F = (a^2 + R^2)/2 ln((R + a)/(R - a)) - a R, d = a/2 ln((R + a)/(R - a)).

    With a = R tanh t the depth is d = R t tanh t. The gap of an object of curvature k grows by
    k r^2/2 more, which by the same solution adds k a^2 to the depth and 4/3 k a^3 to the force; a
    round base adds its own depth by Hertz. Small strain; depth may exceed the radius.
    """
    depth = np.maximum(np.asarray(depth_m, dtype=float), 0) / radius_m
    over_hertz = _sneddon_over_hertz(radius_m * object_per_m, radius_m * base_per_m)
    return radius_m**2 * over_hertz(depth) * depth**1.5


@lru_cache(maxsize=64)
def _sneddon_over_hertz(curvature: float, foot: float) -> CubicSpline:
    """Force over the depth's power 3/2 by depth, for R = 1."""
    t, a = TANGENTS, np.tanh(TANGENTS)
    force = (a**2 + 1) * t - a + 4 / 3 * curvature * a**3
    depth = t * a + curvature * a**2 + np.cbrt(foot * (3 / 4 * force) ** 2)
    least = float(parabola_force(1.0, 1.0, curvature, foot))
    return CubicSpline(np.r_[0, depth], np.r_[least, force / depth**1.5])


def cone_force(depth_m: NDArray, half_angle_rad: float) -> NDArray:
    """Sneddon's cone, F = 2/pi tan(alpha) d^2, alpha between the axis and the side."""
    return 2 / np.pi * np.tan(half_angle_rad) * np.maximum(depth_m, 0) ** 2


def pyramid_force(depth_m: NDArray, half_angle_rad: float) -> NDArray:
    """Four-sided pyramid at E* = 1, F = tan(alpha)/sqrt(2) d^2, alpha between axis and face.

    As most programs of AFMs have it (F. Rico et al., Phys. Rev. E 72 (2005) 021914). An edge's
    angle has sqrt(2) of that tangent. Boundary elements give 0.738 (tests/estimate): E* comes out
    4 % too large; G. G. Bilodeau (J. Appl. Mech. 59 (1992) 519) has 0.7453.
    """
    return np.sqrt(0.5) * np.tan(half_angle_rad) * np.maximum(depth_m, 0) ** 2


def flat_force(depth_m: NDArray, radius_m: float) -> NDArray:
    """Cylindrical punch with a flat end, F = 2 a d, a its radius."""
    return 2 * radius_m * np.maximum(depth_m, 0)


def layer_factor(chi: NDArray, nu: float, support: str) -> NDArray:
    """Force on a layer over that on a half-space, for a paraboloid.

    The rigid base adds to a point force's P/(pi E* r) the displacement
    P/(pi E* h) (alpha + beta (r/h)^2): a shift of the surface and a change of its curvature, so
    that the contact stays Hertz's. Expanded in chi = sqrt(R d)/h to the fourth power. Within 0.5 %
    of axisymmetric finite elements (tests/estimate) to chi 0.4 and 3.5 % at 0.6; Dimitriadis'
    printed series is off by up to 3 % at chi 0.2, 6 % at 0.4 and 11 % at 0.6.

    Raises
    ------
    ValueError
        If the support is none of `SUPPORTS`, or nu is no Poisson's ratio from 0 to 0.5.
    """
    if support == "half_space":
        return np.ones_like(chi)
    alpha, beta = layer_moments(nu, support)
    c, b = -4 * alpha / (3 * np.pi), 8 * beta / (3 * np.pi)
    # Lagrange's inversion of f = (1 + c chi f)^(3/2), and what the curvature adds.
    series = (1, 3 / 2 * c, 21 / 8 * c**2, 5 * c**3 - 4 / 5 * b, 1287 / 128 * c**4 - 18 / 5 * b * c)
    return np.polynomial.polynomial.polyval(chi, series)


@cache
def layer_moments(nu: float, support: str) -> tuple[float, float]:
    """Shift alpha and curvature beta that a rigid base gives a layer's surface.

    Moments of 1 - L(s), where L is the Hankel transform of the layer's normal compliance over the
    half-space's (K. L. Johnson, Contact Mechanics, 5.8): alpha = -int (1 - L) ds,
    beta = int (1 - L) s^2/4 ds.

    Raises
    ------
    ValueError
        If the support is no layer's, or nu is no Poisson's ratio from 0 to 0.5.
    """
    if support not in LAYERS:
        raise ValueError(f"support: expected one of {', '.join(SUPPORTS)}, found {support}")
    check_ratio(nu)
    kappa = 3 - 4 * nu

    def deficit(s: float) -> float:
        if support == "bonded":
            bottom = 2 * kappa * np.cosh(2 * s) + 1 + kappa**2 + 4 * s**2
            return 1 - (2 * kappa * np.sinh(2 * s) - 4 * s) / bottom
        return 1 - (np.cosh(2 * s) - 1) / (np.sinh(2 * s) + 2 * s) if s > 0 else 1.0

    alpha = -quad(deficit, 0, TRANSFORM_END, epsabs=1e-12)[0]
    beta = quad(lambda s: deficit(s) * s**2 / 4, 0, TRANSFORM_END, epsabs=1e-12)[0]
    return alpha, beta


def contact_law(
    indenter: str,
    support: str,
    *,
    radius_m: float,
    thickness_m: float,
    nu: float,
    curvature_per_m: float = 0.0,
    foot_curvature_per_m: float = 0.0,
) -> Law:
    """Force over depth at E* = 1 of a sphere: takes depths (n,) [m], gives forces (n,) [N/Pa].

    The layer's factor is a paraboloid's; that of Sneddon's sphere is taken to be the same.
    Indenters and supports are those of `INDENTERS`, and of `SUPPORTS` or `FOOT`. ``radius_m`` is
    the sphere's, ``thickness_m`` and ``nu`` are a layer's. Curvatures are those of the
    object at the contact, negative where it is hollow, and at its round base [1/m].

    Raises
    ------
    ValueError
        If the indenter is none of these.
    """
    if indenter not in INDENTERS:
        raise ValueError(f"indenter: expected one of {', '.join(INDENTERS)}, found {indenter}")
    force = parabola_force if indenter == "parabola" else sneddon_force
    if support == FOOT:
        return lambda depth_m: force(depth_m, radius_m, curvature_per_m, foot_curvature_per_m)

    def law(depth_m: NDArray) -> NDArray:
        bend = 1 / radius_m + curvature_per_m
        chi = np.sqrt(np.maximum(depth_m, 0) / bend) / thickness_m
        return force(depth_m, radius_m, curvature_per_m) * layer_factor(chi, nu, support)

    return law


def finite_strain_factor(depth_over_radius: NDArray, nu: float) -> NDArray:
    """Force of a neo-Hookean solid over that of small strain, for one E*.

    Small strain takes the surface under the sphere to move straight down. At a small Poisson's
    ratio it moves inward too, which stiffens the contact from the first; at a large one large
    strain softens it. Computed for a flat bonded block 7.6 radii thick far from its sides; other
    laws of finite strain and curved surfaces differ. It is 1 at depth 0 and below.

    Raises
    ------
    ValueError
        If nu is no Poisson's ratio from 0 to 0.5.
    """
    check_ratio(nu)
    s = np.sqrt(np.clip(depth_over_radius, 0, DEEPEST))
    return np.polynomial.polynomial.polyval(s, [1, *np.polyval(STRAIN_BY_RATIO, nu)])


def check_ratio(nu: float, name: str = "nu") -> None:
    """Reject what is no Poisson's ratio from 0 to 0.5, by a `ValueError` with a name."""
    if not 0 <= nu <= 0.5:
        raise ValueError(f"{name}: expected a Poisson's ratio from 0 to 0.5, found {nu:g}")
