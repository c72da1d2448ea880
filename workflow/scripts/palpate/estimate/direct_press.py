"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from palpate.estimate.press_model import PressModel
from palpate.estimate.relaxation import elastic_force

# Of finite differences: log E, nu, gain and fractions; each capture's own, in metres and seconds.
STEP = 1e-4
OWN_STEPS = {"offset_m": 1e-6, "clock_s": 1e-4, "shift_m": 1e-6}
OWN = len(OWN_STEPS)
# Deviations beyond which a residual counts with its size alone.
ROBUST = 8.0
FROM_MEDIAN = 1.4826
# Groups of motions of like size, from which the pattern's share is found.
PATTERN_PARTS = 12


@dataclass(frozen=True)
class DirectPress:
    """What one capture gives to the direct estimate.

    Attributes
    ----------
    time_s, force_n : (f,) arrays
        Times of all frames [s] and force along the press in them [N].
    frames : (k,) int array
        Frames in contact that are compared.
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
    patch : (c,) int array
        Part of the surface that a cell belongs to; errors of different parts are independent.
    models : dict of str to PressModel
        By law.
    """

    time_s: NDArray
    force_n: NDArray
    frames: NDArray
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
        own = [getattr(self, name) for name in OWN_STEPS]
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


def residuals(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Residuals:
    """Compare a capture with what its measured force makes of the object.

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
    model, E, nu = press.models[law], of.youngs_modulus_pa, of.poisson_ratio
    elastic = elastic_force(press.time_s, press.force_n, fractions=of.fractions, times_s=times_s)
    unit = elastic[press.frames] / E
    depth = model.depth(unit, nu)
    measured = press.depth_m + of.offset_m + of.clock_s * press.speed_m_s
    std = np.hypot(press.depth_std_m, press.force_std_n / E * _softness(model, unit, nu))
    motion = (1 + of.gain) * model.motion(depth, nu) + of.shift_m
    gap = ((press.moved_m - motion) / press.moved_std_m)[press.seen]
    return Residuals((depth - measured) / std, gap)


def linearised(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Linearised:
    """Residuals and their derivatives, by forward differences."""
    start, here = of.vector, residuals(press, law, of, times_s=times_s)
    steps = np.full(len(start), STEP)
    steps[-OWN:] = list(OWN_STEPS.values())
    columns = []
    for k, step in enumerate(steps):
        moved = start.copy()
        moved[k] += step
        there = residuals(press, law, Parameters.of(moved), times_s=times_s)
        columns.append(((there.depth - here.depth) / step, (there.motion - here.motion) / step))
    depth, motion = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    return Linearised(here, depth, motion)


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
    return replace(press, moved_std_m=np.sqrt(variance + of_motion * motion))


def robust_weights(gaps: NDArray, scale: float) -> NDArray:
    """Weights of squares that make them soft absolute values beyond `ROBUST` deviations."""
    return 1 / np.sqrt(1 + (gaps / (ROBUST * scale)) ** 2)


def robust_scale(gaps: NDArray) -> float:
    """Deviation of the middle of the gaps; 1 without any."""
    return max(FROM_MEDIAN * float(np.median(np.abs(gaps))), 1e-9) if len(gaps) else 1.0


def _softness(model: PressModel, unit: NDArray, nu: float) -> NDArray:
    """Depth for each unit of F / E, (n,) [1/m]."""
    step = 1e-3 * np.maximum(unit, 1e-3 * unit.max())
    return (model.depth(unit + step, nu) - model.depth(unit, nu)) / step
