"""Uncertainty budget: what each source of error adds to the deviations of the moduli.

Standard uncertainties are those of the priors and of the noise that the residuals show; they go
to the moduli through the linearised least squares, and add up in squares (JCGM 100:2008, Eq. 10).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.blocks import Blocks, normal_rows
from palpate.estimate.direct.fit import Prior, Solution, prior_of
from palpate.estimate.direct.indentation import OWN, residuals
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.quantities import LOG_MODULI, Quantities
from palpate.estimate.direct.rig import rig_errors

# Fewer captures don't tell how much they scatter.
FEWEST_CAPTURES = 6
# Fewer patches don't tell their own scatter.
FEWEST_PATCHES = 4.0


@dataclass(frozen=True)
class Source:
    """One source of error.

    Attributes
    ----------
    name : str
    std : float
        Its standard uncertainty, in its unit.
    unit : str
    contributions : (5,) array
        What it adds to the standard uncertainties of `quantities.NAMES`.
    freedom : float
        Degrees of freedom of its standard uncertainty.
    """

    name: str
    std: float
    unit: str
    contributions: NDArray
    freedom: float = np.inf


@dataclass(frozen=True)
class Budget:
    """Sources of error, the largest in E* first."""

    sources: tuple[Source, ...]

    @property
    def std(self) -> NDArray:
        """Standard uncertainties of `quantities.NAMES`: all contributions in squares, (5,)."""
        return np.sqrt(sum(source.contributions**2 for source in self.sources))

    @property
    def freedom(self) -> NDArray:
        """Effective degrees of freedom (Welch and Satterthwaite; JCGM 100:2008, Eq. G.2b), (5,)."""
        fourth = sum(source.contributions**4 / source.freedom for source in self.sources)
        return self.std**4 / np.maximum(fourth, 1e-300)

    def rows(self) -> list[dict]:
        """One mapping for each source: uncertainty_budget.csv."""
        names = ("log_reduced_modulus", "log_youngs_modulus", "poisson_ratio")
        found = []
        for source in self.sources:
            parts = dict(zip(names, source.contributions[[0, 2, 3]], strict=True))
            row = {"source": source.name, "standard_uncertainty": source.std, "unit": source.unit}
            row |= {f"sensitivity_{name}": part / source.std for name, part in parts.items()}
            found.append(row | {f"contribution_{name}": part for name, part in parts.items()})
        return found


def covariance_of(best: Solution, options: Fit) -> NDArray:
    """Covariance of an estimate's unknowns, (size, size)."""
    information = prior_of(best.indentations, options).information.copy()
    for at, block in _placed(best):
        information[np.ix_(at, at)] += block.motion_matrix.sum(axis=0)
        information[np.ix_(at, at)] += block.depth_matrix.sum(axis=0)
    # Deviations differ by many orders.
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled = information * scale * scale[:, None] + 1e-12 * np.eye(len(information))
    return np.linalg.inv(scaled) * scale * scale[:, None]


def budget_of(
    best: Solution, covariance: NDArray, quantities: Quantities, options: Fit, *, radius_m: float
) -> Budget:
    """What each source adds to the uncertainties of the moduli.

    Parameters
    ----------
    best : Solution
    covariance : (size, size) array
        Of `covariance_of`.
    quantities : Quantities
    options : Fit
    radius_m : float
        Of the sphere.
    """
    onto = quantities.slopes @ covariance
    sources = _of_priors(onto, prior_of(best.indentations, options))
    sources += _of_noise(onto, best)
    sources += _of_rig(onto, best, options, radius_m)
    log = np.array(LOG_MODULI, dtype=float)
    table_E, table_nu = options.model_std.log_youngs_modulus, options.model_std.nu
    sources += [
        Source(
            "indentation table: force",
            table_E,
            "1",
            table_E * log,
        ),
        Source("indentation table: motion", table_nu, "1", table_nu * (1 - log)),
    ]
    there = [source for source in sources if source.std > 0]
    return Budget(tuple(sorted(there, key=lambda source: -source.contributions[0])))


def _of_priors(onto: NDArray, prior: Prior) -> list[Source]:
    """Sources that are unknowns of the fit: their priors, through the data."""
    moved = onto @ prior.rows.T
    found = []
    for name in dict.fromkeys(prior.sources):
        rows = np.flatnonzero(np.array(prior.sources) == name)
        std = 1 / np.abs(prior.rows[rows]).max()
        parts = np.sqrt((moved[:, rows] ** 2).sum(axis=1))
        found.append(Source(name, std, prior.units[name], parts))
    return found


def _of_rig(onto: NDArray, best: Solution, options: Fit, radius_m: float) -> list[Source]:
    """Sources that are no unknowns: what the fit makes of a capture that each has changed."""
    times = np.array(options.relaxation_times_s, dtype=float)
    each = list(zip(_placed(best), best.indentations, best.parameters, best.scales, strict=True))
    normal = [normal_rows(one, p, scale, times_s=times) for _, one, p, scale in each]
    found = []
    for error in rig_errors(options.rig, radius_m=radius_m):
        if not error.std:
            continue
        moved = []
        for ((at, _), one, p, _), (line, depth, motion) in zip(each, normal, strict=True):
            other = residuals(error.changed(one, error.std), p, times_s=times)
            change = depth @ (other.depth - line.residuals.depth)
            change += motion @ (other.motion - line.residuals.motion)
            moved.append(-onto[:, at] @ change)
        parts = np.abs(np.sum(moved, axis=0))
        if not error.common:
            parts = np.sqrt((np.array(moved) ** 2).sum(axis=0))
        found.append(Source(error.source, error.std, error.unit, parts))
    return found


def _of_noise(onto: NDArray, best: Solution) -> list[Source]:
    """Noise of motion and depth: as stated, or as patches, frames and captures scatter if more."""
    stated, scattered = {}, {}
    for kind in ("motion", "depth"):
        each = [_shares(onto[:, at], block, kind) for at, block in _placed(best)]
        stated[kind] = sum(expected.sum(axis=0) for expected, _ in each)
        moved = [moves for _, moves in each]
        if len(moved) >= FEWEST_CAPTURES:
            moved = [np.stack([moves.sum(axis=0) for moves in moved])]
        scattered[kind] = sum((moves**2).sum(axis=0) for moves in moved)
    found = []
    for kind, std in _noise_std(best).items():
        variance = np.maximum(stated[kind], scattered[kind])
        found.append(
            Source(f"noise of the {kind}", std, "m", np.sqrt(variance), _freedom(onto, best, kind))
        )
    return found


def _shares(onto: NDArray, block: Blocks, kind: str) -> tuple[NDArray, NDArray]:
    """Of each patch or frame: its expected part of the variances, and what it moves, (b, 5)."""
    matrix, slope = getattr(block, f"{kind}_matrix"), getattr(block, f"{kind}_slope")
    return np.einsum("qi,bij,qj->bq", onto, matrix, onto), slope @ onto.T


def _freedom(onto: NDArray, best: Solution, kind: str) -> float:
    """How many patches or frames tell nu, less one: the inverse of their shares' sum of squares.

    Far from the contact there are many patches that say next to nothing.
    """
    shares = [_shares(onto[:, at], block, kind)[0][:, 3] for at, block in _placed(best)]
    share = np.concatenate(shares)
    count = share.sum() ** 2 / max(float((share**2).sum()), 1e-300)
    return max(float(count), FEWEST_PATCHES) - 1


def _noise_std(best: Solution) -> dict[str, float]:
    """Median deviations of motions and depths [m]."""
    motion = [
        np.median(one.moved_std_m[one.seen]) * scale.motion
        for one, scale in zip(best.indentations, best.scales, strict=True)
    ]
    depth = [
        np.median(one.depth_std_m) * scale.depth
        for one, scale in zip(best.indentations, best.scales, strict=True)
    ]
    return {"motion": float(np.median(motion)), "depth": float(np.median(depth))}


def _placed(best: Solution) -> Sequence[tuple[NDArray, Blocks]]:
    """Blocks of each capture with the places of its unknowns."""
    shared = len(best.vector) - OWN * len(best.indentations)
    return [
        (np.concatenate([np.arange(shared), shared + OWN * k + np.arange(OWN)]), block)
        for k, block in enumerate(best.blocks)
    ]
