"""The surface's motion, straight from the clouds.

Camera and object stand still while the probe presses. What calibration, alignment, template and the
sensor's fixed pattern are wrong by is therefore the same in every frame, and goes with the mean of
the frames at rest; noise is left, and what the sensor does to a surface that moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.cells import Cells, Feet, ProbeInView, RestSurface, cells_of
from palpate.estimate.motion_noise import (
    FROM_MEDIAN,
    SMOOTH_REACH_M,
    correlation_length,
    pattern_growth,
)
from palpate.surface.alignment import Alignment
from palpate.surface.pose import to_object
from palpate.surface.template import Template

# Points of a cell farther from its median than so many deviations are left out.
CLIP = 3.0
# A cell's own few frames at rest, against the deviation of all cells: worth so many frames.
POOLED_FRAMES = 6.0
# Length of a probe above its tip [m].
SHAFT_M = 0.25
# The surface counts as pressed in frames in which it moved at least this part of the farthest.
PRESSED_PART = 0.8


@dataclass(frozen=True)
class ObservationOptions:
    """Which cells are made, and which points count.

    Attributes
    ----------
    spacing_m : float
        Least distance of two cells' seeds [m].
    reach_m : float
        Farthest cell from the contact [m].
    largest_distance_m : float
        Points farther from the undeformed surface belong to something else [m].
    largest_normal_deg : float
        So do those whose normals are turned more against its own.
    largest_view_deg : float
        Cells that an eye sees more from the side are left out.
    clear_m, shaft_clear_m : float
        Lines of sight keep this distance from the probe's axis: up to `shaft_from_m` above the
        tip, and above it [m]. Nearer by, windows hold both probe and surface.
    shaft_from_m : float
    fewest_points : float
        Of a cell in a frame; with fewer it was not seen.
    fewest_part : float
        Nor with less than this part of its mean count at rest.
    fewest_rest_frames : int
        In which a cell is seen.
    near_m : float
        The camera must see some of the surface this near to the contact [m].
    """

    spacing_m: float = 0.004
    reach_m: float = 0.1
    largest_distance_m: float = 0.012
    largest_normal_deg: float = 60.0
    largest_view_deg: float = 70.0
    clear_m: float = 0.015
    shaft_clear_m: float = 0.035
    shaft_from_m: float = 0.05
    fewest_points: float = 2
    fewest_part: float = 0.5
    fewest_rest_frames: int = 3
    near_m: float = 0.04


@dataclass(frozen=True)
class SurfaceMotion:
    """Normal motion of a surface's cells in each frame against the frames at rest.

    Attributes
    ----------
    cell_m, normal : (c, 3) arrays
        Places on the undeformed template, object frame [m], and unit normals outward.
    moved_m : (f, c) array
        From a cell along its normal to the observed surface, less the same at rest [m]; not a
        number where the cell was not seen.
    std_m : (f, c) array
        Standard deviation of a frame's own noise [m]; not that of the rest, which all frames share.
    rest_height_m, rest_std_m : (c,) arrays
        Mean distance of the frames at rest from the template, and its standard deviation [m].
    points : (f, c) int array
        How many a cell was seen with.
    rest_frames : (r,) int array
        Frames at rest.
    correlation_m : float
        L of the noise's correlation exp(-(distance / L)^2) between cells [m].
    pattern_m : float
        Beside its noise the motion m carries what the sensor's pattern has become, of the variance
        pattern_m * abs(m) and the covariance pattern_m * min(abs(m), abs(m')) of two frames [m].
    """

    cell_m: NDArray
    normal: NDArray
    moved_m: NDArray
    std_m: NDArray
    rest_height_m: NDArray
    rest_std_m: NDArray
    points: NDArray
    rest_frames: NDArray
    correlation_m: float
    pattern_m: float


def frames_at_rest(
    depth_m: NDArray, force_n: NDArray, *, onset_force_n: float, clear_m: float = 0.0005
) -> NDArray:
    """Frames before the touch, (r,).

    Parameters
    ----------
    depth_m : (f,) array
        Depth of the sphere's lowest point below the undeformed surface (`indentation_depth`) [m].
    force_n : (f,) array
        Magnitude of the force [N].
    onset_force_n : float
        Smallest force that counts as contact [N].
    clear_m : float, optional
        The tip is at least this far above the surface; depths are known to about half of it [m].

    Raises
    ------
    ValueError
        If there is none.
    """
    touched = np.flatnonzero(force_n > onset_force_n)
    before = np.arange(len(force_n)) < (touched[0] if len(touched) else len(force_n))
    frames = np.flatnonzero(before & (depth_m < -clear_m))
    if not len(frames):
        expected = f"frames before the force's onset with the tip {clear_m * 1e3:g} mm clear"
        raise ValueError(f"frames: expected {expected} of the surface, found none")
    return frames


def surface_motion(
    template: Template,
    alignment: Alignment,
    clouds: Sequence[tuple[NDArray, NDArray]],
    probe: ProbeInView,
    rest_frames: NDArray,
    options: ObservationOptions | None = None,
) -> SurfaceMotion:
    """Motion of the surface around the contact in each frame of a capture.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    alignment : Alignment
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        Of each frame, camera frame.
    probe : ProbeInView
        In each frame (`probe_in_view`).
    rest_frames : (r,) int array
        Frames at rest (`frames_at_rest`).
    options : ObservationOptions, optional

    Raises
    ------
    ValueError
        If no frame is at rest, the camera does not see the surface around the contact, or no cell
        is left.
    """
    options = options or ObservationOptions()
    frames = np.asarray(rest_frames, dtype=int)
    if not len(frames) or len(probe.tip_m) != len(clouds):
        expected = f"some at rest and one place of the probe for each of {len(clouds)}"
        raise ValueError(f"frames: expected {expected}, found {len(frames)}, {len(probe.tip_m)}")
    surface = RestSurface(template)
    feet = [_feet(surface, alignment, cloud, options) for cloud in clouds]
    at_rest = [feet[k] for k in frames]
    _require_seen(surface, alignment, at_rest[0], options)
    cells = _facing(
        cells_of(at_rest, alignment.contact_point_m, spacing_m=options.spacing_m), probe, options
    )
    height, points = _heights(cells, feet, options)
    height[_hidden(cells, points, probe, frames, options)] = np.nan
    seen = np.isfinite(height[frames]).sum(axis=0) >= options.fewest_rest_frames
    if not seen.any():
        expected = f"cells seen in {options.fewest_rest_frames} frames at rest"
        raise ValueError(f"clouds: expected {expected}, found none")
    cells = Cells(cells.cell_m[seen], cells.normal[seen])
    return _motion(cells, height[:, seen], points[:, seen], frames, alignment.contact_point_m)


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


def save_motion(path: str | Path, motion: SurfaceMotion) -> None:
    """Write a motion as NPZ."""
    np.savez_compressed(path, **{one.name: getattr(motion, one.name) for one in fields(motion)})


def load_motion(path: str | Path) -> SurfaceMotion:
    """Read what `save_motion` wrote.

    Raises
    ------
    ValueError
        If an array is missing, or of another number of frames or cells than the rest.
    """
    with np.load(path, allow_pickle=False) as data:
        missing = [one.name for one in fields(SurfaceMotion) if one.name not in data.files]
        if missing:
            raise ValueError(f"{path}: {missing[0]}: expected an array, found none")
        arrays = {one.name: data[one.name] for one in fields(SurfaceMotion)}
    shape = arrays["moved_m"].shape
    for name in ("std_m", "points"):
        if arrays[name].shape != shape or len(shape) != 2:
            raise ValueError(f"{path}: {name}: expected shape {shape}, found {arrays[name].shape}")
    for name in ("cell_m", "normal"):
        if arrays[name].shape != (shape[1], 3):
            expected = (shape[1], 3)
            raise ValueError(f"{path}: {name}: expected shape {expected}, found others")
    lengths = {name: float(arrays[name]) for name in ("correlation_m", "pattern_m")}
    return SurfaceMotion(**arrays | lengths)


def _feet(
    surface: RestSurface,
    alignment: Alignment,
    cloud: tuple[NDArray, NDArray],
    options: ObservationOptions,
) -> Feet:
    pose = alignment.camera_from_object
    points, normals = to_object(pose, cloud[0]), cloud[1] @ pose[:3, :3]
    offset = np.linalg.norm(points - alignment.contact_point_m, axis=1)
    near = offset < options.reach_m + options.largest_distance_m
    feet = surface.feet(
        points[near],
        normals[near],
        largest_distance_m=options.largest_distance_m,
        largest_normal_deg=options.largest_normal_deg,
    )
    inside = np.linalg.norm(feet.foot_m - alignment.contact_point_m, axis=1) < options.reach_m
    return Feet(feet.foot_m[inside], feet.normal[inside], feet.distance_m[inside])


def _facing(cells: Cells, probe: ProbeInView, options: ObservationOptions) -> Cells:
    """Cells that no eye sees too much from the side."""
    least = np.cos(np.deg2rad(options.largest_view_deg))
    kept = np.ones(len(cells.cell_m), dtype=bool)
    for eye in probe.eyes_m:
        view = eye - cells.cell_m
        kept &= (view * cells.normal).sum(axis=1) > least * np.linalg.norm(view, axis=1)
    return Cells(cells.cell_m[kept], cells.normal[kept])


def _heights(
    cells: Cells, feet: Sequence[Feet], options: ObservationOptions
) -> tuple[NDArray, NDArray]:
    """Clipped mean distance of each frame's points in each cell [m], and their number, (f, c)."""
    numbers = [cells.numbers(one, reach_m=options.spacing_m) for one in feet]
    middle = np.array(
        [
            _medians(n, one.distance_m, len(cells.cell_m))
            for n, one in zip(numbers, feet, strict=True)
        ]
    )
    rest = [one.distance_m - m[n] for n, m, one in zip(numbers, middle, feet, strict=True)]
    used = np.concatenate([r[n >= 0] for n, r in zip(numbers, rest, strict=True)])
    limit = CLIP * FROM_MEDIAN * np.median(np.abs(used))
    height, points = np.full(middle.shape, np.nan), np.zeros(middle.shape, dtype=np.int64)
    for k, one in enumerate(feet):
        kept = (numbers[k] >= 0) & (np.abs(rest[k]) <= limit)
        points[k] = np.bincount(numbers[k][kept], minlength=middle.shape[1])
        sums = np.bincount(numbers[k][kept], one.distance_m[kept], middle.shape[1])
        seen = points[k] >= options.fewest_points
        height[k, seen] = sums[seen] / points[k, seen]
    return height, points


def _medians(numbers: NDArray, values: NDArray, count: int) -> NDArray:
    """Median of the values in each cell (c,); not a number where there are none."""
    kept = numbers >= 0
    order = np.lexsort((values[kept], numbers[kept]))
    sorted_values = values[kept][order]
    size = np.bincount(numbers[kept], minlength=count)
    first = np.cumsum(size) - size
    last = max(len(sorted_values) - 1, 0)
    low, high = (np.minimum(first + half, last) for half in ((size - 1) // 2, size // 2))
    found = (sorted_values[low] + sorted_values[high]) / 2 if len(sorted_values) else 0.0
    return np.where(size > 0, found, np.nan)


def _hidden(
    cells: Cells,
    points: NDArray,
    probe: ProbeInView,
    rest_frames: NDArray,
    options: ObservationOptions,
) -> NDArray:
    """Which cells the probe or its shadow hides or comes too near, (f, c)."""
    lower, upper = (0.0, options.shaft_from_m), (options.shaft_from_m, SHAFT_M)
    near = np.array(
        [
            (probe.clearance(cells.cell_m, k, along_m=lower) < options.clear_m)
            | (probe.clearance(cells.cell_m, k, along_m=upper) < options.shaft_clear_m)
            for k in range(len(points))
        ]
    )
    counted = np.where(near, np.nan, points)[rest_frames]
    usual = np.nansum(counted, axis=0) / np.maximum(np.isfinite(counted).sum(axis=0), 1)
    return near | (points < options.fewest_part * usual)


def _motion(
    cells: Cells, height: NDArray, points: NDArray, frames: NDArray, contact_m: NDArray
) -> SurfaceMotion:
    base = np.nanmean(height[frames], axis=0)
    moved = height - base
    variance, own = _noise_variance(moved[frames])
    rest_variance = variance / own
    std = np.where(np.isfinite(moved), np.sqrt(variance), np.nan)
    pressed = _pressed(cells, moved, contact_m)
    counts = np.maximum(np.isfinite(moved[pressed]).sum(axis=0), 1)
    mean = np.where(np.isfinite(moved[pressed]), moved[pressed], 0).sum(axis=0) / counts
    mean[~np.isfinite(moved[pressed]).any(axis=0)] = np.nan
    return SurfaceMotion(
        cell_m=cells.cell_m,
        normal=cells.normal,
        moved_m=moved,
        std_m=std,
        rest_height_m=base,
        rest_std_m=np.sqrt(rest_variance),
        points=points,
        rest_frames=frames,
        correlation_m=correlation_length(cells.cell_m, moved[frames] / np.sqrt(variance)),
        pattern_m=pattern_growth(cells.cell_m, mean, variance / counts + rest_variance, contact_m),
    )


def _noise_variance(noise: NDArray) -> tuple[NDArray, NDArray]:
    """Variance of each cell's noise at rest [m^2], and its number of frames, both (c,).

    A cell's own few frames are taken together with what is usual.
    """
    own = np.isfinite(noise).sum(axis=0)
    squares = np.nansum(noise**2, axis=0)
    usual = np.mean(squares) / np.mean(own - 1)
    return (POOLED_FRAMES * usual + squares) / (POOLED_FRAMES + own - 1), own


def _pressed(cells: Cells, moved: NDArray, contact_m: NDArray) -> NDArray:
    """Frames in which the surface around the contact is moved the farthest, (k,)."""
    near = np.linalg.norm(cells.cell_m - contact_m, axis=1) < SMOOTH_REACH_M
    way = np.where(np.isfinite(moved), np.abs(moved), 0)[:, near].mean(axis=1)
    return np.flatnonzero(way >= PRESSED_PART * way.max())


def _require_seen(
    surface: RestSurface, alignment: Alignment, feet: Feet, options: ObservationOptions
) -> None:
    """Refuse a capture whose camera does not see the surface around the contact."""
    offset = np.linalg.norm(feet.foot_m - alignment.contact_point_m, axis=1)
    if not (offset < options.near_m).any():
        raise ValueError(
            f"clouds: expected the surface within {options.near_m:g} m of the contact in view,"
            " found none of it (object larger than the view?)"
        )
