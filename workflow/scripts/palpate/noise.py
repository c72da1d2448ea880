"""Noise floor of a rig: of tip and force at rest, of a surface at rest and of a moved plate.

The static and the rigid-motion test of the Good Practices Guide for Digital Image Correlation
(iDICs, 2018), by the functions that captures go through.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from palpate.capture.images import Stream, all_streams
from palpate.capture.tables import columns_of, read_force, read_frames
from palpate.config.sensor import said_of_base
from palpate.estimate.direct import motion, samples
from palpate.estimate.direct.deviations import correlation_length
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template
from palpate.vision import clouds, force, indentation
from palpate.vision import probe as of_probe
from palpate.vision.camera import camera_from_spec
from palpate.vision.follow import followed
from palpate.vision.marker import board_of
from palpate.vision.support_plane import fit_support_plane, height_above
from palpate.workflow.options import Config

# More than this times what is stated exceeds it.
EXCEEDS = 1.2
# Of the picture along each side: its middle, which the plate fills.
MIDDLE = 0.5
# So far behind the plate counts as its base, and so far before it it may come [m].
BEHIND_M, BEFORE_M = 0.05, 0.02
# A plane larger than any plate, and a place that no line of sight passes [m].
LARGE_M, AWAY_M = 2.0, 10.0
# At rest a plate stays so near to its first place; moved by less than the second it shows neither
# scale nor pattern [m].
STILL_M, MOVED_M = 0.0002, 0.001
# Means of an unloaded force over a bias window that are compared.
FEWEST_WINDOWS = 4
# Of a usual capture, over which a force drifts; and how options call its errors.
CAPTURE_S, WORDS = 5.0, {"zero": "offset", "drift": "drift in a capture"}
# The noisiest part of single pixels, gross errors.
GROSS = 0.01
OF_POSE = "the pose's own deviation"
AHEAD, NOWHERE = np.array([0.0, 0.0, 1.0]), {"tip_radius_m": 0.0, "radius_m": 0.0}


@dataclass(frozen=True)
class Quantity:
    """A measured noise beside what is stated of it.

    Attributes
    ----------
    name, unit : str
        Unit m, N, rad or none.
    value, stated : float
        As measured, and what is taken for it now, if anything.
    source : str
        Who states it: a field of the sensor's file (``base``) or of the options, or in words.
    """

    name: str
    unit: str
    value: float
    stated: float | None = None
    source: str = "not stated"

    @property
    def ratio(self) -> float | None:
        """Measured over stated; None where nothing, or 0, is."""
        return self.value / self.stated if self.stated else None

    @property
    def exceeds(self) -> bool:
        """Whether it is more than what is stated."""
        return self.ratio is not None and self.ratio > EXCEEDS


class FlatSurface(NamedTuple):
    """A flat surface in each frame; ``pose`` is camera from surface, whose z is its normal.

    ``motion`` is the displacement of its samples against the ``rest`` first frames, ``left_m``
    (f, c) that less the rigid one that fits best, ``rigid`` (f, 3) that one, a shift along the
    normal [m] and its slopes along x and y, and ``flat_m`` (c,) the mean height at rest over a
    plane [m]; ``pixel_std_m`` is the noise in time of the depth of one pixel, NaN of clouds [m].
    """

    motion: motion.SurfaceMotion
    left_m: NDArray
    rigid: NDArray
    flat_m: NDArray
    rest: int
    pixel_std_m: float
    pose: NDArray


@dataclass(frozen=True)
class NoiseFloor:
    """What `measure` found.

    Attributes
    ----------
    quantities : sequence of Quantity
    tip, force : DataFrame or None
        ``time_s`` and x, y, z: of the tip less its mean, camera's axes [m], and of the unloaded
        force less its offset, sensor's axes [N].
    surface : FlatSurface
        Of the plate, or else of the recording at rest.
    """

    quantities: Sequence[Quantity]
    tip: pd.DataFrame | None
    force: pd.DataFrame | None
    surface: FlatSurface

    def __getitem__(self, name: str) -> Quantity:
        return next(one for one in self.quantities if one.name == name)


def measure(
    sensor: Mapping,
    probe: Mapping,
    *,
    rest: str | Path | None = None,
    plate: str | Path | None = None,
    config: Config | None = None,
) -> NoiseFloor:
    """Measure the noise floor of tip, force and surface.

    Parameters
    ----------
    sensor, probe : mapping
        Their files, with what calibrations found.
    rest : path, optional
        Recording in which nothing moves: the probe in a clamp, unloaded, its target and a flat
        surface in view. It or a plate is needed.
    plate : path, optional
        Recording of a rigid plate that fills the middle of the picture, at rest, then moved by some
        millimetres; with the probe's target on it the camera's scale is determined too.
    config : Config, optional
        The options of all steps, which state what is taken for some.

    Raises
    ------
    ValueError
        Naming the recording whose target, force or plate is not as it should be.

    Examples
    --------
    >>> from palpate.yaml_files import load_yaml
    >>> sensor = load_yaml("tests/sample/sensors/kinect.yaml")
    >>> probe = load_yaml("config/probes/nano25_sphere.yaml")
    >>> found = measure(sensor, probe, plate="tests/sample/raw/foam_block/kinect/background")
    >>> print(f"{1e3 * found['depth, each pixel'].value:.1f} mm")
    1.5 mm
    """
    config, found, tip, force_n, still = config or Config(), [], None, None, None
    if rest is not None:
        poses = followed(rest, sensor, probe, config.probe_pose)
        tip, of_tip = _tip(poses, sensor)
        try:
            force_n, of_force = _force(read_force(rest), poses, probe, config)
        except ValueError as error:
            raise ValueError(f"{rest}: {error}") from None
        found += of_tip + of_force
        places = clouds.probe_places(poses, probe, clouds.viewpoint_of(sensor))
        still = _flat_surface(rest, sensor, config, places)
    moved = None if plate is None else _flat_surface(plate, sensor, config)
    if (seen := still or moved) is None:
        raise ValueError("rest: expected it or a plate, found neither")
    each_m, by = _rms(seen.motion.std_m), "each capture finds its own"
    found += [
        Quantity("depth, each pixel", "m", seen.pixel_std_m),
        Quantity("flatness of mean depth, each sample", "m", _rms(seen.flat_m)),
        Quantity("displacement, each sample and frame", "m", each_m, None, by),
    ]
    if moved is not None:
        found += _of_plate(moved, config) + _of_target(Path(plate), moved, sensor, probe, config)
    return NoiseFloor(
        [one for one in found if np.isfinite(one.value)], tip, force_n, moved or still
    )


def _steady(time_s: NDArray, values: NDArray) -> tuple[NDArray, NDArray]:
    """Scatter of columns (n, k) about a line over time (n,), and how far that goes, (k,) each."""
    basis = np.column_stack([np.ones_like(time_s), time_s - time_s.mean()])
    lines, *_ = np.linalg.lstsq(basis, values, rcond=None)
    std = np.sqrt(((values - basis @ lines) ** 2).sum(axis=0) / max(len(values) - 2, 1))
    return std, lines[1] * np.ptp(time_s)


def _over_time(time_s: NDArray, values: NDArray) -> pd.DataFrame:
    return pd.DataFrame(values, columns=list("xyz")).assign(time_s=time_s)


def _rms(values: NDArray) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


def _tip(poses: pd.DataFrame, sensor: Mapping) -> tuple[pd.DataFrame, list[Quantity]]:
    """Scatter and drift of the tip; of poses from elsewhere theirs too, which a file can state."""
    seen = poses[poses["detected"] == 1]
    time_s, tips = seen["time_s"].to_numpy(float), columns_of(seen, of_probe.RAW_TIP)
    axis = columns_of(seen, of_probe.AXIS).mean(axis=0)
    std_m, drift_m = _steady(time_s, tips @ np.vstack([np.eye(3), axis / np.linalg.norm(axis)]).T)
    said = seen[of_probe.TIP_STD].median()
    names = [f"tip {name}, each frame" for name in ("x", "y", "z", "along the probe")]
    found = [Quantity(*of, OF_POSE) for of in zip(names, "mmmm", std_m, said, strict=True)]
    found.append(Quantity("tip, drift", "m", float(np.linalg.norm(drift_m[:3]))))
    if not of_probe.from_pictures(poses):
        turned = of_probe.marker_transforms(seen)
        shifts, turned = turned[:, :3, 3], turned[:, :3, :3] @ turned[0, :3, :3].T
        # Small turns from the first pose: half of the antisymmetric part.
        vectors = (turned - turned.swapaxes(1, 2))[:, [2, 0, 1], [1, 2, 0]] / 2
        for unit, values in (("m", shifts), ("rad", vectors)):
            std, field = _rms(_steady(time_s, values)[0]), f"pose_std_{unit}"
            stated = said_of_base(sensor, field), f"base.{field}"
            found.append(Quantity(f"tracked pose ({unit})", unit, std, *stated))
    return _over_time(time_s, tips - tips.mean(axis=0)), found


def _force(
    record: pd.DataFrame, poses: pd.DataFrame, probe: Mapping, config: Config
) -> tuple[pd.DataFrame, list[Quantity]]:
    """Scatter of the unloaded force, each sample and at the frames; its offset and drift."""
    frames_s, window_s = poses["time_s"].to_numpy(float), config.force.bias_window_s
    known = force.zeroed(record, probe, window_s, frames_s[0])
    forces, time_s, rig = known.wrench[:, :3], known.time_s, config.direct.fit.rig
    size = max(round(window_s / float(np.median(np.diff(time_s)))), 1)
    means = force.block_mean(forces, size)
    if len(means) < FEWEST_WINDOWS:
        least = f"{FEWEST_WINDOWS * window_s:g} s or more at rest"
        raise ValueError(f"force.csv: expected {least}, found {np.ptp(time_s):.2g} s")
    at_frames = indentation.frame_wrenches(known, poses, probe, config.force)[force.FORCE]
    turns = of_probe.marker_transforms(poses) @ np.array(probe["marker_from_force"])
    framed = -np.einsum("nji,nj->ni", turns[:, :3, :3], at_frames.to_numpy(float))
    each_n, drift_n = _steady(time_s, forces)
    rows = ("each sample", each_n), ("each frame", _steady(frames_s, framed)[0])
    found = [Quantity(f"f{'xyz'[k]}, {name}", "N", of[k]) for name, of in rows for k in range(3)]
    # Allan's deviation: what means of neighbouring windows differ by, over the root of 2.
    offset_n = _rms(np.diff(means, axis=0)) / np.sqrt(2)
    # A capture is shorter than a recording at rest.
    part = min(1.0, CAPTURE_S / float(np.ptp(time_s)))
    for name, value in (("zero", offset_n), ("drift", part * _rms(drift_n))):
        field = f"force_{name}_std_n"
        stated = getattr(rig, field), f"direct.fit.rig.{field}"
        found.append(Quantity(f"force, {WORDS[name]}", "N", value, *stated))
    return _over_time(time_s, forces), found


def _flat_surface(
    folder: str | Path,
    sensor: Mapping,
    config: Config,
    places: Sequence[clouds.ProbePlace] | None = None,
) -> FlatSurface:
    """What is flat in the middle of the picture, as of an object that is indented there.

    Nothing moves where the probe's places are given; else it rests in the first frames.
    """
    camera_m, middle = clouds.viewpoint_of(sensor), _middle(sensor)
    none = clouds.ProbePlace(camera_m - AWAY_M * AHEAD, AHEAD, None, None, NOWHERE, camera_m)
    each = places or [none] * len(read_frames(folder))

    def scene(images: Mapping, place: clouds.ProbePlace) -> clouds.Cloud:
        found = clouds.scene_cloud(images, sensor, middle)
        return found.at(~place.holds(found.points_m))

    try:
        first = scene(next(all_streams(folder, sensor, [0])), each[0])
        reach = _reach(first, middle, sensor, config)
        near = map(scene, all_streams(folder, sensor), each)
        near = [one.at(reach.holds(one.points_m)) for one in near]
        pairs = zip(near, each, strict=True)
        seen = [clouds.object_cloud(*of, reach, config.clouds) for of in pairs]
    except ValueError as error:
        raise ValueError(f"{folder}: plate: {error}") from None
    away_m = np.array([np.median(height_above(reach.plane, one.points_m)) for one in near])
    moved = (np.abs(away_m - away_m[0]) > STILL_M) & (places is None)
    rest = int(np.argmax(moved)) if moved.any() else len(near)
    if rest < motion.FEWEST_AT_REST:
        expected = f"expected it at rest in the first {motion.FEWEST_AT_REST} frames"
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
    found = motion.observed_motion(*known, path, np.arange(rest), sensor, options, radius_m=0.0)
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
    height, width = sensor["color"]["height_px"], sensor["color"]["width_px"]
    row, column = np.ogrid[:height, :width]
    within = (np.abs(k - n / 2) < MIDDLE * n / 2 for k, n in ((row, height), (column, width)))
    return np.logical_and(*within)


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


def _of_plate(seen: FlatSurface, config: Config) -> list[Quantity]:
    """What a moved plate's displacement is off a rigid one, beyond noise, and over what length."""
    left, patch_m = seen.left_m[np.abs(seen.rigid[:, 0]) > MOVED_M], config.direct.fit.patch_m
    if not len(left):
        return []
    pattern_m = float(np.sqrt(max(_rms(left) ** 2 - _rms(seen.left_m[: seen.rest]) ** 2, 0.0)))
    # The fit's patches are twice as large as this, or as it says.
    length_m = 2 * correlation_length(seen.motion.cell_m, np.nanmean(left, axis=0)[None])
    return [
        Quantity("displacement, error in space", "m", _rms(left)),
        Quantity("displacement, error beyond noise", "m", pattern_m),
        Quantity("patch of alike errors", "m", length_m, patch_m, "direct.fit.patch_m"),
    ]


def _of_target(
    folder: Path, seen: FlatSurface, sensor: Mapping, probe: Mapping, config: Config
) -> list[Quantity]:
    """How a target on the plate, and a tip that goes with it, move along the plate's normal."""
    still = np.nanmax(np.abs(seen.rigid[:, 0])) < MOVED_M
    if still or "marker" not in probe or "marker" not in sensor:
        return []
    images, options = Stream(folder, sensor, samples=True), config.probe_pose
    if of_probe.recorded_poses([images[0]], sensor, probe["marker"], options)[0] is None:
        return []
    try:
        poses = of_probe.track_probe(images, read_frames(folder)["time_s"], sensor, probe, options)
    except ValueError as error:
        raise ValueError(f"{folder}: {error}") from None
    targets, normal = of_probe.marker_transforms(poses), seen.pose[:3, 2]
    known = np.isfinite(seen.rigid[:, 0]) & (poses["detected"] == 1).to_numpy()

    def moved(place: NDArray) -> tuple[NDArray, NDArray]:
        """How far a place of the target's frame goes, by target and by plate."""
        path_m = (targets @ np.append(place, 1.0))[:, :3]
        x, y, _ = to_object(seen.pose, path_m[0])
        return path_m[known] @ normal, seen.rigid[known] @ [1.0, x, y]

    tip = moved(of_probe.marker_from_tip(probe)[:3, 3])
    apart, _ = _steady(tip[1], tip[0][:, None])
    said = np.linalg.norm(poses[of_probe.TIP_STD[:3]].median() * normal)
    middle = moved(board_of(probe["marker"]).points_m.mean(axis=0))
    line, covariance = np.polyfit(*middle, 1, cov=True)
    std, stated = covariance[0, 0] ** 0.5, config.direct.fit.gain_std
    scale = hypot(line[0] - 1, std), stated, "direct.fit.gain_std"
    # A path too short says nothing of the scale.
    scale = scale if std < stated else (std, None, "not determined: known to this")
    return [
        Quantity("tip, plate's normal, moved", "m", float(apart[0]), float(said), OF_POSE),
        Quantity("scale, camera against target", "", *scale),
    ]
