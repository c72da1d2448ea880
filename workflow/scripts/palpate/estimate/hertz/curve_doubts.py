"""What speaks against trusting the modulus of a curve, in words."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palpate.units import PERCENT, readable

if TYPE_CHECKING:
    from palpate.estimate.hertz.curve_fit import HertzFit

# Part of the way at either end that stands for the free and the pressed force.
END = 0.05
# A force that rises by fewer deviations of its noise, or whose scatter a law explains less of than
# this, is none.
RISE_DEVIATIONS, LEAST_EXPLAINED = 3.0, 0.5
# Beyond one radius no law of a sphere holds; beyond so many it is a unit in error.
DEEP, ABSURD = 1.0, 5.0
# Contact so far before the record, as part of the press, is a guess.
BEFORE = 0.02
# An interval this narrow is of made-up data.
EXACT = 1e-6
FEWEST_IN_CONTACT, FEWEST_FITTED = 10, 3
# Residuals are a pattern, not noise, where fewer of them than this part are independent.
INDEPENDENT = 0.1
# An approach that rises or falls by more than this part of the peak is none of a level.
SLOPING = 0.05
# Smaller changes of E* are not worth a line.
LEAST_CHANGE = 0.01
# Rms of the residuals over the peak, and what is said of it.
QUALITIES = ((0.01, "good"), (0.03, "fair"), (np.inf, "poor"))


def require_press(depth_m: NDArray, force_n: NDArray) -> None:
    """Refuse a record whose force does not rise above its noise.

    Raises
    ------
    ValueError
    """
    place = (depth_m - depth_m.min()) / np.ptp(depth_m)
    free, pressed = force_n[place <= END], force_n[place >= 1 - END]
    # The free end's own scatter where it has enough samples; a slope is no noise of steps.
    noise = float(free.std(ddof=1)) if len(free) > 2 else 0.0
    rise = float(pressed.mean() - free.mean())
    if rise < RISE_DEVIATIONS * noise:
        scale, unit = readable(max(rise, noise), "N")
        found = f"{scale * rise:.2g} {unit} in noise of {scale * noise:.2g} {unit}"
        raise ValueError(f"force: expected a rise of three times its noise, found {found}")


def require_contact(depth_m: NDArray, contact_m: float) -> None:
    """Refuse a fit that found no press: its contact lies at the record's end.

    Raises
    ------
    ValueError
    """
    found = int((depth_m > contact_m).sum())
    if found < FEWEST_FITTED or not depth_m.max() > contact_m:
        expected = f"expected {FEWEST_FITTED} samples or more deeper than the contact"
        hint = "(is it a press, the force's sign right, the approach flat?)"
        raise ValueError(f"contact: {expected}, found {found} {hint}")


def quality_of(rms_n: float, fitted_n: NDArray) -> str:
    """How well a law follows samples, in words."""
    part = rms_n / float(np.ptp(fitted_n))
    word = next(name for limit, name in QUALITIES if part <= limit)
    return f"{word} fit, residuals of {PERCENT * part:.2g} % of the peak"


def doubts_of(found: "HertzFit") -> Iterator[str]:
    """What speaks against a fit, a line each."""
    yield from _of_depth(found)
    yield from _of_samples(found)


def hangs_on(found: "HertzFit") -> Iterator[str]:
    """Which other choices would move E* out of its interval, a line each."""
    low, high = found.reduced_modulus_interval_pa
    for name, modulus in found.others.items():
        part = modulus / found.reduced_modulus_pa - 1
        if not low <= modulus <= high and abs(part) >= LEAST_CHANGE:
            scale, unit = readable(modulus, "Pa")
            yield f"{name} E* would be {scale * modulus:.4g} {unit} ({PERCENT * part:+.2g} %)"


def _of_depth(found: "HertzFit") -> Iterator[str]:
    radius = found.setup.effective_radius_m
    if radius is not None and found.press_m > DEEP * radius:
        why = "no law of a sphere holds there"
        if found.press_m > ABSURD * radius:
            why = "is the unit of the depth, or the radius, another?"
        yield f"the press is {found.press_m / radius:.3g} radii of the sphere deep: {why}"
    before = float(found.depth_m.min()) - found.contact_m
    if before > BEFORE * found.press_m:
        scale, unit = readable(before, "m")
        yield (
            f"contact lies {scale * before:.3g} {unit} before the record's first sample, where"
            " nothing was measured"
        )


def _of_samples(found: "HertzFit") -> Iterator[str]:
    count = int((found.depth_m > found.contact_m).sum())
    if count < FEWEST_IN_CONTACT:
        yield f"{count} samples lie in contact: expected {FEWEST_IN_CONTACT} or more"
    low, high = found.reduced_modulus_interval_pa
    if high - low < EXACT * found.reduced_modulus_pa:
        yield "the samples lie on the law exactly, as made-up ones do: the interval says nothing"
        return
    power = float(np.sum((found.force_n - found.force_n.mean()) ** 2))
    explained = 1 - float(np.sum(found.residual_n**2)) / power
    if explained < LEAST_EXPLAINED:
        yield f"the law explains {PERCENT * explained:.2g} % of the force's scatter"
    count, left = len(found.force_n), found.effective_samples
    if left < INDEPENDENT * count:
        yield (
            f"the residuals follow a pattern, as of {left:.0f} samples and not {count}: law,"
            " baseline or range is another"
        )
    yield from _of_approach(found)


def _of_approach(found: "HertzFit") -> Iterator[str]:
    """An approach that slopes, as of a drifting or a tilted baseline."""
    before = found.depth_m < found.contact_m
    if before.sum() < FEWEST_IN_CONTACT:
        return
    depth, force = found.depth_m[before], found.force_n[before]
    slope = float(np.polyfit(depth - depth.mean(), force, 1)[0])
    rise = slope * float(np.ptp(depth)) / float(np.ptp(found.fitted_n))
    if abs(rise) > SLOPING:
        yield (
            f"the approach slopes, by {PERCENT * rise:+.2g} % of the peak: a tilted or drifting"
            " baseline (--range-mm leaves it out)"
        )
