"""How well the force alone, the surface alone and both tell E and nu."""

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.budget import placed
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import FREE, prior_of

KINDS = {"force": ("depth",), "surface": ("motion",), "both": ("depth", "motion")}


def regions_of(best: Solution, options: Fit) -> dict[str, NDArray]:
    """Information on log E and nu, (2, 2) each, by what of the captures is taken.

    To first order at the estimate, all else unknown as its priors have it; without errors of rig,
    of table and of captures apart. What is not told of a direction has none, where a covariance
    would have no end.

    Parameters
    ----------
    best : Solution
    options : Fit
    """
    prior = prior_of(best.indentations, options).information
    return {name: _of(best, prior, kinds) for name, kinds in KINDS.items()}


def _of(best: Solution, prior: NDArray, kinds: tuple[str, ...]) -> NDArray:
    """Schur complement of what is unknown besides."""
    whole = prior.copy()
    for at, block in placed(best):
        for kind in kinds:
            whole[np.ix_(at, at)] += getattr(block, f"{kind}_matrix").sum(axis=0)
    told, cross, rest = whole[:FREE, :FREE], whole[:FREE, FREE:], whole[FREE:, FREE:]
    scale = 1 / np.sqrt(np.diag(rest))
    scaled = rest * scale * scale[:, None]
    return told - (cross * scale) @ np.linalg.solve(scaled, (cross * scale).T)
