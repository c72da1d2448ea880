"""How much serially correlated residuals of a fit say."""

import numpy as np
from numpy.typing import NDArray

# Any more would leave a press no sample at all; of a long record so many are left.
LARGEST_AUTOCORRELATION, FEWEST_LEFT = 0.9, 5.0


def effective_samples(residual: NDArray) -> float:
    """Number of independent samples with as much to say as serially correlated ones.

    n (1 - r)/(1 + r) for a first-order process of lag-1 autocorrelation r, whose estimate falls
    short by (1 + 4 r)/n in a short series (Marriott and Pope, Biometrika 41, 1954, 390). Negative
    autocorrelation is taken for none.
    """
    centred, n = residual - residual.mean(), len(residual)
    power = float(centred @ centred)
    lag = float(centred[1:] @ centred[:-1]) / power if power > 0 else 0.0
    most = max(LARGEST_AUTOCORRELATION, (n - FEWEST_LEFT) / (n + FEWEST_LEFT))
    lag = float(np.clip(lag + (1 + 4 * lag) / n, 0, most))
    return n * (1 - lag) / (1 + lag)


def freedom(residual: NDArray, parameters: int) -> float:
    """Degrees of freedom that serially correlated residuals of a fit leave to Student's quantile.

    Of few samples, which hardly tell their correlation, those of five are left, or all.

    Parameters
    ----------
    residual : (n,) array
    parameters : int
        Number of parameters fitted.
    """
    n = len(residual)
    return max(effective_samples(residual), min(n, FEWEST_LEFT)) * (1 - parameters / n)


def deviation(residual: NDArray, parameters: int) -> float:
    """Standard deviation of a fit's residuals, as large as their serial correlation asks.

    Divided by the root of a sum of squared slopes it gives the standard error of a parameter.

    Parameters
    ----------
    residual : (n,) array
    parameters : int
        Number of parameters fitted.
    """
    left = effective_samples(residual) * (1 - parameters / len(residual))
    return float(np.sqrt(residual @ residual / left))
