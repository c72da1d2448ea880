"""E and nu straight from clouds and forces, whatever the law."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.budget import Budget, budget_of, covariance_of
from palpate.estimate.direct.doubts import contradictions, doubts_of
from palpate.estimate.direct.fit import Solution, fit_direct
from palpate.estimate.direct.indentation import (
    AXES,
    PLACES,
    DirectIndentation,
    Parameters,
    residuals,
)
from palpate.estimate.direct.interval import intervals
from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.probe_uncertainty import UNSTATED, ProbeUncertainty
from palpate.estimate.direct.quantities import Quantities, quantities_of
from palpate.estimate.direct.result import described
from palpate.estimate.direct.support_motion import MOTIONS
from palpate.modulus import Modulus, bounded_at_best
from palpate.solid.options import greatest_ratio
from palpate.units import MILLIMETRES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

START_POISSON_RATIOS = (0.1, 0.3, 0.45)


@dataclass(frozen=True)
class CaptureFit:
    """What one capture shows and what the estimate makes of it, in the k frames compared.

    Attributes
    ----------
    time_s, tip_depth_m : (f,) arrays
        Of all frames of the capture [s], and how deep the tip is in the object in them, its fitted
        offset and clock allowed for [m].
    frames : (k,) int array
        Those compared.
    force_n : (k,) array
        Along the press [N].
    depth_m, fitted_depth_m : (k,) arrays
        That depth in those compared, and as the force and the estimate have it [m].
    depth_expected_std_m : (k,) array
        Standard deviation that their difference is found to have [m].
    moved_m, fitted_moved_m : (k, c) arrays
        Motion of c samples of the surface; NaN where one was not seen [m].
    moved_expected_std_m : (k, c) array
        Standard deviation of their difference, in the same places [m].
    cell_m : (c, 3) array
        Places of the samples on the undeformed template, object frame [m].
    contact_m : (3,) array
        Where the tip first touches it [m].
    distance_m : (c,) array
        Of the samples from there [m].
    axis : (c,) int array
        0: along the surface's normal; 1, 2: across the line of sight, along the picture's columns
        and rows.
    """

    time_s: NDArray
    tip_depth_m: NDArray
    frames: NDArray
    force_n: NDArray
    depth_m: NDArray
    fitted_depth_m: NDArray
    depth_expected_std_m: NDArray
    moved_m: NDArray
    fitted_moved_m: NDArray
    moved_expected_std_m: NDArray
    cell_m: NDArray
    contact_m: NDArray
    distance_m: NDArray
    axis: NDArray


@dataclass(frozen=True, repr=False)
class DirectEstimate:
    """Moduli of captures of one object, with what they rest on.

    Attributes
    ----------
    solution : Solution
    moduli : dict of str to Modulus
    quantities : Quantities
        Among them the depth of the effective modulus.
    covariance : (size, size) array
        Of the solution's unknowns.
    budget : Budget
        What each source of error adds to the moduli's deviations.
    options : Fit
        That it was made with.
    excluded : tuple of str, optional
        What other estimates of the object say against it, one line each (`exclusions`).
    """

    solution: Solution
    moduli: dict[str, Modulus]
    quantities: Quantities
    covariance: NDArray
    budget: Budget
    options: Fit
    excluded: tuple[str, ...] = ()

    def __repr__(self) -> str:
        lines = [f"{name.removesuffix('_pa')}: {one}" for name, one in self.moduli.items()]
        count = len(self.solution.indentations)
        head = f"DirectEstimate of {count} capture{'s' * (count > 1)} (95 % intervals)"
        return "\n  ".join([head, *lines])

    @property
    def doubts(self) -> list[str]:
        """What speaks against the estimate beside its intervals, one line each."""
        return [*doubts_of(self.solution, self.options, self.std), *self.excluded]

    def beside(self, lines: Sequence[str]) -> "DirectEstimate":
        """The same with what other estimates of the object say against it (`exclusions`)."""
        moduli = bounded_at_best(self.moduli) if lines else self.moduli
        return replace(self, moduli=moduli, excluded=tuple(lines))

    def to_dict(self) -> dict:
        """All that direct.json says of it."""
        return described(self)

    def captures(self) -> list[CaptureFit]:
        """What each capture shows, beside what the estimate makes of it."""
        times = np.array(self.options.relaxation_times_s, dtype=float)
        best = self.solution
        found = []
        each = zip(best.indentations, best.parameters, best.scales, strict=True)
        for one, p, scale in each:
            gaps = residuals(one, p, times_s=times)
            measured = one.depth_m + p.offset_m + p.clock_s * one.speed_m_s
            gap = np.full(one.moved_m.shape, np.nan)
            gap[one.seen] = gaps.motion * one.moved_std_m[one.seen]
            moved, std = (np.where(one.seen, of, np.nan) for of in (one.moved_m, one.moved_std_m))
            std[one.seen] *= scale.of(one.kind)[0]
            found.append(
                CaptureFit(
                    time_s=one.time_s,
                    tip_depth_m=_seen_depth(one, p),
                    frames=one.frames,
                    force_n=one.force_n[one.frames],
                    depth_m=measured,
                    fitted_depth_m=measured + one.depth_root_m @ gaps.depth,
                    depth_expected_std_m=one.depth_std_m,
                    moved_m=moved,
                    fitted_moved_m=moved - gap,
                    moved_expected_std_m=std,
                    cell_m=one.cell_m,
                    contact_m=one.contact_m,
                    distance_m=np.linalg.norm(one.cell_m - one.contact_m, axis=1),
                    axis=one.axis,
                )
            )
        return found

    def plot(self, axes: "Axes") -> None:
        """Draw force over indentation of each capture, seen and fitted, into axes of Matplotlib."""
        for number, one in enumerate(self.captures()):
            order = np.argsort(one.fitted_depth_m)
            seen = {"color": "#9A9A9A", "label": None if number else "seen"}
            fitted = {"color": "#D55E00", "label": None if number else "fitted"}
            axes.plot(MILLIMETRES * one.depth_m, one.force_n, ".", **seen)
            depth = MILLIMETRES * one.fitted_depth_m
            axes.plot(depth[order], one.force_n[order], lw=0.9, **fitted)
        axes.set(xlabel="indentation (mm)", ylabel="force (N)")
        axes.legend()

    @property
    def std(self) -> NDArray:
        """Standard deviations of the solution's unknowns, (size,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def bound(self) -> NDArray:
        """Cramér-Rao bound of the deviations of `quantities.NAMES`, (7,).

        Of the residuals with their deviations as found and the priors, which count as data (van
        Trees, 1968); errors of rig and table and captures that are apart have no part in it.
        """
        slopes = self.quantities.slopes
        return np.sqrt(np.diag(slopes @ self.covariance @ slopes.T))


def estimate_direct(
    indentations: Sequence[DirectIndentation],
    options: Fit,
    known: ProbeUncertainty = UNSTATED,
    *,
    radius_m: float,
) -> DirectEstimate:
    """Estimate the moduli of an object from one or more of its captures.

    Parameters
    ----------
    indentations : sequence of DirectIndentation
    options : Fit
    known : ProbeUncertainty, optional
        What is stated of the probe's own numbers.
    radius_m : float
        Of the sphere.

    Raises
    ------
    ValueError
        If the tables have no Poisson's ratio in common.
    """
    options = within_tables(indentations, options)
    best = best_of_starts(indentations, options)
    covariance = covariance_of(best, options)
    quantities = quantities_of(best, options, radius_m=radius_m)
    budget = budget_of(best, covariance, quantities, options, known, radius_m=radius_m)
    moduli = intervals(best, covariance, quantities, budget, options)
    if any(contradictions(best, options, np.sqrt(np.diag(covariance)))):
        moduli = bounded_at_best(moduli)
    return DirectEstimate(best, moduli, quantities, covariance, budget, options)


def within_tables(indentations: Sequence[DirectIndentation], options: Fit) -> Fit:
    """Options whose Poisson's ratios all tables serve for.

    Raises
    ------
    ValueError
        If there are none.
    """
    ratios = [one.table.poisson_ratios for one in indentations]
    low = max(options.poisson_ratio_bounds[0], *(each[0] for each in ratios))
    high = min(options.poisson_ratio_bounds[1], *(greatest_ratio(each) for each in ratios))
    if not low < high:
        expected = f"low below high within the tables' {low:g} to {high:g}"
        found = ", ".join(f"{end:g}" for end in options.poisson_ratio_bounds)
        raise ValueError(f"poisson_ratio_bounds: expected {expected}, found {found}")
    known = options.poisson_ratio
    if known is not None and not low <= known <= high:
        raise ValueError(f"poisson_ratio: expected {low:g} to {high:g}, found {known:g}")
    return options.changed(poisson_ratio_bounds=(float(low), float(high)))


def best_of_starts(indentations: Sequence[DirectIndentation], options: Fit) -> Solution:
    """Least cost from starts over the range of Poisson's ratios."""
    found = []
    for nu in START_POISSON_RATIOS:
        start = _start(indentations[0], nu, len(options.relaxation_times_s))
        found.append(fit_direct(indentations, options, start))
    first = min(found, key=lambda solution: solution.cost)
    # Costs of fits with scales of their own can't be compared.
    again = [
        fit_direct(first.indentations, options, solution.parameters[0], scales=first.scales)
        for solution in found
    ]
    return min(again, key=lambda solution: solution.cost)


def _seen_depth(one: DirectIndentation, p: Parameters) -> NDArray:
    """How deep the tip is in the object in all frames, offset and clock allowed for [m]."""
    return one.tip_depth_m + p.offset_m + p.clock_s * np.gradient(one.tip_depth_m, one.time_s)


def _start(indentation: DirectIndentation, nu: float, terms: int) -> Parameters:
    unit = indentation.table.force(np.maximum(indentation.depth_m, 0), nu, 0.0)
    force = indentation.force_n[indentation.frames]
    E = max(float((force @ unit) / max(float(unit @ unit), 1e-300)), 1.0)
    own = (0.0, 0.0, *map(np.zeros, (AXES, PLACES, PLACES, MOTIONS)))
    return Parameters(E, nu, 0.0, 0.0, 0.0, np.full(terms, 0.02), *own)
