"""E and nu straight from clouds and forces, whatever the law."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct import indentation as unknown
from palpate.estimate.direct.budget import Budget, budget_of
from palpate.estimate.direct.fit import Solution, fit_direct
from palpate.estimate.direct.indentation import DirectIndentation, Parameters, residuals
from palpate.estimate.direct.options import UNSTATED, Fit, ProbeUncertainty
from palpate.estimate.direct.quantities import NAMES, Profile, Quantities, intervals, quantities_of
from palpate.estimate.direct.result import CaptureFit, described_law, nuisances, regions_of, summed
from palpate.estimate.direct.warnings import contradictions, warnings_of
from palpate.modulus import Modulus, bounded_at_best
from palpate.solid.options import greatest_ratio

START_POISSON_RATIOS = (0.1, 0.3, 0.45)


@dataclass(frozen=True, repr=False)
class DirectEstimate:
    """Moduli of captures of one object, with what they rest on.

    Attributes
    ----------
    solution : Solution
    moduli : dict of str to Modulus
    quantities : Quantities
        Among them the depth of the effective modulus.
    budget : Budget
        What each source of error adds to the moduli's deviations.
    excluded : tuple of str, optional
        What other estimates say against it, one line each (`exclusions`).
    """

    solution: Solution
    moduli: dict[str, Modulus]
    quantities: Quantities
    budget: Budget
    excluded: tuple[str, ...] = ()

    def __repr__(self) -> str:
        lines = [f"{name.removesuffix('_pa')}: {one}" for name, one in self.moduli.items()]
        count = len(self.solution.indentations)
        head = f"DirectEstimate of {count} capture{'s' * (count > 1)} (95 % intervals)"
        return "\n  ".join([head, *lines])

    @property
    def options(self) -> Fit:
        """That it was made with."""
        return self.solution.options

    @property
    def warnings(self) -> list[str]:
        """What speaks against the estimate beside its intervals, one line each."""
        return [*warnings_of(self.solution), *self.excluded]

    def beside(self, lines: Sequence[str]) -> "DirectEstimate":
        """The same with what other estimates of the object say against it (`exclusions`)."""
        moduli = bounded_at_best(self.moduli) if lines else self.moduli
        return replace(self, moduli=moduli, excluded=tuple(lines))

    def to_dict(self) -> dict:
        """All that direct.json says of it."""
        best, first = self.solution, self.solution.parameters[0]
        # Least deviations of log moduli and nu, and their parts of those that are stated.
        bound = zip(NAMES, self.bound, self.bound / self.budget.std, strict=True)
        times_s, fractions = self.options.relaxation_times_s, first.fractions.tolist()
        return {
            "frames": [len(one.frames_pictured[1]) for one in best.indentations],
            "frames_beyond_lookup": [one.frames_beyond for one in best.indentations],
            **{name: asdict(modulus) for name, modulus in self.moduli.items()},
            **described_law(best, self.quantities),
            "regions": {name: one.tolist() for name, one in regions_of(best).items()},
            "relaxation": {"times_s": list(times_s), "fractions": fractions},
            "gain": first.gain,
            "nuisances": [nuisances(best, k) for k in range(len(best.indentations))],
            "residuals": list(map(summed, best.indentations, best.scales)),
            "budget": self.budget.rows(),
            "information": {name: {"bound": b, "efficiency": part} for name, b, part in bound},
            "converged": best.converged,
            "warnings": self.warnings,
        }

    def captures(self) -> list[CaptureFit]:
        """What each capture shows in the camera's frames, beside what the estimate makes of it."""
        found, best = [], self.solution
        for one, p, scale in zip(best.indentations, best.parameters, best.scales, strict=True):
            gaps, (at, rows, numbers) = residuals(one, p), one.frames_pictured
            measured = one.depth_m + p.offset_m + p.clock_s * one.speed_m_s
            gap, moved, std = np.full((3, *one.moved_m.shape), np.nan)
            gap[one.seen] = gaps.motion * one.moved_std_m[one.seen]
            moved[one.seen] = one.moved_m[one.seen]
            std[one.seen] = one.moved_std_m[one.seen] * scale.motion
            found.append(
                CaptureFit(
                    time_s=one.time_s[at],
                    tip_depth_m=(one.tip_depth_m + p.offset_m + p.clock_s * one.tip_speed_m_s)[at],
                    frames=numbers,
                    force_n=one.force_n[one.frames][rows],
                    depth_m=measured[rows],
                    fitted_depth_m=(measured + one.depth_root_m @ gaps.depth)[rows],
                    depth_expected_std_m=one.depth_std_m[rows],
                    moved_m=moved[rows],
                    fitted_moved_m=(moved - gap)[rows],
                    moved_expected_std_m=std[rows],
                    cell_m=one.cell_m,
                    contact_m=one.contact_m,
                    distance_m=np.linalg.norm(one.cell_m - one.contact_m, axis=1),
                )
            )
        return found

    @property
    def bound(self) -> NDArray:
        """Cramér-Rao bound of the deviations of `quantities.NAMES`, (7,).

        Of the residuals with their deviations as found and the priors, which count as data (van
        Trees, 1968); errors of rig and table and captures that are apart have no part in it.
        """
        slopes = self.quantities.slopes
        return np.sqrt(np.diag(slopes @ self.solution.covariance @ slopes.T))


def estimate_direct(
    indentations: Sequence[DirectIndentation],
    options: Fit,
    known: ProbeUncertainty = UNSTATED,
    *,
    radius_m: float,
) -> DirectEstimate:
    """Estimate the moduli of an object from one or more of its captures.

    ``known`` is what is stated of the probe's own numbers, and ``radius_m`` is the sphere's [m].

    Raises
    ------
    ValueError
        If there is no indentation, or the tables have no Poisson's ratio in common.
    """
    if not indentations:
        raise ValueError("indentations: expected one or more, found none")
    options = _within_tables(indentations, options)
    starts = [_start(indentations[0], nu, options) for nu in START_POISSON_RATIOS]
    best = fit_direct(indentations, options, *starts)
    quantities = quantities_of(best, radius_m=radius_m)
    budget = budget_of(best, quantities, known, radius_m=radius_m)
    moduli = intervals(best, quantities, budget, Profile.of(best, quantities, budget))
    if any(contradictions(best)):
        moduli = bounded_at_best(moduli)
    return DirectEstimate(best, moduli, quantities, budget)


def _within_tables(indentations: Sequence[DirectIndentation], options: Fit) -> Fit:
    """Options whose Poisson's ratios all tables serve for."""
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


def _start(indentation: DirectIndentation, nu: float, options: Fit) -> Parameters:
    unit = indentation.table.force(np.maximum(indentation.depth_m, 0), nu, 0.0)
    E = max(indentation.force_n[indentation.frames] @ unit / max(unit @ unit, 1e-300), 1.0)
    times_s = np.array(options.relaxation_times_s, dtype=float)
    vector = np.zeros(unknown.SHARED + len(times_s) + unknown.OWN)
    vector[[unknown.LOG_E, unknown.NU]] = np.log(E), nu
    vector[unknown.SHARED : -unknown.OWN] = 0.02  # of the relaxation's amplitudes
    return Parameters(vector, times_s)
