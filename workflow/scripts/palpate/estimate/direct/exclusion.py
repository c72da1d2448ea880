"""Estimates of one object whose intervals exclude each other."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf

from scipy.special import bdtrc

from palpate.modulus import CONFIDENCE, LABELS, NOT_JUDGED, Modulus


@dataclass(frozen=True)
class Estimated:
    """One estimate of an object.

    Attributes
    ----------
    whose : str
        What it is of, like "all captures by the Kinect".
    moduli : mapping
        By the names of `LABELS`, and others.
    joint : bool
        Whether it is of all captures with a sensor, and recommended.
    """

    whose: str
    moduli: Mapping[str, Modulus]
    joint: bool


def exclusions(estimates: Sequence[Estimated]) -> list[list[str]]:
    """What the others say against each estimate of an object, one line each.

    Of single captures one in twenty may miss by chance: each that a joint estimate excludes has a
    warning, and the joint estimate has one where there are more of them than chance explains
    (binomial, by the intervals' own confidence, as if one modulus were compared).

    Parameters
    ----------
    estimates : sequence of Estimated
        Of one object.

    Returns
    -------
    list of list of str
        One for each estimate.
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
        if max(each.low for each in pair) > min(
            inf if each.high is None else each.high for each in pair
        ):
            told = zip((one, other), pair, strict=True)
            of_each = " and ".join(f"of {each.whose}, {modulus.told()}," for each, modulus in told)
            yield f"{label} {of_each} exclude each other"
            return
