"""Which samples of a surface are seen past the probe.

A window that holds probe and surface finds neither, and what only one of a stereo head's cameras
sees, or the projector does not light, is filled in from its surroundings.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import Samples
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object

# Length of a probe above its tip, and where on it the handle begins [m].
SHAFT_M, SHAFT_FROM_M = 0.25, 0.05
# A sample with less than this part of its mean count of points was not seen.
FEWEST_PART = 0.5


@dataclass(frozen=True)
class ProbeInView:
    """Where the probe is and from where the surface must be seen past it, object frame.

    Attributes
    ----------
    eyes_m : (e, 3) array
        Cameras, and the projector of one that projects [m].
    tip_m, axis : (f, 3) arrays
        Centre of the sphere [m] and pressing direction in each frame.
    """

    eyes_m: NDArray
    tip_m: NDArray
    axis: NDArray

    def clearance(self, places_m: NDArray, frame: int, *, along_m: tuple[float, float]) -> NDArray:
        """Least distance of the lines of sight from a part of the probe's axis, (c,) [m].

        Parameters
        ----------
        places_m : (c, 3) array
            Of the surface [m].
        frame : int
        along_m : (low, high)
            The part, from the tip upwards [m].
        """
        axis = -self.axis[frame] / np.linalg.norm(self.axis[frame])
        ends = self.tip_m[frame] + np.outer(along_m, axis)
        each = [segment_distance(places_m, eye, *ends) for eye in self.eyes_m]
        return np.min(each, axis=0)


def probe_in_view(
    alignment: Alignment, tips_m: NDArray, axes: NDArray, *, eyes_m: NDArray
) -> ProbeInView:
    """The probe in the object frame.

    Parameters
    ----------
    alignment : Alignment
    tips_m, axes : (f, 3) arrays
        Centre of the sphere [m] and pressing direction, camera frame.
    eyes_m : (e, 3) array
        Cameras and projectors, camera frame [m]: those of a stereo head (0, 0, 0) and
        (baseline, 0, 0); of structured light the infrared camera and, a baseline aside, the
        projector.
    """
    pose = alignment.camera_from_object
    eyes, tips = (to_object(pose, np.asarray(part, dtype=float)) for part in (eyes_m, tips_m))
    return ProbeInView(eyes, tips, np.asarray(axes, dtype=float) @ pose[:3, :3])


def eyes_of(sensor: Mapping) -> NDArray:
    """From where a sensor must see a surface past the probe, camera frame, (e, 3) [m].

    Parameters
    ----------
    sensor : mapping
        The sensor's file: both cameras of a stereo head, else the depth camera, and with its
        baseline the projector of structured light, which is taken to stand on its right.

    Raises
    ------
    ValueError
        If the sensor is of a kind that this does not know.
    """
    kind = sensor["kind"]
    if kind == "stereo":
        return np.array([[0, 0, 0], [sensor["stereo"]["baseline_m"], 0, 0]], dtype=float)
    if kind not in ("structured_light", "depth"):
        raise ValueError(f"kind: expected stereo, structured_light or depth, found {kind}")
    depth = sensor["depth"]
    projects = kind == "structured_light" and "baseline_m" in depth
    places = [0.0, depth["baseline_m"]] if projects else [0.0]
    transform = np.array(depth["color_from_depth"], dtype=float)
    return transform[:3, 3] + np.outer(places, transform[:3, 0])


def clearance(
    sensor: Mapping, distance_m: float, *, radius_m: float, windows: float, otherwise_m: float
) -> float:
    """How far from the probe's axis a line of sight must pass at the tip [m].

    A stereo window that holds a part of the tip sees the tip: so many of its widths beside it.

    Parameters
    ----------
    sensor : mapping
        The sensor's file.
    distance_m : float
        Of the contact from the camera [m].
    radius_m : float
        Of the tip [m].
    windows : float
    otherwise_m : float
        For sensors whose windows are their makers' secret [m].
    """
    if sensor["kind"] != "stereo":
        return otherwise_m
    return (
        radius_m + windows * sensor["stereo"]["window_px"] * distance_m / sensor["color"]["fx_px"]
    )


def segment_distance(starts: NDArray, end: NDArray, first: NDArray, last: NDArray) -> NDArray:
    """Least distances of segments that share an end from another segment, shape (c,) [m].

    Parameters
    ----------
    starts : (c, 3) array
    end, first, last : (3,) arrays
        Common end, and the ends of the other segment [m].
    """
    d1, d2, r = end - starts, last - first, starts - first
    a, b, c = (d1 * d1).sum(axis=1), d1 @ d2, (d1 * r).sum(axis=1)
    e, f = d2 @ d2, r @ d2
    across = np.maximum(a * e - b * b, 1e-12 * a * e)
    s = np.clip((b * f - c * e) / across, 0, 1)
    t = np.clip((b * s + f) / e, 0, 1)
    s = np.clip((b * t - c) / a, 0, 1)
    gap = r + s[:, None] * d1 - t[:, None] * d2
    return np.linalg.norm(gap, axis=1)


def facing_samples(samples: Samples, probe: ProbeInView, options: Observation) -> Samples:
    """Samples that no eye sees too much from the side."""
    least = np.cos(np.deg2rad(options.largest_view_deg))
    kept = np.ones(len(samples.cell_m), dtype=bool)
    for eye in probe.eyes_m:
        view = eye - samples.cell_m
        kept &= (view * samples.normal).sum(axis=1) > least * np.linalg.norm(view, axis=1)
    return Samples(samples.cell_m[kept], samples.normal[kept])


def hidden_samples(
    samples: Samples,
    points: NDArray,
    probe: ProbeInView,
    rest_frames: NDArray,
    options: Observation,
) -> NDArray:
    """Which samples the probe or its shadow hides or comes too near, (f, c)."""
    passed = passed_by_probe(samples.cell_m, probe, options)
    counted = np.where(passed, np.nan, points)[rest_frames]
    usual = np.nansum(counted, axis=0) / np.maximum(np.isfinite(counted).sum(axis=0), 1)
    return passed | (points < FEWEST_PART * usual)


def passed_by_probe(cell_m: NDArray, probe: ProbeInView, options: Observation) -> NDArray:
    """Which samples the probe hides or comes too near in each of its frames, (f, c)."""
    lower, upper = (0.0, SHAFT_FROM_M), (SHAFT_FROM_M, SHAFT_M)
    # A probe that was not found is nowhere clear.
    return np.array(
        [
            ~(
                (probe.clearance(cell_m, k, along_m=lower) >= options.clear_m)
                & (probe.clearance(cell_m, k, along_m=upper) >= options.shaft_clear_m)
            )
            for k in range(len(probe.tip_m))
        ]
    )
