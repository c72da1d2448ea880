"""Surface displacement, straight from the clouds.

Camera and object stand still during an indentation. What calibration, alignment, template and the
sensor's fixed pattern are wrong by is therefore the same in every frame, and goes with the mean of
the frames at rest; noise is left, and what the sensor does to a surface that moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from palpate.estimate.direct.options import Observation
from palpate.estimate.direct.samples import (
    ProbeInView,
    RestSurface,
    cell_heights,
    facing_samples,
    hidden_samples,
    samples_of,
)
from palpate.npz import read_shaped
from palpate.surface.alignment import Alignment
from palpate.surface.template import Template

# A sample's own few frames at rest, against the deviation of all samples: worth so many frames.
POOLED_FRAMES = 6.0
# A sample is seen in so many frames at rest or more.
FEWEST_AT_REST = 3
# The camera must see some of the surface this near to the contact [m].
NEAR_M = 0.04
# More frames at rest than these do not determine better where samples are.
MOST_AT_REST = 120
# Of `MotionAlong`, what frames share.
OF_SAMPLES = ("cell_m", "way", "axis", "rest_std_m", "window_m")
SHAPES = {
    "cell_m": ("samples", 3),
    "normal": ("samples", 3),
    "moved_m": ("frames", "samples"),
    "std_m": ("frames", "samples"),
    "rest_height_m": ("samples",),
    "rest_std_m": ("samples",),
    "points": ("frames", "samples"),
    "rest_frames": ("frames at rest",),
    "across": ("ways", "samples", 3),
    "across_m": ("frames", "ways", "samples"),
    "across_std_m": ("ways", "samples"),
    "across_rest_std_m": ("ways", "samples"),
    "window_m": ("ways", "samples", 3),
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
    rest_height_m, rest_std_m : (c,) arrays
        Mean distance of the frames at rest from the template, and its standard deviation [m].
    points : (f, c) int array
        How many a sample was seen with.
    rest_frames : (r,) int array
    across : (a, c, 3) array
        Unit vectors across the lines of sight, along the picture's columns and rows, object frame;
        of no ways where no pictures were followed (`with_pictures`).
    across_m : (f, a, c) array
        How far the material has moved along them [m]; NaN where its texture was not found.
    across_std_m, across_rest_std_m : (a, c) arrays
        Standard deviation of a frame's own noise, and of the mean of the frames at rest [m].
    window_m : (a, c, 3) array
        Sides along the surface of a picture's window, object frame [m].
    """

    cell_m: NDArray
    normal: NDArray
    moved_m: NDArray
    std_m: NDArray
    rest_height_m: NDArray
    rest_std_m: NDArray
    points: NDArray
    rest_frames: NDArray
    across: NDArray
    across_m: NDArray
    across_std_m: NDArray
    across_rest_std_m: NDArray
    window_m: NDArray


@dataclass(frozen=True)
class MotionAlong:
    """Motions of samples, each along a direction of its own: what is compared, whatever it is.

    Attributes
    ----------
    cell_m, way : (n, 3) arrays
        Places on the undeformed template and unit vectors, object frame [m].
    axis : (n,) int array
        0: where the surface is along its normal; 1, 2: where what was there has moved, along the
        picture's columns and rows.
    moved_m, std_m : (f, n) arrays
        [m]; NaN where a sample was not seen.
    rest_std_m : (n,) array
        Deviation that all frames share [m].
    window_m : (n, 2, 3) array
        Sides on the surface of the window over which a motion is a mean [m]; 0 along normals.
    """

    cell_m: NDArray
    way: NDArray
    axis: NDArray
    moved_m: NDArray
    std_m: NDArray
    rest_std_m: NDArray
    window_m: NDArray

    @staticmethod
    def of(motion: SurfaceMotion) -> "MotionAlong":
        """Take a surface's motion apart."""
        ways, count = len(motion.across), len(motion.cell_m)
        across = motion.across_m.reshape(len(motion.moved_m), ways * count)
        std = np.where(np.isfinite(across), motion.across_std_m.reshape(-1), np.nan)
        windows = np.tile(motion.window_m.swapaxes(0, 1), (ways, 1, 1))
        return MotionAlong(
            cell_m=np.tile(motion.cell_m, (1 + ways, 1)),
            way=np.concatenate([motion.normal, motion.across.reshape(-1, 3)]),
            axis=np.repeat(np.arange(1 + ways), count),
            moved_m=np.concatenate([motion.moved_m, across], axis=1),
            std_m=np.concatenate([motion.std_m, std], axis=1),
            rest_std_m=np.append(motion.rest_std_m, motion.across_rest_std_m.reshape(-1)),
            window_m=np.concatenate([np.zeros((count, 2, 3)), windows.reshape(-1, 2, 3)]),
        )

    def at(self, frames: NDArray, chosen: NDArray) -> "MotionAlong":
        """The same of some frames (numbers) and samples (a mask)."""
        own = {name: getattr(self, name)[chosen] for name in OF_SAMPLES}
        both = {name: getattr(self, name)[frames][:, chosen] for name in ("moved_m", "std_m")}
        return MotionAlong(**own, **both)

    @property
    def noise_std_m(self) -> NDArray:
        """Deviation of a frame's noise and of what it is compared with, (f, n) [m]."""
        return np.hypot(self.std_m, self.rest_std_m)


def surface_motion(
    template: Template,
    alignment: Alignment,
    clouds: Sequence[tuple[NDArray, NDArray]],
    probe: ProbeInView,
    rest_frames: NDArray,
    options: Observation,
) -> SurfaceMotion:
    """Displacement of the surface around the contact in each frame of a capture.

    Parameters
    ----------
    template : Template
        Undeformed, object frame.
    alignment : Alignment
    clouds : sequence of (points (n, 3) [m], normals (n, 3))
        Of each frame, camera frame.
    probe : ProbeInView
        In each frame.
    rest_frames : (r,) int array
        Frames at rest (`observe.rest_frames`).
    options : Observation

    Raises
    ------
    ValueError
        If no frame is at rest, the camera does not see the surface around the contact, or no sample
        is left.
    """
    frames = np.asarray(rest_frames, dtype=int)
    if not len(frames) or len(probe.tip_m) != len(clouds):
        expected = f"some at rest and one place of the probe for each of {len(clouds)}"
        raise ValueError(f"frames: expected {expected}, found {len(frames)}, {len(probe.tip_m)}")
    surface = RestSurface(template)
    at_rest = {k: surface.in_frame(alignment, clouds[k], options) for k in frames[:MOST_AT_REST]}
    contact = alignment.contact_point_m
    if not (np.linalg.norm(at_rest[frames[0]].closest_m - contact, axis=1) < NEAR_M).any():
        raise ValueError(
            f"clouds: expected the surface within {NEAR_M:g} m of the contact in view,"
            " found none of it (object larger than the view?)"
        )
    found = samples_of(list(at_rest.values()), contact, spacing_m=options.spacing_m)
    samples = facing_samples(found, probe, options)
    every = (
        at_rest.pop(k, None) or surface.in_frame(alignment, cloud, options)
        for k, cloud in enumerate(clouds)
    )
    height, points = cell_heights(samples, every, options)
    height[hidden_samples(samples, points, probe, frames, options)] = np.nan
    seen = np.isfinite(height[frames]).sum(axis=0) >= FEWEST_AT_REST
    if not seen.any():
        expected = f"samples seen in {FEWEST_AT_REST} frames at rest"
        raise ValueError(f"clouds: expected {expected}, found none")
    height = height[:, seen]
    base = np.nanmean(height[frames], axis=0)
    moved = height - base
    variance, own = noise_variance(moved[frames])
    return SurfaceMotion(
        **vars(samples.at(seen)),
        moved_m=moved,
        std_m=np.where(np.isfinite(moved), np.sqrt(variance), np.nan),
        rest_height_m=base,
        rest_std_m=np.sqrt(variance / own),
        points=points[:, seen],
        rest_frames=frames,
        **no_pictures(*moved.shape),
    )


def no_pictures(frames: int, samples: int) -> dict[str, NDArray]:
    """Of a `SurfaceMotion` without pictures, what they would show."""
    std = np.empty((0, samples))
    return {
        "across": np.empty((0, samples, 3)),
        "across_m": np.empty((frames, 0, samples)),
        "across_std_m": std,
        "across_rest_std_m": std,
        "window_m": np.empty((0, samples, 3)),
    }


def noise_variance(noise: NDArray) -> tuple[NDArray, NDArray]:
    """Variance of each sample's noise (r, c) at rest with what is usual, and its frames, (c,)."""
    own = np.isfinite(noise).sum(axis=0)
    squares = np.nansum(noise**2, axis=0)
    usual = np.median(squares / chdtri(own - 1, 0.5))
    return (POOLED_FRAMES * usual + squares) / (POOLED_FRAMES + own - 1), own


def save_motion(path: str | Path, motion: SurfaceMotion) -> None:
    """Write a displacement as NPZ."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(motion))


def load_motion(path: str | Path) -> SurfaceMotion:
    """Read what `save_motion` wrote.

    Raises
    ------
    ValueError
        If an array is missing, or of another number of frames or samples than the rest.
    """
    return SurfaceMotion(**read_shaped(path, SHAPES, what="a surface's motion"))
