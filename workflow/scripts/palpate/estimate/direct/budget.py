"""Uncertainty budget: what each source of error adds to the deviations of the moduli.

Standard uncertainties are those of the priors and of the noise that the residuals show; they go
to the moduli through the linearised least squares, and add up in squares (JCGM 100:2008, Eq. 10).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.blocks import Blocks, normal_rows
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import OWN, Linearised, residuals
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.prior import UNMOVED, Prior, prior_of, scaled_inverse
from palpate.estimate.direct.probe_uncertainty import (
    CONFIGURED,
    OBSERVED,
    UNSTATED,
    ProbeUncertainty,
)
from palpate.estimate.direct.quantities import (
    LOG_MODULI,
    NAMES,
    POISSON,
    Quantities,
    over_star_by_nu,
)
from palpate.estimate.direct.rig import RigError, rig_errors
from palpate.modulus import LABELS

# By how much captures may be apart for no reason that is known, in deviations of one of them (half
# of a normal distribution), and what is tried.
PRIOR_EXCESS, EXCESSES = 0.5, np.linspace(0, 10, 1001)
# Of `normal_rows`.
NormalRows = tuple[Linearised, NDArray, NDArray]
# Fewer patches or frames don't tell their own scatter.
FEWEST_PARTS = 4.0
COLUMNS = [
    f"log_{name.removesuffix('_pa')}" if log else name
    for name, log in zip(NAMES, LOG_MODULI, strict=True)
]
# Priors of what each capture has for itself.
OWN_SOURCES = (
    "zero of the depth",
    "clocks",
    "zero of the motion",
    "place of the contact",
)


@dataclass(frozen=True)
class Source:
    """One source of error.

    Attributes
    ----------
    name : str
    std : float
        Its standard uncertainty, in its unit.
    unit : str
    contributions : (7,) array
        What it adds to the standard uncertainties of `quantities.NAMES`.
    freedom : (7,) array or float
        Degrees of freedom of those.
    origin : str
        Where its uncertainty comes from: "configured", "stated" (in the probe's file), "calibrated"
        (by a run), "observed", or two of them.
    """

    name: str
    std: float
    unit: str
    contributions: NDArray
    freedom: NDArray | float = np.inf
    origin: str = CONFIGURED


@dataclass(frozen=True)
class Budget:
    """Sources of error, the largest in E* first."""

    sources: tuple[Source, ...]

    @property
    def std(self) -> NDArray:
        """Standard uncertainties of `quantities.NAMES`: all contributions in squares, (7,)."""
        return np.sqrt(sum(source.contributions**2 for source in self.sources))

    @property
    def freedom(self) -> NDArray:
        """Effective degrees of freedom (Welch and Satterthwaite; JCGM 100:2008, Eq. G.2b), (7,)."""
        fourth = sum(source.contributions**4 / source.freedom for source in self.sources)
        return self.std**4 / np.maximum(fourth, 1e-300)

    def rows(self) -> list[dict]:
        """One mapping for each source: uncertainty_budget.csv.

        Contributions to the logarithms of moduli and to Poisson's ratio; sensitivities are those
        over the source's own uncertainty.
        """
        found = []
        for source in self.sources:
            row = {"source": source.name, "standard_uncertainty": source.std, "unit": source.unit}
            row |= {"origin": source.origin}
            parts = dict(zip(COLUMNS, source.contributions, strict=True))
            row |= {f"sensitivity_{name}": part / source.std for name, part in parts.items()}
            found.append(row | {f"contribution_{name}": part for name, part in parts.items()})
        return found


def covariance_of(best: Solution, options: Fit) -> NDArray:
    """Covariance of an estimate's unknowns, (size, size)."""
    information = prior_of(best.indentations, options).information.copy()
    for at, block in placed(best):
        information[np.ix_(at, at)] += block.motion_matrix.sum(axis=0)
        information[np.ix_(at, at)] += block.depth_matrix.sum(axis=0)
    return scaled_inverse(information)


def budget_of(
    best: Solution,
    covariance: NDArray,
    quantities: Quantities,
    options: Fit,
    known: ProbeUncertainty = UNSTATED,
    *,
    radius_m: float,
) -> Budget:
    """What each source adds to the uncertainties of the moduli.

    Parameters
    ----------
    best : Solution
    covariance : (size, size) array
        Of `covariance_of`.
    quantities : Quantities
    options : Fit
    known : ProbeUncertainty, optional
        What is stated of the probe's own numbers.
    radius_m : float
        Of the sphere.
    """
    onto = quantities.slopes @ covariance
    times = np.array(options.relaxation_times_s, dtype=float)
    each = zip(best.indentations, best.parameters, best.scales, strict=True)
    normal = [normal_rows(one, p, scale, times_s=times) for one, p, scale in each]
    sources = _of_priors(onto, prior_of(best.indentations, options))
    sources += _of_noise(onto, best)
    own = [s for s in sources if s.name in OWN_SOURCES or s.name.startswith("noise")]
    sources += _of_captures(onto, best, sum(source.contributions**2 for source in own))
    errors = rig_errors(options.rig, known, radius_m=radius_m)
    sources += _of_rig(onto, best, normal, errors, times_s=times)
    sources += _of_table(best, quantities, options)
    there = [_from(source, known) for source in sources if source.std > 0]
    return Budget(tuple(sorted(there, key=lambda source: -source.contributions[0])))


def _from(source: Source, known: ProbeUncertainty) -> Source:
    return replace(source, origin=known.origins.get(source.name, source.origin))


def _of_priors(onto: NDArray, prior: Prior) -> list[Source]:
    """Sources that are unknowns of the fit: their priors, through the data."""
    return [
        Source(one.name, one.std, one.unit, np.linalg.norm(onto @ one.response.T, axis=1))
        for one in prior.errors
        if one.std > 2 * UNMOVED
    ]


def _of_rig(
    onto: NDArray,
    best: Solution,
    normal: Sequence[NormalRows],
    errors: Sequence[RigError],
    *,
    times_s: NDArray,
) -> list[Source]:
    """Sources that are no unknowns: what the fit makes of a capture that each has changed."""
    each = list(zip(placed(best), best.indentations, best.parameters, normal, strict=True))
    found = []
    for error in errors:
        if not error.std:
            continue
        moved = []
        for (at, _), one, p, (line, depth, motion) in each:
            other = residuals(error.changed(one, error.std), p, times_s=times_s)
            change = depth @ (other.depth - line.residuals.depth)
            change += motion @ (other.motion - line.residuals.motion)
            moved.append(-onto[:, at] @ change)
        parts = np.abs(np.sum(moved, axis=0))
        if not error.common:
            parts = np.sqrt((np.array(moved) ** 2).sum(axis=0))
        found.append(Source(error.source, error.std, error.unit, parts))
    return found


def _of_noise(onto: NDArray, best: Solution) -> list[Source]:
    """Noise of motion and depth, as large as the fit's deviations and sharing have it."""
    found = []
    for kind, std in _noise_std(best).items():
        each = [_shares(onto[:, at], block, kind)[0] for at, block in placed(best)]
        shares = np.concatenate(each)
        freedom = np.maximum(_count(shares), FEWEST_PARTS) - 1
        parts = np.sqrt(shares.sum(axis=0))
        found.append(Source(f"noise of the {kind}", std, "m", parts, freedom, OBSERVED))
    return found


def _count(shares: NDArray) -> NDArray:
    """How many equal parts (b, 7) are like these: many may say next to nothing, (7,)."""
    return shares.sum(axis=0) ** 2 / np.maximum((shares**2).sum(axis=0), 1e-300)


def _of_table(best: Solution, quantities: Quantities, options: Fit) -> list[Source]:
    """Sources of the indentation table; E, G and K follow nu at the same E*."""
    stds = options.model_std
    with_nu = np.abs(over_star_by_nu(float(quantities.values[POISSON])))
    with_nu[POISSON] = 1.0
    force, motion = stds.log_youngs_modulus, stds.nu
    found = [
        Source("indentation table: force", force, "1", force * LOG_MODULI),
        Source("indentation table: motion", motion, "1", motion * with_nu),
        Source(
            "friction at the sphere", stds.sphere_friction, "1", stds.sphere_friction * LOG_MODULI
        ),
    ]
    if any(one.table.slides for one in best.indentations):
        parts = stds.nu_loose * with_nu
        found.append(Source("indentation table: base friction", stds.nu_loose, "1", parts))
    return found


def _of_captures(onto: NDArray, best: Solution, told: NDArray) -> list[Source]:
    """By how much captures are farther apart than their noise and own unknowns explain.

    What each capture moves the moduli by, less the mean of all, against what was told of it. Of so
    few captures a third is farther apart than expected by chance alone, so the excess is what is
    likely with `PRIOR_EXCESS` known beforehand (A. Gelman, Bayesian Anal. 1, 2006, 515).

    Parameters
    ----------
    onto : (7, size) array
    best : Solution
    told : (7,) array
        Variances that the noise and what each capture has for itself explain.
    """
    count = len(best.blocks)
    if count < 2:
        return []
    shared = len(best.vector) - OWN * count
    moved = np.stack(
        [
            sum(_shares(onto[:, at], block, kind)[1].sum(axis=0) for kind in ("motion", "depth"))
            for at, block in placed(best, shared)
        ]
    )
    scatter = count * moved.var(axis=0, ddof=1) / np.maximum(told, 1e-300)
    parts = np.sqrt(told * _likely_excess(scatter, count - 1))
    most = float(parts[: len(LABELS)].max())
    return [Source("captures apart", most, "1", parts, count - 1.0, OBSERVED)]


def _likely_excess(scatter: NDArray, freedom: int) -> NDArray:
    """Variance beyond 1 that variances of so many degrees of freedom speak for, as many."""
    excess = EXCESSES[:, None] ** 2
    cost = freedom * (np.log1p(excess) + scatter / (1 + excess))
    cost = cost + (EXCESSES[:, None] / PRIOR_EXCESS) ** 2
    weight = np.exp((cost.min(axis=0) - cost) / 2)
    return (weight * excess).sum(axis=0) / weight.sum(axis=0)


def _shares(onto: NDArray, block: Blocks, kind: str) -> tuple[NDArray, NDArray]:
    """Of each patch or frame: its expected part of the variances, and what it moves, (b, 7)."""
    matrix, slope = getattr(block, f"{kind}_matrix"), getattr(block, f"{kind}_slope")
    size = onto.shape[1]
    matrix, slope = matrix[:, :size, :size], slope[:, :size]
    return np.einsum("qi,bij,qj->bq", onto, matrix, onto), slope @ onto.T


def _noise_std(best: Solution) -> dict[str, float]:
    """Median deviations of motions and depths [m]."""
    motion = [
        np.median(one.moved_std_m[one.seen] * scale.of(one.kind)[0])
        for one, scale in zip(best.indentations, best.scales, strict=True)
    ]
    depth = [np.median(one.depth_std_m) for one in best.indentations]
    return {"motion": float(np.median(motion)), "depth": float(np.median(depth))}


def placed(best: Solution, count: int | None = None) -> Sequence[tuple[NDArray, Blocks]]:
    """Blocks of each capture with the places of its unknowns, or of the first so many of them."""
    shared = len(best.vector) - OWN * len(best.indentations)
    return [
        (np.concatenate([np.arange(shared), shared + OWN * k + np.arange(OWN)])[:count], block)
        for k, block in enumerate(best.blocks)
    ]
