"""What speaks against an estimate that its intervals do not hold.

Of one estimate by itself, and of estimates of one object whose intervals exclude each other.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf

import numpy as np
from scipy.special import bdtrc

from palpate.estimate.direct.deviations import ROBUST
from palpate.estimate.direct.fit import Solution
from palpate.estimate.direct.indentation import FORCE_LAW, MOTION_LAW, residuals
from palpate.estimate.direct.prior import FARTHEST_LAW
from palpate.modulus import CONFIDENCE, LABELS, NOT_JUDGED, Modulus

# Of a Poisson's ratio that was given, from what the captures say, and of a material-law parameter
# from its prior's mean.
FAR_DEVIATIONS, FAR_LAW = 2.0, 3.0
# Of the tip's way from the declared indentation: tables are of an indentation along it.
OBLIQUE_DEG = 10.0
# Of a depth's zero, from what tip and alignment say it is, and of depths, over what the pose of the
# target in each frame explains.
FAR_ZERO, RESTLESS = 4.0, 8.0
# Of log E, and of the material-law parameter of the force, from the ends of their ranges.
AT_END = 1e-6
# Of residuals so near to the contact, in frames with so much of the greatest force, over the noise
# at rest: a sensor's fixed pattern moves with the surface (1.2 to 2.1 in estimates that hold).
NEAR_M, LOADED, FAR_RESIDUALS = 0.045, 0.7, 3.0


def warnings_of(best: Solution) -> Iterator[str]:
    """Say what a reader of an estimate has to know beside its intervals, one line each."""
    options, nu = best.options, best.parameters[0].poisson_ratio
    (low, high), given = options.youngs_modulus_bounds_pa, options.poisson_ratio
    apart = 0.0 if given is None else abs(nu - given) / options.poisson_ratio_std
    pulled = f"the captures pull nu to {nu:.3f}, {apart:.1f} deviations from the one given"
    lines = [
        (not best.converged, "the fit did not converge"),
        (at_end(best), f"E lies at an end of its range, {low:g} to {high:g} Pa"),
        (apart > FAR_DEVIATIONS, pulled),
        *_of_captures(best),
    ]
    yield from (line for holds, line in lines if holds)
    yield from contradictions(best)


def contradictions(best: Solution) -> Iterator[str]:
    """Warnings with which nothing is identified, however narrow its interval is."""
    first, std = best.parameters[0], best.std
    laws = {
        "force": (first.force_law, std[FORCE_LAW]),
        "surface displacement": (first.motion_law, std[MOTION_LAW]),
    }
    for name, (value, deviation) in laws.items():
        if name == "force" and abs(value) > FARTHEST_LAW - AT_END:
            yield (
                f"material-law parameter of the force at its bound, {value:+g} +- {deviation:.2f}:"
                " no law as far as there explains forces and depths, and intervals do not hold what"
                " is beyond"
            )
        elif abs(value) > FAR_LAW * deviation:
            yield (
                f"material-law parameter of the {name} {value:+.2f} +- {deviation:.2f},"
                f" {abs(value) / deviation:.0f} deviations from neo-Hooke's 0: the material has"
                " another law, or depths and displacements contradict each other"
            )
    ratio = residuals_over_noise(best)
    if ratio > FAR_RESIDUALS:
        yield (
            f"residuals of surface displacements are, under load, {ratio:.1f} times the noise at"
            " rest: what they err by is not known"
        )


def residuals_over_noise(best: Solution) -> float:
    """Root mean square of displacements' residuals under load, over their noise at rest.

    Near the contact, none counted with more than `ROBUST`; 0 where there are none.
    """
    found = []
    for one, p in zip(best.indentations, best.parameters, strict=True):
        gaps = residuals(one, p).motion * (one.moved_std_m / one.noise_std_m)[one.seen]
        near = np.linalg.norm(one.cell_m - one.contact_m, axis=1) < NEAR_M
        at = np.outer(one.load >= LOADED, near)[one.seen]
        found.append(np.minimum(gaps[at] ** 2, ROBUST**2))
    squares = np.concatenate(found)
    return float(np.sqrt(squares.mean())) if len(squares) else 0.0


def at_end(best: Solution) -> bool:
    """Whether E is as small or as large as it may be."""
    ends = np.array(best.options.youngs_modulus_bounds_pa)
    return bool(np.abs(np.log(ends / best.parameters[0].youngs_modulus_pa)).min() < AT_END)


def farthest_zero(best: Solution) -> tuple[float, float]:
    """Offset of a depth that is the most deviations from what is known of it [m], and how many."""
    zeros = zip(best.parameters, best.indentations, strict=True)
    apart = [(p.offset_m, abs(p.offset_m) / one.zero_std_m) for p, one in zeros]
    return max(apart, key=lambda pair: pair[1])


def _of_captures(best: Solution) -> list[tuple[bool, str]]:
    """What may hold of captures, and what is said if it does."""
    captures = best.indentations
    beyond = [one.frames_beyond for one in captures]
    frames = sum(beyond) + sum(len(one.frames_pictured[1]) for one in captures)
    deepest_mm = 1e3 * float(captures[int(np.argmax(beyond))].table.depth_m[-1])
    depths = max(float(np.median(one.depth_std_m)) / one.tip_std_m for one in captures)
    (offset_m, apart), angles = farthest_zero(best), np.rad2deg([o.oblique_rad for o in captures])
    begins = f"{1e3 * abs(offset_m):.1f} mm {'below' if offset_m < 0 else 'above'} the surface"
    ends = " to ".join(f"{angle:.0f}" for angle in sorted({angles.min(), angles.max()}))
    deep = f"{sum(beyond)} of {frames} frames are deeper than the table's {deepest_mm:.1f} mm"
    causes = "radius_m and transforms of the probe, template, clocks?"
    return [
        (any(beyond), f"{deep} and were left out (deepest_m)"),
        (depths > RESTLESS, f"depths scatter by {depths:.0f} times what the probe's poses explain"),
        (apart > FAR_ZERO, f"the force begins {begins}, {apart:.1f} deviations off ({causes})"),
        (
            angles.max() > OBLIQUE_DEG,
            f"the tip went {ends} degrees beside the declared direction of the press",
        ),
    ]


@dataclass(frozen=True)
class Estimated:
    """One estimate of an object: whose, like "all captures by the Kinect", and its moduli.

    These are by the names of `LABELS`, and others. Joint: of all captures with a sensor, and
    recommended.
    """

    whose: str
    moduli: Mapping[str, Modulus]
    joint: bool


def exclusions(estimates: Sequence[Estimated]) -> list[list[str]]:
    """What the others say against each estimate of an object, one line each.

    Of single captures one in twenty may miss by chance: each that a joint estimate excludes has a
    warning, and the joint estimate has one where there are more of them than chance explains
    (binomial, by the intervals' own confidence, as if one modulus were compared).
    """
    found: list[list[str]] = [[] for _ in estimates]
    joints = [k for k, one in enumerate(estimates) if one.joint]
    singles = [k for k, one in enumerate(estimates) if not one.joint]
    for a, b in combinations(joints, 2):
        for line in _apart(estimates[a], estimates[b]):
            found[a].append(line)
            found[b].append(line)
    for k in joints:
        lines = {s: line for s in singles for line in _apart(estimates[k], estimates[s])}
        for s, line in lines.items():
            found[s].append(line)
        if lines and bdtrc(len(lines) - 1, len(singles), 1 - CONFIDENCE) < 1 - CONFIDENCE:
            count = f"{len(lines)} of {len(singles)} single captures"
            found[k].append(f"intervals of {estimates[k].whose} and of {count} exclude each other")
    return found


def _apart(one: Estimated, other: Estimated) -> Iterator[str]:
    """A line of the first modulus whose intervals have no value in common, if there is one."""
    for name, label in LABELS.items():
        pair = one.moduli[name], other.moduli[name]
        if any(each.low is None or each.verdict == NOT_JUDGED for each in pair):
            continue
        high = min(inf if each.high is None else each.high for each in pair)
        if max(each.low for each in pair) > high:
            both = zip((one, other), pair, strict=True)
            of_each = " and ".join(f"of {each.whose}, {modulus.text()}," for each, modulus in both)
            yield f"{label} {of_each} exclude each other"
            return
