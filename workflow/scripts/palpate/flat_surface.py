"""What is flat in a recording, such as a plate: at rest, and moved as a whole."""

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.images import all_streams
from palpate.capture.tables import read_frames
from palpate.estimate.direct import samples
from palpate.estimate.direct.motion import FEWEST_AT_REST, SurfaceMotion, observed_motion
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template
from palpate.vision import clouds
from palpate.vision.camera import camera_from_spec
from palpate.vision.support_plane import fit_support_plane, height_above
from palpate.workflow.job import naming
from palpate.workflow.options import Config

# Of the picture along each side: its middle, which the plate fills.
MIDDLE = 0.5
# So far behind the plate counts as its base, and so far before it it may come [m].
BEHIND_M, BEFORE_M = 0.05, 0.02
# A plane larger than any plate, and a place that no line of sight passes [m].
LARGE_M, AWAY_M = 2.0, 10.0
# At rest a plate stays so near to its first place [m].
STILL_M = 0.0002
# The noisiest part of single pixels, gross errors.
GROSS = 0.01
AHEAD, NOWHERE = np.array([0.0, 0.0, 1.0]), {"tip_radius_m": 0.0, "radius_m": 0.0}


class FlatSurface(NamedTuple):
    """A flat surface in each frame; ``pose`` is camera from surface, whose z is its normal.

    ``motion`` is the displacement of its samples against the ``rest`` first frames, ``left_m``
    (f, c) that less the rigid one that fits best, ``rigid`` (f, 3) that one, a shift along the
    normal [m] and its slopes along x and y, and ``flat_m`` (c,) the mean height at rest over a
    plane [m]; ``pixel_std_m`` is the noise in time of the depth of one pixel, NaN of clouds [m].
    """

    motion: SurfaceMotion
    left_m: NDArray
    rigid: NDArray
    flat_m: NDArray
    rest: int
    pixel_std_m: float
    pose: NDArray


def flat_surface(
    folder: str | Path,
    sensor: Mapping,
    config: Config,
    places: Sequence[clouds.ProbePlace] | None = None,
) -> FlatSurface:
    """What is flat in the middle of the picture, as of an object that is indented there.

    Nothing moves where the probe's places in each frame are given; else it rests in the first
    frames.

    Raises
    ------
    ValueError
        Naming the recording, if it shows no such surface, or one that moves too soon or hardly
        faces the camera.
    """
    camera_m, middle = clouds.viewpoint_of(sensor), _middle(sensor)
    none = clouds.ProbePlace(camera_m - AWAY_M * AHEAD, AHEAD, None, None, NOWHERE, camera_m)
    each = places or [none] * len(read_frames(folder))

    def scene(images: Mapping, place: clouds.ProbePlace) -> clouds.Cloud:
        found = clouds.scene_cloud(images, sensor, middle)
        return found.at(~place.holds(found.points_m))

    with naming(f"{folder}: plate"):
        first = scene(next(all_streams(folder, sensor, [0])), each[0])
        reach = _reach(first, middle, sensor, config)
        near = map(scene, all_streams(folder, sensor), each)
        near = [one.at(reach.holds(one.points_m)) for one in near]
        pairs = zip(near, each, strict=True)
        seen = [clouds.object_cloud(*of, reach, config.clouds) for of in pairs]
    away_m = np.array([np.median(height_above(reach.plane, one.points_m)) for one in near])
    moved = (np.abs(away_m - away_m[0]) > STILL_M) & (places is None)
    rest = int(np.argmax(moved)) if moved.any() else len(near)
    if rest < FEWEST_AT_REST:
        expected = f"expected it at rest in the first {FEWEST_AT_REST} frames"
        raise ValueError(f"{folder}: plate: {expected}, found it moved in frame {rest}")
    normal, options, pose = reach.plane[:3], config.direct.observation, np.eye(4)
    sight = reach.tip_m / np.linalg.norm(reach.tip_m)
    aside_deg = float(np.degrees(np.arccos(min(abs(float(sight @ normal)), 1.0))))
    if not aside_deg < options.largest_view_deg:
        expected = f"expected it within {options.largest_view_deg:g} degrees of facing the camera"
        raise ValueError(f"{folder}: plate: {expected}, found {aside_deg:.0f}")
    down = np.cross(normal, [1.0, 0.0, 0.0]) / np.hypot(*normal[1:])
    pose[:3, :3] = np.column_stack([np.cross(down, normal), down, normal])
    pose[:3, 3] = reach.tip_m - (height_above(reach.plane, reach.tip_m) - BEHIND_M) * normal
    corners = LARGE_M * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    template = Template(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    known = template, Alignment(pose, np.zeros(3), rest, 0.0), seen
    path = np.array([one.tip_m for one in each]), np.array([one.axis for one in each])
    found = observed_motion(*known, path, np.arange(rest), sensor, options, radius_m=0.0)
    surface, cells = samples.RestSurface(template), samples.Samples(found.cell_m, found.normal)
    closest = (
        surface.at_rest(to_object(pose, points), normals @ pose[:3, :3], options)
        for points, normals in seen[:rest]
    )
    heights = np.nanmean(samples.cell_heights(cells, closest, options)[0], axis=0)
    flat, _ = _less_rigid(found.cell_m, heights[None])
    pixel_std_m = _pixel_std([one.points_m for one in near[:rest]], sensor)
    rigid = _less_rigid(found.cell_m, found.moved_m)
    return FlatSurface(found, *rigid, flat[0], rest, pixel_std_m, pose)


def _middle(sensor: Mapping) -> NDArray | None:
    """Pixels of the reference camera in the middle of the picture; None of clouds."""
    if "color" not in sensor:
        return None
    size = sensor["color"]["height_px"], sensor["color"]["width_px"]
    axes = zip(np.ogrid[: size[0], : size[1]], size, strict=True)
    return np.logical_and(*(np.abs(k - n / 2) < MIDDLE * n / 2 for k, n in axes))


def _reach(
    scene: clouds.Cloud, middle: NDArray | None, sensor: Mapping, config: Config
) -> clouds.Reach:
    """The surface as an object on a table behind it, about a place that is seen."""
    if middle is not None:
        camera = camera_from_spec(sensor["color"])
        scene = scene.at(clouds.in_mask(scene.points_m, middle, camera))
    rng, near_m = np.random.default_rng(config.seed), config.support_plane.inlier_distance_m
    plane = fit_support_plane(scene.points_m, inlier_distance_m=near_m, rng=rng)
    points = scene.points_m[np.abs(height_above(plane, scene.points_m)) < near_m]
    seen_m = points[np.argmin(np.linalg.norm(points - np.median(points, axis=0), axis=1))]
    behind, reach_m = plane + [0, 0, 0, BEHIND_M], config.direct.observation.reach_m
    return clouds.Reach(seen_m, reach_m, BEHIND_M + BEFORE_M, behind)


def _pixel_std(frames: Sequence[NDArray], sensor: Mapping) -> float:
    """Root of the mean variance of the depth of pixels that were seen in all frames [m]."""
    spec, back = sensor.get("depth", sensor.get("color")), np.eye(4)
    if spec is None:
        return nan
    if "depth" in sensor:
        back = np.linalg.inv(np.array(sensor["depth"]["color_from_depth"]))
    local = np.concatenate(frames) @ back[:3, :3].T + back[:3, 3]
    # Points come of whole pixels.
    column, row = np.rint(camera_from_spec(spec).project(local)).astype(int).T
    depths = pd.Series(local[:, 2]).groupby(row * spec["width_px"] + column)
    variance = depths.var()[depths.count() == len(frames)]
    return float(np.sqrt(variance[variance <= variance.quantile(1 - GROSS)].mean()))


def _less_rigid(places_m: NDArray, moved_m: NDArray) -> tuple[NDArray, NDArray]:
    """Displacements along the normal (f, c) without shift and slopes, and these, (f, 3)."""
    basis = np.column_stack([np.ones(len(places_m)), places_m[:, :2]])
    found = np.full((len(moved_m), 3), nan)
    for k, row in enumerate(moved_m):
        seen = np.isfinite(row)
        if seen.sum() > basis.shape[1]:
            found[k] = np.linalg.lstsq(basis[seen], row[seen], rcond=None)[0]
    return moved_m - found @ basis.T, found
