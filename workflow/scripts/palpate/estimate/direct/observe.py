"""Displacement of an object's surface in a capture, from clouds and, on request, from pictures.

What a depth camera sees of a displacement is what comes towards it, with tenths of a millimetre of
noise. Its picture shows the rest with hundredths, wherever the surface has a texture: how far the
surface is drawn in towards the contact, which depends on Poisson's ratio alone (K. L. Johnson,
Contact Mechanics, 1985, Section 3.4).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from palpate.estimate.direct.motion import (
    FEWEST_AT_REST,
    SurfaceMotion,
    noise_variance,
    surface_motion,
)
from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import ProbeInView
from palpate.estimate.hertz.indentation import indentation_depth
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_camera
from palpate.surface.template import Template
from palpate.vision.camera import PinholeCamera
from palpate.vision.flow import picture_flow

# At rest the tip is at least so far above the surface; depths are known to about half of it [m].
CLEAR_M = 0.0005
# Side of the windows of the surface that are followed in the pictures [m].
FLOW_WINDOW_M = 0.014
# A window that wanders at rest by more has no texture, and by less is of a repeated picture [px].
LARGEST_STD_PX, REPEATED_PX = 0.25, 1e-5
# Windows have an odd number of pixels, enough to hold some texture, and no more than is of use.
NARROWEST_PX, WIDEST_PX = 13, 41
# By which places are moved to see how their pictures do [m].
STEP_M = 1e-4
# Before the touch the surface rests. What then goes with the probe's way by so many deviations is
# of a window that holds a part of the arm, or of its shadow.
FOLLOWS = 3.0
# Of a stereo head, so many windows beside the tip hold both tip and surface.
CLEAR_WINDOWS = 1.3


@dataclass(frozen=True)
class Pictures:
    """What a camera took of an indentation.

    Attributes
    ----------
    images : sequence of (h, w, 3) or (h, w) uint8 arrays
    camera : PinholeCamera
    uncovered : (h, w) array
        Share of them in which each pixel shows the background.
    """

    images: Sequence[NDArray]
    camera: PinholeCamera
    uncovered: NDArray


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

    Parameters
    ----------
    template : Template
    alignment : Alignment
    tips_m, forces_n : (f, 3) arrays
        Centre of the sphere and force on the object, camera frame [m, N].
    radius_m : float
        Of the sphere.
    onset_force_n : float
        Smallest force that counts as contact [N].

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
    pictures: Pictures | None = None,
) -> SurfaceMotion:
    """Displacement of the surface's samples in each frame, against the frames at rest.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    alignment : Alignment
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        One for each frame, camera frame.
    probe : (tips (f, 3) [m], axes (f, 3))
        Centre of the sphere and indentation direction, camera frame.
    rest : (r,) int array
    sensor : mapping
        The sensor's file.
    options : Observation
    radius_m : float
        Of the sphere.
    pictures : Pictures, optional
        Of all frames by the reference camera; what moves across its lines of sight is seen in them.

    Raises
    ------
    ValueError
        As `surface_motion` does.
    """
    distance_m = np.linalg.norm(to_camera(alignment.camera_from_object, alignment.contact_point_m))
    clear = tip_clearance(sensor, float(distance_m), options, radius_m=radius_m)
    options = options.changed(clear_m=clear)
    view = ProbeInView.of(alignment, *probe, views_m=views_of(sensor))
    motion = surface_motion(template, alignment, clouds, view, rest, options)
    if pictures is None:
        return motion
    view = ProbeInView.of(alignment, *probe, views_m=np.zeros((1, 3)))
    return with_pictures(motion, alignment, pictures, view, options)


def with_pictures(
    motion: SurfaceMotion,
    alignment: Alignment,
    pictures: Pictures,
    probe: ProbeInView,
    options: Observation,
) -> SurfaceMotion:
    """Add to a surface's displacement what pictures show of it across their lines of sight.

    Parameters
    ----------
    motion : SurfaceMotion
        Along the normals.
    alignment : Alignment
    pictures : Pictures
    probe : ProbeInView
        From where the pictures were taken.
    options : Observation

    Returns
    -------
    SurfaceMotion
        Samples without texture are not numbers.

    Raises
    ------
    ValueError
        If there are not as many pictures as frames, or the masks are of others.
    """
    frames, size = len(motion.moved_m), np.shape(pictures.images[0])[:2]
    if len(pictures.images) != frames:
        expected, found = f"{len(pictures.images)}, one a picture", f"clouds of {frames}"
        raise ValueError(f"frames: expected {expected}, found {found}")
    if size != pictures.uncovered.shape:
        found = pictures.uncovered.shape
        raise ValueError(f"mask: expected the pictures' {size} pixels, found {found}")
    seen_at = motion.cell_m + motion.rest_height_m[:, None] * motion.normal
    places = to_camera(alignment.camera_from_object, seen_at)
    slopes = _slopes(places, alignment, pictures.camera)
    px_per_m = np.linalg.norm(slopes, axis=2)
    wide_px = FLOW_WINDOW_M * pictures.camera.fx_px / float(np.median(places[:, 2]))
    window_px = int(np.clip(2 * round((wide_px - 1) / 2) + 1, NARROWEST_PX, WIDEST_PX))
    flow = picture_flow(
        pictures.images,
        motion.rest_frames,
        pictures.camera.project(places),
        pictures.uncovered,
        window_px=window_px,
    )
    moved = np.moveaxis(flow, 2, 1) / px_per_m
    hidden = probe.hides(motion.cell_m, options) | ~np.isfinite(motion.moved_m)
    moved[np.broadcast_to(hidden[:, None], moved.shape)] = np.nan
    seen = np.isfinite(moved[motion.rest_frames]).sum(axis=0) >= FEWEST_AT_REST
    moved[:, ~seen] = np.nan
    std, rest_std = np.full((2, *seen.shape), np.nan)
    for axis, there in enumerate(seen):
        if not there.any():
            continue
        moved[:, axis, there] -= np.nanmean(moved[motion.rest_frames, axis][:, there], axis=0)
        variance, own = noise_variance(moved[motion.rest_frames, axis][:, there])
        std[axis, there], rest_std[axis, there] = np.sqrt(variance), np.sqrt(variance / own)
    # What has no texture is followed to anywhere; without any noise a picture was repeated.
    std_px = std * px_per_m
    vague = ~((std_px > REPEATED_PX) & (std_px < LARGEST_STD_PX)).all(axis=0)
    moved[:, :, vague] = np.nan
    moved[:, :, _disturbed(moved, motion, probe)] = np.nan
    # Steps along the surface that move a place along one axis of the picture alone.
    steps = np.linalg.pinv(np.stack([*slopes, motion.normal], axis=1))[:, :, :2]
    return replace(
        motion,
        across=slopes / px_per_m[..., None],
        across_m=moved,
        across_std_m=std,
        across_rest_std_m=rest_std,
        window_m=window_px * np.moveaxis(steps, 2, 0),
    )


def _disturbed(moved_m: NDArray, motion: SurfaceMotion, probe: ProbeInView) -> NDArray:
    """Samples (c,) in whose windows something goes with the probe before it touches."""
    rest, tips = moved_m[motion.rest_frames], probe.tip_m[motion.rest_frames]
    way = np.linalg.norm(tips - tips[-1], axis=1)[:, None, None]
    count = np.isfinite(rest).sum(axis=0)
    way, rest = (_less_mean(np.where(np.isfinite(rest), of, np.nan)) for of in (way, rest))
    # Of a probe that hovers alone nothing is known.
    spread = np.maximum(np.sqrt(np.nansum(way**2, axis=0)), CLEAR_M)
    along = np.abs(np.nansum(way * rest, axis=0)) / spread
    noise = np.sqrt(np.maximum(np.nansum(rest**2, axis=0) - along**2, 0) / np.maximum(count - 2, 1))
    # Noise of few frames may be small by chance.
    each = zip(noise, count > 2, strict=True)
    usual = [[np.median(of[there]) if there.any() else 0.0] for of, there in each]
    follows = (along > FOLLOWS * np.maximum(noise, usual)).any(axis=0)
    if not follows.any():
        return follows
    apart, _ = cKDTree(motion.cell_m[follows]).query(motion.cell_m)
    return apart <= FLOW_WINDOW_M / 2


def _less_mean(values: NDArray) -> NDArray:
    """Values less their mean over the first axis, past what is not a number."""
    count = np.maximum(np.isfinite(values).sum(axis=0), 1)
    return values - np.nansum(values, axis=0) / count


def _slopes(places_m: NDArray, alignment: Alignment, camera: PinholeCamera) -> NDArray:
    """How places' columns and rows in a picture go with them, object frame, (2, c, 3) [px/m]."""
    steps = STEP_M * np.eye(3)
    pairs = [(camera.project(places_m + s), camera.project(places_m - s)) for s in steps]
    slopes = np.stack([(after - before) / (2 * STEP_M) for after, before in pairs], axis=-1)
    return slopes.swapaxes(0, 1) @ alignment.camera_from_object[:3, :3]
