"""Uncertainty budget: what each source of error adds to the deviations of the moduli.

Standard uncertainties are those of the priors and of the noise that the residuals show; they go
to the moduli through the linearised least squares, and add up in squares (JCGM 100:2008, Eq. 10).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.fit import Part, Solution
from palpate.estimate.direct.indentation import OWN, DirectIndentation, linearised, residuals
from palpate.estimate.direct.options import CONFIGURED, OBSERVED, UNSTATED, ProbeUncertainty, Rig
from palpate.estimate.direct.prior import UNMOVED
from palpate.estimate.direct.quantities import (
    LOG_MODULI,
    NAMES,
    POISSON,
    Quantities,
    over_star_by_nu,
)
from palpate.modulus import LABELS
from palpate.solid.indentation_table import ratio_weights

# By how much captures may be apart for no reason that is known, in deviations of one of them (half
# of a normal distribution), and what is tried.
PRIOR_EXCESS, EXCESSES = 0.5, np.linspace(0, 10, 1001)
# Fewer patches or frames don't show their own scatter.
FEWEST_PARTS = 4.0
COLUMNS = [
    f"log_{name.removesuffix('_pa')}" if log else name
    for name, log in zip(NAMES, LOG_MODULI, strict=True)
]
Change = Callable[[DirectIndentation, float], DirectIndentation]
# Priors of what each capture has for itself.
OWN_SOURCES = ("offset of the depth", "offset of the displacement", "place of the contact")
OWN_SOURCES += ("clocks of camera and force", "clocks of poses and camera")


@dataclass(frozen=True)
class Source:
    """One source of error.

    Attributes
    ----------
    name, unit : str
    std : float
        Its standard uncertainty, in its unit.
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


def budget_of(
    best: Solution, quantities: Quantities, known: ProbeUncertainty = UNSTATED, *, radius_m: float
) -> Budget:
    """What each source adds to the uncertainties of the moduli.

    ``known`` is what is stated of the probe's own numbers, and ``radius_m`` is the sphere's [m].
    """
    onto = quantities.slopes @ best.covariance
    # Those that are unknowns of the fit: their priors, through the data.
    sources = [
        Source(name, std, unit, np.linalg.norm(onto @ response.T, axis=1))
        for name, unit, std, response in best.prior.errors
        if std > 2 * UNMOVED
    ]
    sources += _of_noise(onto, best)
    own = [s for s in sources if s.name in OWN_SOURCES or s.name.startswith("noise")]
    sources += _of_captures(onto, best, sum(source.contributions**2 for source in own))
    sources += _of_rig(onto, best, known.rig(best.options.rig), radius_m)
    sources += _of_table(best, quantities)
    there = [
        replace(one, origin=known.origins.get(one.name, one.origin))
        for one in sources
        if one.std > 0
    ]
    return Budget(tuple(sorted(there, key=lambda source: -source.contributions[0])))


def _of_rig(onto: NDArray, best: Solution, rig: Rig, radius_m: float) -> list[Source]:
    """Sources that are no unknowns: what the fit makes of a capture that each has changed.

    In Hertz's contact the force at a depth goes with the root of the effective radius R, whose
    inverse is the sum of the sphere's and the surface's curvatures: -R/2 for a curvature.
    """

    def force(change: Callable[[DirectIndentation], NDArray | float]) -> Change:
        return lambda one, error: replace(one, force_n=one.force_n + error * change(one))

    def scaled(by: float) -> Change:
        return force(lambda one: by * one.force_n)

    def compliant(one: DirectIndentation, error: float) -> DirectIndentation:
        """The probe's target goes down farther than its tip."""
        return replace(one, depth_m=one.depth_m - error * one.force_n[one.frames])

    # By so much from the beginning of the record to its end.
    drifting = force(lambda one: (one.time_s - one.time_s[0]) / np.ptp(one.time_s))
    # Source, deviation, its unit, what an error makes of a capture, and whether all have the same.
    errors = [
        ("scale of the force", rig.force_scale_std, "1", scaled(1.0), True),
        ("offset of the force", rig.force_zero_std_n, "N", force(lambda _: 1.0), False),
        ("drift of the force", rig.force_drift_std_n, "N", drifting, False),
        ("radius of the tip", rig.radius_std_m, "m", scaled(-1 / (2 * radius_m)), True),
        ("curvature of the template", rig.curvature_std_per_m, "1/m", scaled(radius_m / 2), True),
        ("compliance of the probe", rig.compliance_std_m_n, "m/N", compliant, True),
    ]
    moved = np.zeros((len(errors), len(best.indentations), len(onto)))
    each = zip(best.indentations, best.parameters, best.scales, best.places, strict=True)
    for k, (one, p, scale, at) in enumerate(each):
        line = linearised(one, p)
        motion_rows = (line.motion_slope * scale.weights(line.motion)[:, None]).T
        for by_capture, (_, std, _, changed, _) in zip(moved, errors, strict=True):
            other = residuals(changed(one, std), p)
            change = line.depth_slope.T @ (other.depth - line.depth)
            change += motion_rows @ (other.motion - line.motion)
            by_capture[k] = -onto[:, at] @ change
    alone, together = np.sqrt((moved**2).sum(axis=1)), np.abs(moved.sum(axis=1))
    return [
        Source(name, std, unit, (together if common else alone)[k])
        for k, (name, std, unit, _, common) in enumerate(errors)
    ]


def _of_noise(onto: NDArray, best: Solution) -> list[Source]:
    """Noise of displacements and depths, as large as the fit's deviations and sharing have it."""
    each = list(zip(best.indentations, best.scales, strict=True))
    motion = [np.median(one.moved_std_m[one.seen] * s.motion) for one, s in each]
    depth = [np.median(one.depth_std_m) for one in best.indentations]
    found = []
    for kind, of, stds in (("motion", "displacement", motion), ("depth", "depth", depth)):
        blocks = zip(best.places, best.blocks, strict=True)
        shares = np.concatenate([_shares(onto[:, at], getattr(b, kind))[0] for at, b in blocks])
        # As many equal parts are like these: many may say next to nothing.
        whole = shares.sum(axis=0)
        count = whole**2 / np.maximum((shares**2).sum(axis=0), 1e-300)
        freedom = np.maximum(count, FEWEST_PARTS) - 1
        std, name = float(np.median(stds)), f"noise of the {of}"
        found.append(Source(name, std, "m", np.sqrt(whole), freedom, OBSERVED))
    return found


def _of_table(best: Solution, quantities: Quantities) -> list[Source]:
    """Sources of the indentation table; E, G and K follow nu at the same E*."""
    stds = best.options.model_std
    with_nu = np.abs(over_star_by_nu(float(quantities.values[POISSON])))
    with_nu[POISSON] = 1.0
    terms = [
        ("indentation table: force", stds.log_youngs_modulus, LOG_MODULI),
        ("indentation table: displacement", stds.nu, with_nu),
        ("friction at the sphere", stds.sphere_friction, LOG_MODULI),
    ]
    found = [Source(name, std, "1", std * by) for name, std, by in terms]
    if loose := [one.table for one in best.indentations if one.table.softer is not None]:
        # Anywhere between a base that sticks and one that slides freely: uniform.
        nu = float(quantities.values[POISSON])
        softer = [ratio_weights(table.poisson_ratios, nu)[0] @ table.softer for table in loose]
        force = max(float(np.abs(one).max()) for one in softer) / np.sqrt(12)
        parts = np.hypot(stds.nu_loose * with_nu, force * LOG_MODULI)
        found.append(Source("indentation table: base friction", stds.nu_loose, "1", parts))
    return found


def _of_captures(onto: NDArray, best: Solution, explained: NDArray) -> list[Source]:
    """By how much captures are farther apart than their noise and own unknowns explain.

    What each capture moves the moduli by, less the mean of all, against the variances (7,) that the
    noise and what each capture has for itself explain. Of so few captures a third is farther apart
    than expected by chance alone, so the excess is what is likely with `PRIOR_EXCESS` known
    beforehand (A. Gelman, Bayesian Anal. 1, 2006, 515).
    """
    count = len(best.blocks)
    if count < 2:
        return []
    shared = onto[:, : len(best.vector) - OWN * count]
    moved = np.stack(
        [sum(_shares(shared, part)[1].sum(axis=0) for part in block) for block in best.blocks]
    )
    scatter = count * moved.var(axis=0, ddof=1) / np.maximum(explained, 1e-300)
    parts = np.sqrt(explained * _likely_excess(scatter, count - 1))
    most = float(parts[: len(LABELS)].max())
    return [Source("captures that differ", most, "1", parts, count - 1.0, OBSERVED)]


def _likely_excess(scatter: NDArray, freedom: int) -> NDArray:
    """Variance beyond 1 that variances of so many degrees of freedom speak for, as many."""
    excess = EXCESSES[:, None] ** 2
    cost = freedom * (np.log1p(excess) + scatter / (1 + excess))
    cost = cost + (EXCESSES[:, None] / PRIOR_EXCESS) ** 2
    weight = np.exp((cost.min(axis=0) - cost) / 2)
    return (weight * excess).sum(axis=0) / weight.sum(axis=0)


def _shares(onto: NDArray, part: Part) -> tuple[NDArray, NDArray]:
    """Of each patch or frame: its expected part of the variances, and what it moves, (b, 7)."""
    size = onto.shape[1]
    matrix, slope = part.matrix[:, :size, :size], part.slope[:, :size]
    return np.einsum("qi,bij,qj->bq", onto, matrix, onto), slope @ onto.T
