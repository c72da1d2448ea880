"""Surface displacement, straight from the clouds.

Camera and object stand still during an indentation. What calibration, alignment, template and the
sensor's fixed pattern are wrong by is therefore the same in every frame, and goes with the mean of
the frames at rest; noise is left, and what the sensor does to a surface that moves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import (
    ClosestAtRest,
    ProbeInView,
    RestSurface,
    cell_heights,
    facing_samples,
    samples_of,
)
from palpate.estimate.hertz.indentation import indentation_depth
from palpate.npz import read_shaped, write_npz
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_camera, to_object
from palpate.surface.template import Template
from palpate.vision.clouds import viewpoint_of

# A sample's own few frames at rest, against the deviation of all samples: worth so many frames.
POOLED_FRAMES = 6.0
# A sample is seen in so many frames at rest or more.
FEWEST_AT_REST = 3
# More frames at rest do not determine better where samples are.
MOST_AT_REST = 120
# A frame sees a sample if it has this part of the sample's mean number of points.
FEWEST_PART = 0.5
# The camera must see some of the surface this near to the contact [m].
NEAR_M = 0.04
# At rest the tip is at least so far above the surface, about twice what depths are known to [m].
CLEAR_M = 0.0005
# Of a stereo head, so many windows beside the tip hold both tip and surface.
CLEAR_WINDOWS = 1.3
SHAPES = {
    "cell_m": ("samples", 3),
    "normal": ("samples", 3),
    "moved_m": ("frames", "samples"),
    "std_m": ("frames", "samples"),
    "rest_std_m": ("samples",),
}


@dataclass(frozen=True)
class SurfaceMotion:
    """Normal displacement of a surface's samples in each frame against the frames at rest.

    Attributes
    ----------
    cell_m, normal : (c, 3) arrays
        Places on the undeformed template, object frame [m], and unit normals outward.
    moved_m : (f, c) array
        From a sample along its normal to the observed surface, less the same at rest [m]; NaN where
        the sample was not seen.
    std_m : (f, c) array
        Standard deviation of a frame's own noise [m]; not that of the rest, which all frames share.
    rest_std_m : (c,) array
        Standard deviation of the mean of the frames at rest [m].
    """

    cell_m: NDArray
    normal: NDArray
    moved_m: NDArray
    std_m: NDArray
    rest_std_m: NDArray

    @property
    def noise_std_m(self) -> NDArray:
        """Deviation of a frame's noise and of what it is compared with, (f, c) [m]."""
        return np.hypot(self.std_m, self.rest_std_m)


def views_of(sensor: Mapping) -> NDArray:
    """From where a sensor must see a surface past the probe, camera frame, (e, 3) [m].

    Of the sensor's file: both cameras of a stereo head, else the depth camera, and with its
    baseline the projector of structured light, which is taken to stand on its right; of clouds
    their viewpoint.

    Raises
    ------
    ValueError
        If the sensor is of a kind that this does not know.
    """
    kind = sensor["kind"]
    if kind == "stereo":
        return np.array([[0, 0, 0], [sensor["stereo"]["baseline_m"], 0, 0]], dtype=float)
    if kind == "cloud":
        return viewpoint_of(sensor)[None]
    if kind not in ("structured_light", "depth"):
        raise ValueError(f"kind: expected stereo, structured_light, depth or cloud, found {kind}")
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
    it. For sensors whose windows are their makers' secret the options say it. Of the sensor's file,
    the contact's distance from the camera [m] and the radius of the tip [m].
    """
    if sensor["kind"] != "stereo":
        return options.clear_m
    window_px, fx_px = sensor["stereo"]["window_px"], sensor["color"]["fx_px"]
    return radius_m + CLEAR_WINDOWS * window_px * distance_m / fx_px


def rest_frames(
    template: Template,
    alignment: Alignment,
    tips_m: NDArray,
    forces_n: NDArray,
    *,
    radius_m: float,
    onset_force_n: float,
) -> NDArray:
    """Frames before the touch, (r,).

    Of centres of the sphere and forces on the object, (f, 3) each in the camera frame [m, N], the
    sphere's radius [m] and the smallest force that counts as contact [N].

    Raises
    ------
    ValueError
        If there is none.
    """
    depth = indentation_depth(template, alignment, tips_m, radius_m=radius_m)
    touched = np.flatnonzero(np.linalg.norm(forces_n, axis=1) > onset_force_n)
    before = np.arange(len(forces_n)) < (touched[0] if len(touched) else len(forces_n))
    frames = np.flatnonzero(before & (depth < -CLEAR_M))
    if not len(frames):
        expected = f"frames before the force's onset with the tip {CLEAR_M * 1e3:g} mm clear"
        raise ValueError(f"frames: expected {expected} of the surface, found none")
    return frames


def observed_motion(
    template: Template,
    alignment: Alignment,
    clouds: Sequence[tuple[NDArray, NDArray]],
    probe: tuple[NDArray, NDArray],
    rest: NDArray,
    sensor: Mapping,
    options: Observation,
    *,
    radius_m: float,
) -> SurfaceMotion:
    """Displacement of the surface's samples in each frame, against the frames at rest.

    Of the undeformed template, object frame; clouds, a pair of points (n, 3) [m] and normals (n, 3)
    for each frame; the probe's tips (f, 3) [m], centres of the sphere, and indentation directions
    (f, 3), all in the camera frame; the frames at rest (r,) int; the sensor's file; and the
    sphere's radius [m].

    Raises
    ------
    ValueError
        If no frame is at rest, the camera does not see the surface around the contact, or no sample
        is left.
    """
    pose, contact = alignment.camera_from_object, alignment.contact_point_m
    distance_m = float(np.linalg.norm(to_camera(pose, contact)))
    clear_m = tip_clearance(sensor, distance_m, options, radius_m=radius_m)
    options, reach_m = options.changed(clear_m=clear_m), options.reach_m
    surface, (tips, axes) = RestSurface(template), probe
    places = (to_object(pose, of) for of in (views_of(sensor), tips))
    view = ProbeInView(*places, axes @ pose[:3, :3])

    def closest(cloud: tuple[NDArray, NDArray]) -> ClosestAtRest:
        """Closest places of a frame's points within reach of the contact."""
        points, normals = to_object(pose, cloud[0]), cloud[1] @ pose[:3, :3]
        far = np.linalg.norm(points - contact, axis=1)
        near = far < reach_m + options.largest_distance_m
        found = surface.at_rest(points[near], normals[near], options)
        return found.at(np.linalg.norm(found.cell_m - contact, axis=1) < reach_m)

    if not len(rest) or len(tips) != len(clouds):
        expected = f"some at rest and one place of the probe for each of {len(clouds)}"
        raise ValueError(f"frames: expected {expected}, found {len(rest)}, {len(tips)}")
    at_rest = {k: closest(clouds[k]) for k in rest[:MOST_AT_REST]}
    if not (np.linalg.norm(at_rest[rest[0]].cell_m - contact, axis=1) < NEAR_M).any():
        raise ValueError(
            f"clouds: expected the surface within {NEAR_M:g} m of the contact in view,"
            " found none of it (object larger than the view?)"
        )
    found = samples_of(list(at_rest.values()), contact, spacing_m=options.spacing_m)
    samples = facing_samples(found, view, options)
    every = (at_rest.pop(k, None) or closest(cloud) for k, cloud in enumerate(clouds))
    height, points = cell_heights(samples, every, options)
    # What the probe or its shadow hides or comes too near.
    hidden = view.hides(samples.cell_m, options)
    counted = np.where(hidden, np.nan, points)[rest]
    usual = np.nansum(counted, axis=0) / np.maximum(np.isfinite(counted).sum(axis=0), 1)
    height[hidden | (points < FEWEST_PART * usual)] = np.nan
    seen = np.isfinite(height[rest]).sum(axis=0) >= FEWEST_AT_REST
    if not seen.any():
        expected = f"samples seen in {FEWEST_AT_REST} frames at rest"
        raise ValueError(f"clouds: expected {expected}, found none")
    moved = height[:, seen] - np.nanmean(height[np.ix_(rest, seen)], axis=0)
    # Variance of each sample's noise at rest with what is usual, and its frames.
    noise = moved[rest]
    own, squares = np.isfinite(noise).sum(axis=0), np.nansum(noise**2, axis=0)
    usual = np.median(squares / chdtri(own - 1, 0.5))
    variance = (POOLED_FRAMES * usual + squares) / (POOLED_FRAMES + own - 1)
    return SurfaceMotion(
        **vars(samples.at(seen)),
        moved_m=moved,
        std_m=np.where(np.isfinite(moved), np.sqrt(variance), np.nan),
        rest_std_m=np.sqrt(variance / own),
    )


def save_motion(path: str | Path, motion: SurfaceMotion) -> None:
    """Write a displacement as NPZ."""
    write_npz(path, vars(motion))


def load_motion(path: str | Path) -> SurfaceMotion:
    """Read what `save_motion` wrote.

    Raises
    ------
    ValueError
        If an array is missing, or of another number of frames or samples than the rest.
    """
    return SurfaceMotion(**read_shaped(path, SHAPES, what="a surface's motion"))
