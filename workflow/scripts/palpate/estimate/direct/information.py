"""Information limit: how well what a fit compares could tell the moduli at best."""

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.budget import placed
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import linearised
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import prior_of, scaled_inverse
from palpate.estimate.direct.quantities import Quantities


def bound_of(best: Solution, quantities: Quantities, options: Fit) -> NDArray:
    """Least standard deviations of `quantities.NAMES` by Cramer and Rao, (7,).

    Of the residuals as the fit states them, their deviations and what errs together as found, with
    all unknowns; priors count as data (van Trees, 1968). Outliers weigh as much as others, and what
    is no residual has no part in it: errors of rig and table, captures that are apart.

    Parameters
    ----------
    best : Solution
    quantities : Quantities
    options : Fit
    """
    times = np.array(options.relaxation_times_s, dtype=float)
    information = prior_of(best.indentations, options).information.copy()
    each = zip(placed(best), best.indentations, best.parameters, best.scales, strict=True)
    for (at, _), one, p, scale in each:
        line = linearised(one, p, times_s=times)
        motion, sharing = scale.of(one.kind)
        motion = line.motion_slope / (motion * np.sqrt(sharing))[:, None]
        information[np.ix_(at, at)] += motion.T @ motion
        information[np.ix_(at, at)] += line.depth_slope.T @ line.depth_slope
    slopes = quantities.slopes
    return np.sqrt(np.diag(slopes @ scaled_inverse(information) @ slopes.T))
