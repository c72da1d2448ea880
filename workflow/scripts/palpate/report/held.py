"""What there is of one capture, its indentation over time, and the quality of its recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.tables import columns_of
from palpate.estimate.direct.contact import LIKELY
from palpate.estimate.direct.warnings import FAR_ZERO, RESTLESS
from palpate.estimate.hertz.indentation import hold_end
from palpate.report.style import capture_name
from palpate.units import MILLIMETRES
from palpate.vision.probe import ALONG_STD, TIP

# Ratios of a recording and the largest that are good.
RATIOS = {
    "residual of the surface displacement, over what noise explains": 3.0,
    "scatter of the indentation depth, over what the probe's poses explain": RESTLESS,
    "offset of the depth, over its stated uncertainty": FAR_ZERO,
}


@dataclass(frozen=True)
class Held:
    """What there is of one capture.

    Attributes
    ----------
    capture : mapping
        ``object``, ``sensor``, ``capture``, ``point``, ``provenance``.
    fit, direct : mapping
        Its hertz.json and direct.json.
    poses : DataFrame
        Its probe_pose.csv.
    depth_m : (f,) array
        Of the tip in the object in each frame, as the estimate from all captures has it [m].
    frames : (c,) array
        Those that it compared.
    """

    capture: Mapping
    fit: Mapping
    direct: Mapping
    poses: pd.DataFrame
    depth_m: NDArray
    frames: NDArray

    @property
    def time_s(self) -> NDArray:
        """Of each frame (f,) [s]."""
        return self.poses["time_s"].to_numpy(dtype=float)

    @property
    def deepest(self) -> int:
        """Frame with which the loading ends."""
        return int(self.fit["range"]["last_frame"])

    def seconds_to(self, depth_m: float) -> float:
        """From the touch to where the press first reaches a depth, or else its deepest [s]."""
        depth, time = self.depth_m[: self.deepest + 1], self.time_s[: self.deepest + 1]
        reached = min(depth_m, float(depth[-1]))
        return _first(time, depth, reached) - _first(time, depth, 0.0)

    @property
    def hold_s(self) -> float:
        """From the deepest to the end of the hold [s]."""
        std_m = float(np.nanmedian(self.poses[ALONG_STD]))
        end = hold_end(self.depth_m, self.deepest, frame_std_m=std_m)
        return float(self.time_s[end - 1] - self.time_s[self.deepest])

    @property
    def compared_s(self) -> float:
        """From the touch to the last frame that was compared [s]."""
        return seconds_compared(self.time_s, self.depth_m, self.frames)

    @property
    def distance_m(self) -> float:
        """From the camera to the tip at the deepest [m]."""
        return float(np.linalg.norm(columns_of(self.poses, TIP)[self.deepest]))

    @property
    def rate_hz(self) -> float:
        """Frames a second."""
        return float(1 / np.median(np.diff(self.time_s)))


@dataclass(frozen=True)
class Check:
    """A number of a recording: what it is, its value, which values are good, and whether it is."""

    what: str
    found: str
    good: str
    passed: bool


def checks_of(held: Held) -> list[Check]:
    """Checks of a capture."""
    frames = slice(held.fit["range"]["first_frame"], held.deepest + 1)
    seen, direct = held.poses["detected"].iloc[frames], held.direct
    residual, own = direct["residuals"][0], direct["nuisances"][0]
    beyond, compared = direct["frames_beyond_lookup"][0], direct["frames"][0]
    zero = abs(own["offset_m"]) / own["offset_std_m"]
    ratios = (residual["motion_scale"], residual["depth_scale"], zero)
    judged = zip(RATIOS, RATIOS.values(), ratios, strict=True)
    found = f"{int(seen.sum())} of {len(seen)}"
    left_out, ended = f"{beyond} of {compared + beyond}", direct["converged"]
    return [
        Check("probe found from touch to maximum depth", found, "all", bool(seen.all())),
        *(Check(w, f"{x:.1f} times", f"up to {most:g} times", x <= most) for w, most, x in judged),
        Check("frames beyond the indentation table, left out", left_out, "0", beyond == 0),
        *([_clocks(own)] if "camera_clock_s" in own else []),
        Check("fit converged", "yes" if ended else "no", "yes", ended),
    ]


def _clocks(own: Mapping) -> Check:
    """Both clocks that a capture has beside the camera's."""
    names, most_ms = ("camera", "force"), 1e3 * LIKELY * own["camera_clock_known_std_s"]
    pairs = [(1e3 * own[f"{name}_clock_s"], 1e3 * own[f"{name}_clock_std_s"]) for name in names]
    each = ", ".join(f"{offset:+.0f} ± {std:.0f} ms" for offset, std in pairs)
    found = f"{each}, correlation {own['clocks_correlation']:+.1f}"
    what = "clock of the poses minus the camera's, and the force's minus the poses'"
    return Check(what, found, f"the first up to {most_ms:.0f} ms", abs(pairs[0][0]) <= most_ms)


def recording(checked: Sequence[tuple[Mapping, Sequence[Check]]]) -> str:
    """One line that says whether recordings passed their checks."""
    bad = [
        f"{capture_name(capture)} ({check.what}: {check.found}, expected {check.good})"
        for capture, checks in checked
        for check in checks
        if not check.passed
    ]
    count = sum(len(checks) for _, checks in checked)
    captures = "one capture" if len(checked) == 1 else f"{len(checked)} captures"
    if not bad:
        return f"All {count} checks of {captures} passed."
    return f"{len(bad)} of {count} checks of the recording failed: " + "; ".join(bad) + "."


def rows(checked: Sequence[tuple[Mapping, Sequence[Check]]]) -> list[dict[str, str]]:
    """A row for each check, a column for each capture."""
    found: dict[str, dict[str, str]] = {}
    empty = dict.fromkeys((capture_name(capture) for capture, _ in checked), "")
    for capture, checks in checked:
        for one in checks:
            row = found.setdefault(one.what, {"check": one.what, "expected": one.good} | empty)
            row[capture_name(capture)] = f"{'✓' if one.passed else '✗'} {one.found}"
    return list(found.values())


def seconds_compared(time_s: NDArray, depth_m: NDArray, frames: NDArray) -> float:
    """From the touch to the last frame that was compared [s].

    Of times [s] and depths [m] of all frames, (f,), and those that were compared (c,).
    """
    return float(time_s[frames[-1]] - _first(time_s, depth_m, 0.0))


def press_of(held: Held) -> dict[str, str]:
    """What a capture held, as text."""
    fit, depth = held.fit, held.depth_m.max()
    force = fit["samples"]["force_n"]
    return {
        "capture": capture_name(held.capture),
        "frames": str(len(force)),
        "frames compared": str(held.direct["frames"][0]),
        "loading (s)": f"{held.seconds_to(np.inf):.1f}",
        "hold (s)": f"{held.hold_s:.1f}",
        "maximum force (N)": f"{max(force):.2f}",
        "maximum depth (mm)": f"{depth * MILLIMETRES:.1f}",
        "depth over radius": f"{depth / fit['radius_m']:.2f}",
        "surface samples compared": str(held.direct["residuals"][0]["cells"]),
    }


def _first(time_s: NDArray, depth_m: NDArray, level_m: float) -> float:
    """When a depth is first reached, on a straight line between frames [s]."""
    at = int(np.argmax(depth_m >= level_m))
    if at == 0:
        return float(time_s[0])
    part = (level_m - depth_m[at - 1]) / (depth_m[at] - depth_m[at - 1])
    return float(time_s[at - 1] + part * (time_s[at] - time_s[at - 1]))
