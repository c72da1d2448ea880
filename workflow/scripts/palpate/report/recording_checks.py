"""Whether a recording was all right: numbers beside the limits that are good."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from palpate.estimate.direct.warnings import FAR_ZERO, RESTLESS
from palpate.report.style import sensor_name

# From here on the motion of the surface differs from the model's by much more than its noise.
LARGE_SCALE = 3.0


@dataclass(frozen=True)
class Check:
    """A number of a recording.

    Attributes
    ----------
    what, found, good : str
        What it is, its value, and which values are good.
    passed : bool
    """

    what: str
    found: str
    good: str
    passed: bool


def checks_of(fit: Mapping, direct: Mapping, poses: pd.DataFrame) -> list[Check]:
    """Checks of a capture by its hertz.json, direct.json and probe_pose.csv."""
    seen = poses["detected"].iloc[fit["range"]["first_frame"] : fit["range"]["last_frame"] + 1]
    residual = direct["residuals"][0]
    beyond, compared = direct["frames_beyond_lookup"][0], direct["frames"][0]
    own = direct["nuisances"][0]
    zero = abs(own["offset_m"]) / own["offset_std_m"]
    scale, restless = residual["motion_scale"], residual["depth_scale"]
    return [
        Check(
            "probe found in the pictures from touch to deepest",
            f"{int(seen.sum())} of {len(seen)}",
            "all",
            bool(seen.all()),
        ),
        Check(
            "motion of the surface differs from the computed one, over what noise explains",
            f"{scale:.1f} times",
            f"up to {LARGE_SCALE:g} times",
            scale <= LARGE_SCALE,
        ),
        Check(
            "depth of the tip scatters, over what the pictures of the probe explain",
            f"{restless:.1f} times",
            f"up to {RESTLESS:g} times",
            restless <= RESTLESS,
        ),
        Check(
            "force begins beside the surface, over how well tip and surface are known",
            f"{zero:.1f} times",
            f"up to {FAR_ZERO:g} times",
            zero <= FAR_ZERO,
        ),
        Check(
            "frames too deep for what was computed, left out",
            f"{beyond} of {compared + beyond}",
            "0",
            beyond == 0,
        ),
        Check(
            "search for the moduli ended",
            "yes" if direct["converged"] else "no",
            "yes",
            direct["converged"],
        ),
    ]


def told(checked: Sequence[tuple[Mapping, Sequence[Check]]]) -> str:
    """One line that says whether recordings were all right."""
    bad = [
        f"{named(capture)} ({check.what}: {check.found}, good is {check.good})"
        for capture, checks in checked
        for check in checks
        if not check.passed
    ]
    count = sum(len(checks) for _, checks in checked)
    if not bad:
        return f"The recording was all right: all {count} checks of {_captures(checked)} passed."
    return f"Look at the recording: {len(bad)} of {count} checks failed: " + "; ".join(bad) + "."


def rows(checked: Sequence[tuple[Mapping, Sequence[Check]]]) -> list[dict[str, str]]:
    """A row for each check, a column for each capture."""
    found = []
    for at, first in enumerate(checked[0][1]):
        cells = {"check": first.what, "good is": first.good}
        cells |= {named(capture): _cell(checks[at]) for capture, checks in checked}
        found.append(cells)
    return found


def named(capture: Mapping) -> str:
    """A capture as a reader finds it."""
    return f"{sensor_name(capture['sensor'])} {capture['capture']}"


def _cell(check: Check) -> str:
    return f"{'✓' if check.passed else '✗'} {check.found}"


def _captures(checked: Sequence) -> str:
    return "one capture" if len(checked) == 1 else f"{len(checked)} captures"
