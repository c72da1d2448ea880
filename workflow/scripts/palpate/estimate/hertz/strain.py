"""How finite strain and sideways motion change the force of a deep sphere.

Small strain takes the surface under the sphere to move straight down. Where Poisson's ratio is
small it moves inward too, which stiffens the contact from the first; where the solid keeps its
volume, large strain softens it (neo-Hookean).
"""

import numpy as np
from numpy.typing import NDArray

# Force of finite elements (palpate.solid: neo-Hookean block of 47.5 mm, bonded, frictionless
# sphere of 6.22 mm, 13 depths to 9 mm) over Sneddon's on the same layer, less 1: coefficients of
# s, s^2 and s^3, s = sqrt(d/R), by Poisson's ratio. What they leave is 1 % at most, 0.4 % rms.
POISSON_RATIOS = np.array([0.0, 0.3, 0.49])
COEFFICIENTS = np.array(
    [
        [0.3012, -0.0933, -0.0060],
        [0.0627, 0.0062, -0.0608],
        [0.0172, -0.1101, -0.0240],
    ]
)
# No deeper was computed, and the factor stays what it is there.
DEEPEST = 1.45


def finite_strain_factor(depth_over_radius: NDArray, nu: float) -> NDArray:
    """Force of a neo-Hookean solid over that of small strain, for one E*.

    Holds for what was computed: a flat bonded block 7.6 radii thick, pressed to 1.45 radii far from
    its sides, neo-Hookean, without friction. Other laws of finite strain stiffen or soften
    otherwise, and a curved surface strains less or more at the same depth.

    Parameters
    ----------
    depth_over_radius : array
        Depth over the sphere's radius; no contact below 0.
    nu : float
        Poisson's ratio.

    Returns
    -------
    array
        Of the same shape, 1 at depth 0.

    Raises
    ------
    ValueError
        If nu is no Poisson's ratio from 0 to 0.5.
    """
    if not 0 <= nu <= 0.5:
        raise ValueError(f"nu: expected a Poisson's ratio from 0 to 0.5, found {nu:g}")
    s = np.sqrt(np.clip(depth_over_radius, 0, DEEPEST))
    return np.polynomial.polynomial.polyval(s, [1, *(_parts(nu) @ COEFFICIENTS)])


def _parts(nu: float) -> NDArray:
    """Lagrange's polynomials of the computed ratios."""
    others = [np.delete(POISSON_RATIOS, k) for k in range(len(POISSON_RATIOS))]
    return np.array(
        [np.prod((nu - o) / (at - o)) for at, o in zip(POISSON_RATIOS, others, strict=True)]
    )
