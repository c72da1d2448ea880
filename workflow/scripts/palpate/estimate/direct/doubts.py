"""What speaks against an estimate that its intervals do not hold."""

from collections.abc import Iterator, Sequence

import numpy as np

from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.options import Fit

# Of a Poisson's ratio that was given, from what the captures say.
FAR_DEVIATIONS = 2.0
# Of the tip's way from the declared press: tables are of a press along it.
OBLIQUE_DEG = 10.0
# Of a depth's zero, from what tip and alignment say it is.
FAR_ZERO = 4.0
# Of depths, over what the pose of the board in each frame explains.
RESTLESS = 8.0
# Of log E from the ends of its range.
AT_END = 1e-6


def doubts_of(best: Solution, options: Fit) -> Iterator[str]:
    """Say what a reader of an estimate has to know beside its intervals, one line each."""
    if not best.converged:
        yield "the fit did not converge"
    if at_end(best, options):
        low, high = options.youngs_modulus_bounds_pa
        yield f"E lies at an end of its range, {low:g} to {high:g} Pa"
    given, nu = options.poisson_ratio, best.parameters[0].poisson_ratio
    if given is not None and abs(nu - given) > FAR_DEVIATIONS * options.poisson_ratio_std:
        apart = abs(nu - given) / options.poisson_ratio_std
        yield f"the captures pull nu to {nu:.3f}, {apart:.1f} deviations from the one given"
    if any((one.axis > 0).any() for one in best.indentations):
        yield "displacements in pictures are compared: intervals may be too narrow"
    yield from _of_captures(best)


def at_end(best: Solution, options: Fit) -> bool:
    """Whether E is as small or as large as it may be."""
    E = best.parameters[0].youngs_modulus_pa
    return bool(np.abs(np.log(np.array(options.youngs_modulus_bounds_pa) / E)).min() < AT_END)


def farthest_zero(best: Solution) -> tuple[float, float]:
    """Offset of a depth that is the most deviations from what is known of it [m], and how many."""
    zeros = zip(best.parameters, best.indentations, strict=True)
    apart = [(p.offset_m, abs(p.offset_m) / one.offset_std_m) for p, one in zeros]
    return max(apart, key=lambda pair: pair[1])


def _of_captures(best: Solution) -> Iterator[str]:
    beyond = [one.frames_beyond for one in best.indentations]
    if any(beyond):
        deepest = 1e3 * float(best.indentations[int(np.argmax(beyond))].table.depth_m[-1])
        frames = sum(len(one.frames) for one in best.indentations)
        yield (
            f"{sum(beyond)} of {frames + sum(beyond)} frames are deeper than the table's"
            f" {deepest:.1f} mm and were left out (deepest_m)"
        )
    depths = max(float(np.median(one.depth_std_m)) / one.tip_std_m for one in best.indentations)
    if depths > RESTLESS:
        yield f"depths scatter by {depths:.0f} times what the pictures of the probe explain"
    offset_m, apart = farthest_zero(best)
    if apart > FAR_ZERO:
        side = "below" if offset_m < 0 else "above"
        yield (
            f"the force begins {1e3 * abs(offset_m):.1f} mm {side} the surface,"
            f" {apart:.1f} deviations off (radius_m and transforms of the probe, template, clocks?)"
        )
    angles = np.rad2deg([one.oblique_rad for one in best.indentations])
    if angles.max() > OBLIQUE_DEG:
        yield f"the tip went {_some(angles)} degrees beside the declared direction of the press"


def _some(angles: Sequence[float]) -> str:
    return " to ".join(f"{angle:.0f}" for angle in sorted({min(angles), max(angles)}))
