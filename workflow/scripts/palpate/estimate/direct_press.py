"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from palpate.estimate.hertz_range import FROM_MEDIAN
from palpate.estimate.motion_noise import correlation_length
from palpate.estimate.press_model import PressModel
from palpate.estimate.relaxation import elastic_force, elastic_force_derivatives
from palpate.estimate.scatter import surface_patches

# Of the difference that gives the derivative by nu.
STEP = 1e-4
# Unknowns that each capture has for itself.
OWN_NAMES = ("offset_m", "clock_s", "shift_m")
OWN = len(OWN_NAMES)
# Deviations beyond which a residual counts with its size alone.
ROBUST = 8.0
# Groups of motions of like size, from which the pattern's share is found.
PATTERN_PARTS = 12
# Larger parts would be too few to tell their scatter [m].
LARGEST_PATCH_M = 0.04


@dataclass(frozen=True)
class DirectPress:
    """What one capture gives to the direct estimate.

    Attributes
    ----------
    time_s, force_n : (f,) arrays
        Times of all frames [s] and force along the press in them [N].
    frames : (k,) int array
        Frames in contact that are compared.
    frames_beyond : int
        Frames that are not, as they are deeper than the look-up.
    depth_m, speed_m_s : (k,) arrays
        Way of the sphere since its first touch in them [m], and its speed [m/s].
    depth_std_m : float
        Standard deviation of the depth from frame to frame [m].
    offset_std_m : float
        Of an error that all depths share [m].
    clock_std_s : float
        Of force clock minus camera clock [s].
    force_std_n : float
        Of the force from frame to frame [N].
    shift_std_m : float
        Of what the camera is off by in common while the object is pressed [m].
    contact_m : (3,) array
        Middle of the contact, object frame [m].
    cell_m, normal : (c, 3) arrays
        Cells of the undeformed surface outside of the contact, object frame [m], and normals.
    moved_m, noise_std_m : (k, c) arrays
        Motion along the normals in the compared frames and the deviation of a frame's own noise
        [m]; NaN: not seen.
    moved_std_m : (k, c) array
        Deviation that the fit divides by [m].
    patch_m : float
        Least size of the parts of the surface whose errors are independent [m].
    patch : (c,) int array
        Part of the surface that a cell belongs to; errors of different parts are independent.
    models : dict of str to PressModel
        By law.
    """

    time_s: NDArray
    force_n: NDArray
    frames: NDArray
    frames_beyond: int
    depth_m: NDArray
    speed_m_s: NDArray
    depth_std_m: float
    offset_std_m: float
    clock_std_s: float
    force_std_n: float
    shift_std_m: float
    contact_m: NDArray
    cell_m: NDArray
    normal: NDArray
    moved_m: NDArray
    noise_std_m: NDArray
    moved_std_m: NDArray
    patch_m: float
    patch: NDArray
    models: dict[str, PressModel]

    @cached_property
    def seen(self) -> NDArray:
        """Which motions count, (k, c) bool."""
        return np.isfinite(self.moved_m) & np.isfinite(self.moved_std_m)


@dataclass(frozen=True)
class Parameters:
    """Unknowns of one capture.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio : float
        Instantaneous modulus [Pa].
    gain : float
        Relative error of the camera's distances along the normals.
    fractions : (p,) array
        Shares of the modulus that relax.
    offset_m, clock_s, shift_m : float
        Errors of the depth [m] and of the clock [s], and what all motions have in common [m].
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    gain: float
    fractions: NDArray
    offset_m: float
    clock_s: float
    shift_m: float

    @property
    def vector(self) -> NDArray:
        """(log E, nu, gain, fractions, offset, clock, shift)."""
        shared = [np.log(self.youngs_modulus_pa), self.poisson_ratio, self.gain]
        own = [getattr(self, name) for name in OWN_NAMES]
        return np.array([*shared, *self.fractions, *own])

    @staticmethod
    def of(vector: NDArray) -> "Parameters":
        """Read a vector as `vector` writes it."""
        E, nu, gain = float(np.exp(vector[0])), float(vector[1]), float(vector[2])
        return Parameters(E, nu, gain, vector[3:-OWN], *map(float, vector[-OWN:]))


@dataclass(frozen=True)
class Residuals:
    """Depth residuals (k,) and motion residuals (number seen,), over their deviations."""

    depth: NDArray
    motion: NDArray


@dataclass(frozen=True)
class Linearised:
    """Residuals of a capture with their derivatives by its parameters (q of them).

    Attributes
    ----------
    residuals : Residuals
    depth_slope, motion_slope : (k, q), (m, q) arrays
    """

    residuals: Residuals
    depth_slope: NDArray
    motion_slope: NDArray


@dataclass(frozen=True)
class Predicted:
    """What parameters make of a capture's force: depths (k,), motions (k, c), and their slopes.

    Attributes
    ----------
    unit_m2, depth_m, softness_per_m : (k,) arrays
        Elastic force over E [m^2], depth when it was measured [m], its derivative by the former
        [1/m].
    motion_m, motion_slope : (k, c) arrays
        Without gain and shift [m], and by the depth.
    """

    unit_m2: NDArray
    depth_m: NDArray
    softness_per_m: NDArray
    motion_m: NDArray
    motion_slope: NDArray


def predicted(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Predicted:
    """Depth and motion that a capture's measured force makes of the object.

    The force's history gives the elastic force, that over E the depth, and the depth the motion of
    the surface: the force, with few parts in a thousand of error, is what is least in doubt.

    Parameters
    ----------
    press : DirectPress
    law : str
    of : Parameters
    times_s : (p,) array
        Relaxation times [s].
    """
    model, nu = press.models[law], of.poisson_ratio
    elastic = elastic_force(press.time_s, press.force_n, fractions=of.fractions, times_s=times_s)
    unit = elastic[press.frames] / of.youngs_modulus_pa
    depth, softness = model.depth(unit, nu)
    # The camera saw the surface a little earlier or later than the force was read.
    seen_at = depth - of.clock_s * press.speed_m_s
    return Predicted(unit, depth, softness, *model.motion(seen_at, nu))


def residuals(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Residuals:
    """Compare a capture with what its measured force makes of the object."""
    return _residuals(press, of, predicted(press, law, of, times_s=times_s))


def linearised(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Linearised:
    """Residuals and their derivatives: by nu as a difference, else exact but for the deviations'.

    Columns are in the order of `Parameters.vector`.
    """
    here = predicted(press, law, of, times_s=times_s)
    there = predicted(
        press, law, replace(of, poisson_ratio=of.poisson_ratio + STEP), times_s=times_s
    )
    by_fraction = elastic_force_derivatives(
        press.time_s, press.force_n, fractions=of.fractions, times_s=times_s
    )[press.frames]
    by_fraction = here.softness_per_m[:, None] * by_fraction / of.youngs_modulus_pa
    by_log_E = -here.softness_per_m * here.unit_m2
    zero, one = np.zeros(len(press.frames)), np.ones(len(press.frames))
    by_nu = (there.depth_m - here.depth_m) / STEP
    # Depth: by log E, nu, gain, fractions; then the measured depth's offset, clock and shift.
    depth = np.column_stack([by_log_E, by_nu, zero, by_fraction, -one, -press.speed_m_s, zero])
    gain = 1 + of.gain
    motion = [
        gain * here.motion_slope * by_log_E[:, None],
        gain * (there.motion_m - here.motion_m) / STEP,
        here.motion_m,
        *(gain * here.motion_slope * column[:, None] for column in by_fraction.T),
        np.zeros_like(here.motion_m),
        -gain * here.motion_slope * press.speed_m_s[:, None],
        np.ones_like(here.motion_m),
    ]
    divided = [(-column / press.moved_std_m)[press.seen] for column in motion]
    std = depth_std(press, of, here)
    return Linearised(_residuals(press, of, here), depth / std[:, None], np.stack(divided, axis=1))


def depth_std(press: DirectPress, of: Parameters, here: Predicted) -> NDArray:
    """Deviation of each depth residual: of the tip, and of the force that gives the depth [m]."""
    return np.hypot(
        press.depth_std_m, press.force_std_n / of.youngs_modulus_pa * here.softness_per_m
    )


def _residuals(press: DirectPress, of: Parameters, here: Predicted) -> Residuals:
    measured = press.depth_m + of.offset_m + of.clock_s * press.speed_m_s
    motion = (1 + of.gain) * here.motion_m + of.shift_m
    gap = ((press.moved_m - motion) / press.moved_std_m)[press.seen]
    return Residuals((here.depth_m - measured) / depth_std(press, of, here), gap)


def with_pattern(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> DirectPress:
    """Deviations as the residuals show them: of each frame's noise, and of what moves.

    A sensor's fixed pattern cancels where nothing moves; where the surface moves it does not, with
    a variance about in proportion to the motion. Both shares are found by least squares.
    """
    gaps = residuals(press, law, of, times_s=times_s).motion * press.moved_std_m[press.seen]
    noise = press.noise_std_m[press.seen] ** 2
    size = np.abs(press.moved_m[press.seen] - gaps)
    order = np.argsort(size)
    parts = [part for part in np.array_split(order, PATTERN_PARTS) if len(part)]
    rows = [(np.mean(noise[part]), np.mean(size[part])) for part in parts]
    found = [robust_scale(gaps[part]) ** 2 for part in parts]
    weight = 1 / np.maximum(found, 1e-18)
    table = np.array(rows) * weight[:, None]
    (of_noise, of_motion), _ = nnls(table, found * weight)
    variance = of_noise * press.noise_std_m**2
    motion = np.full(press.moved_m.shape, np.nan)
    motion[press.seen] = size
    pressed = replace(press, moved_std_m=np.sqrt(variance + of_motion * motion))
    left = np.full(press.moved_m.shape, np.nan)
    left[press.seen] = gaps
    return replace(pressed, patch=_patches(pressed, left))


def _patches(press: DirectPress, left_m: NDArray) -> NDArray:
    """Patches at least as large as residuals err together: twice their correlation's length."""
    seen = press.seen.any(axis=0)
    mean = np.nanmean((left_m / press.moved_std_m)[:, seen], axis=0)
    length = correlation_length(press.cell_m[seen], mean[None])
    size = min(max(press.patch_m, 2 * length), LARGEST_PATCH_M)
    return surface_patches(press.cell_m, size_m=size)


def robust_weights(gaps: NDArray, scale: float) -> NDArray:
    """Weights of squares that make them soft absolute values beyond `ROBUST` deviations."""
    return 1 / np.sqrt(1 + (gaps / (ROBUST * scale)) ** 2)


def robust_scale(gaps: NDArray) -> float:
    """Deviation of the middle of the gaps; 1 without any."""
    return max(FROM_MEDIAN * float(np.median(np.abs(gaps))), 1e-9) if len(gaps) else 1.0
