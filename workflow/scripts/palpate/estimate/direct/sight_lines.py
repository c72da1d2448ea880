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
# Of a stereo head, so many windows beside the tip hold both tip and surface.
CLEAR_WINDOWS = 1.3


@dataclass(frozen=True)
class ProbeInView:
    """Where the probe is and from where the surface must be seen past it, object frame.

    Attributes
    ----------
    views_m : (e, 3) array
        Cameras, and the projector of one that projects [m].
    tip_m, axis : (f, 3) arrays
        Centre of the sphere [m] and indentation direction in each frame.
    """

    views_m: NDArray
    tip_m: NDArray
    axis: NDArray

    @staticmethod
    def of(
        alignment: Alignment, tips_m: NDArray, axes: NDArray, *, views_m: NDArray
    ) -> "ProbeInView":
        """Probe in the object frame.

        Parameters
        ----------
        alignment : Alignment
        tips_m, axes : (f, 3) arrays
            Centre of the sphere [m] and indentation direction, camera frame.
        views_m : (e, 3) array
            Of `views_of`, camera frame [m].
        """
        pose = alignment.camera_from_object
        views, tips = (to_object(pose, np.asarray(part, dtype=float)) for part in (views_m, tips_m))
        return ProbeInView(views, tips, np.asarray(axes, dtype=float) @ pose[:3, :3])

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
        each = [segment_distance(places_m, view, *ends) for view in self.views_m]
        return np.min(each, axis=0)

    def hides(self, places_m: NDArray, options: Observation) -> NDArray:
        """Which places (c, 3) the probe hides or comes too near in each frame, (f, c)."""
        hidden = np.ones((len(self.tip_m), len(places_m)), dtype=bool)
        for k, one in enumerate(hidden):
            tip = self.clearance(places_m, k, along_m=(0.0, SHAFT_FROM_M))
            shaft = self.clearance(places_m, k, along_m=(SHAFT_FROM_M, SHAFT_M))
            # A probe that was not found is nowhere clear.
            one[(tip >= options.clear_m) & (shaft >= options.shaft_clear_m)] = False
        return hidden


def views_of(sensor: Mapping) -> NDArray:
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


def tip_clearance(
    sensor: Mapping, distance_m: float, options: Observation, *, radius_m: float
) -> float:
    """How far from the probe's axis a line of sight must pass at the tip [m].

    A stereo window that holds a part of the tip sees the tip: `CLEAR_WINDOWS` of its widths beside
    it. For sensors whose windows are their makers' secret the options say it.

    Parameters
    ----------
    sensor : mapping
        The sensor's file.
    distance_m : float
        Of the contact from the camera [m].
    options : Observation
    radius_m : float
        Of the tip [m].
    """
    if sensor["kind"] != "stereo":
        return options.clear_m
    window_px, fx_px = sensor["stereo"]["window_px"], sensor["color"]["fx_px"]
    return radius_m + CLEAR_WINDOWS * window_px * distance_m / fx_px


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
    """Samples that are not seen too much from the side from anywhere."""
    least = np.cos(np.deg2rad(options.largest_view_deg))
    sight = probe.views_m[:, None] - samples.cell_m
    facing = (sight * samples.normal).sum(axis=2) > least * np.linalg.norm(sight, axis=2)
    return samples.at(facing.all(axis=0))


def hidden_samples(
    samples: Samples,
    points: NDArray,
    probe: ProbeInView,
    rest_frames: NDArray,
    options: Observation,
) -> NDArray:
    """Which samples the probe or its shadow hides or comes too near, (f, c).

    Parameters
    ----------
    samples : Samples
    points : (f, c) int array
        How many each was seen with.
    probe : ProbeInView
    rest_frames : (r,) int array
    options : Observation
    """
    passed = probe.hides(samples.cell_m, options)
    counted = np.where(passed, np.nan, points)[rest_frames]
    usual = np.nansum(counted, axis=0) / np.maximum(np.isfinite(counted).sum(axis=0), 1)
    return passed | (points < FEWEST_PART * usual)
