"""Noise of a rig: what is expected of one that nobody has measured, and its floor as measured.

Of tip and force at rest, of a surface at rest and of a moved plate: the static and the rigid-motion
test of the Good Practices Guide for Digital Image Correlation (iDICs, 2018), by the functions that
captures go through.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.images import Stream
from palpate.capture.tables import columns_of, read_force, read_frames
from palpate.config.sensor import said_of_base
from palpate.estimate.direct.deviations import correlation_length
from palpate.flat_surface import FlatSurface, flat_surface
from palpate.surface.pose import to_object
from palpate.vision import clouds, force, indentation
from palpate.vision import probe as of_probe
from palpate.vision.camera import PinholeCamera
from palpate.vision.follow import followed
from palpate.vision.marker import board_of
from palpate.vision.pose import corner_cofactor, point_covariance
from palpate.workflow.job import naming
from palpate.workflow.options import Config

# More than this times what is stated exceeds it.
EXCEEDS = 1.2
# A plate that is moved by less shows neither scale nor pattern [m].
MOVED_M = 0.001
# Means of an unloaded force over a bias window that are compared.
FEWEST_WINDOWS = 4
# Of a usual capture, over which a force drifts; and how options call its errors.
CAPTURE_S, WORDS = 5.0, {"zero": "offset", "drift": "drift in a capture"}
OF_POSE = "the pose's own deviation"
# Of a camera that looks at the contact from the side.
ELEVATION = np.deg2rad(45.0)
# Where nothing is stated: noise of disparities averaged over a sample, and of corners [px], of
# forces at frames [N]; baseline [m] and focal length [px].
DISPARITY_PX, CORNER_PX, FORCE_N, BASELINE_M, FOCAL_PX = 0.02, 0.02, 0.01, 0.055, 600.0
# Of the target about the probe, until it faces the camera.
TURNS = 36


@dataclass(frozen=True)
class Noise:
    """Standard deviations from frame to frame.

    Attributes
    ----------
    tip_m : float
        Of the tip along the indentation [m].
    force_n : float
        Of the force at a frame [N].
    surface_m : float
        Of the displacement of a sample of the surface [m].
    """

    tip_m: float
    force_n: float
    surface_m: float

    @staticmethod
    def expected(sensor: Mapping, probe: Mapping, distance_m: float) -> "Noise":
        """Of a rig that nobody has measured yet, by optics, target and distance [m].

        Stereo heads and structured light know depths to a part of a pixel of disparity: z^2/(f b).
        """
        optics = sensor.get("depth") or sensor.get("color") or {}
        scale_px_m = optics.get("fx_px", FOCAL_PX) * (baseline_of(sensor) or BASELINE_M)
        tip_m = said_of_base(sensor, "pose_std_m")
        if by_target(sensor, probe):
            tip_m = _tip_std(sensor["color"], probe, distance_m)
        return Noise(tip_m, FORCE_N, DISPARITY_PX * distance_m**2 / scale_px_m)


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
        with naming(rest):
            force_n, of_force = _force(read_force(rest), poses, probe, config)
        found += of_tip + of_force
        places = clouds.probe_places(poses, probe, clouds.viewpoint_of(sensor))
        still = flat_surface(rest, sensor, config, places)
    moved = None if plate is None else flat_surface(plate, sensor, config)
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
    found = [one for one in found if np.isfinite(one.value)]
    return NoiseFloor(found, tip, force_n, moved or still)


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
    with naming(folder):
        poses = of_probe.track_probe(images, read_frames(folder)["time_s"], sensor, probe, options)
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


def baseline_of(sensor: Mapping) -> float | None:
    """Between the eyes of a depth camera, or from its projector [m], where its file says it."""
    return (sensor.get("stereo") or sensor.get("depth") or {}).get("baseline_m")


def by_target(sensor: Mapping, probe: Mapping) -> bool:
    """Whether a probe's poses come from its target in a sensor's pictures."""
    return "marker" in sensor and "marker" in probe


def _tip_std(camera: Mapping, probe: Mapping, distance_m: float) -> float:
    """Deviation of a tip along the indentation [m]; the target is turned to the camera."""
    corners_m, fixed = board_of(probe["marker"]).points_m, of_probe.marker_from_tip(probe)
    ahead = np.array([0.0, np.cos(ELEVATION), np.sin(ELEVATION)])
    turns = [
        Rotation.from_rotvec(angle * ahead).as_matrix()
        @ np.column_stack([[1.0, 0, 0], np.cross(ahead, [1.0, 0, 0]), ahead])
        @ fixed[:3, :3].T
        for angle in np.linspace(0, 2 * np.pi, TURNS, endpoint=False)
    ]
    pose = np.eye(4)
    pose[:3, :3] = max(turns, key=lambda turn: turn[2, 2])  # its z points into it
    pose[:3, 3] = [0, 0, distance_m] - pose[:3, :3] @ fixed[:3, 3]
    names = "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px"
    optics = PinholeCamera(*(camera[name] for name in names))
    covariance = CORNER_PX**2 * corner_cofactor(corners_m, pose, optics)
    tip = point_covariance(pose, covariance, fixed[:3, 3])
    return float(np.sqrt(ahead @ tip @ ahead))
