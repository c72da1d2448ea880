"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.press_model import PressModel
from palpate.estimate.relaxation import elastic_force

# Of finite differences, by log E, nu, gain, the fractions, the depth's offset [m], the clock's [s].
STEP = 1e-4
STEPS = {"offset_m": 1e-6, "clock_s": 1e-4}
# Deviations beyond which a residual counts with its size alone.
ROBUST = 2.0
FROM_MEDIAN = 1.4826


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
    contact_m : (3,) array
        Middle of the contact, object frame [m].
    cell_m, normal : (c, 3) arrays
        Cells of the undeformed surface outside of the contact, object frame [m], and normals.
    moved_m, moved_std_m : (k, c) arrays
        Motion along the normals in the compared frames and its deviation [m]; NaN: not seen.
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
    contact_m: NDArray
    cell_m: NDArray
    normal: NDArray
    moved_m: NDArray
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
    offset_m, clock_s : float
        Errors of the depth [m] and of the clock [s].
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    gain: float
    fractions: NDArray
    offset_m: float
    clock_s: float

    @property
    def vector(self) -> NDArray:
        """(log E, nu, gain, fractions, offset, clock)."""
        shared = [np.log(self.youngs_modulus_pa), self.poisson_ratio, self.gain]
        return np.array([*shared, *self.fractions, self.offset_m, self.clock_s])

    @staticmethod
    def of(vector: NDArray) -> "Parameters":
        """Read a vector as `vector` writes it."""
        E, nu, gain = float(np.exp(vector[0])), float(vector[1]), float(vector[2])
        return Parameters(E, nu, gain, vector[3:-2], float(vector[-2]), float(vector[-1]))


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
    motion = (1 + of.gain) * model.motion(depth, nu)
    gap = ((press.moved_m - motion) / press.moved_std_m)[press.seen]
    return Residuals((depth - measured) / std, gap)


def linearised(press: DirectPress, law: str, of: Parameters, *, times_s: NDArray) -> Linearised:
    """Residuals and their derivatives, by forward differences."""
    start, here = of.vector, residuals(press, law, of, times_s=times_s)
    steps = np.full(len(start), STEP)
    steps[-2:] = STEPS["offset_m"], STEPS["clock_s"]
    columns = []
    for k, step in enumerate(steps):
        moved = start.copy()
        moved[k] += step
        there = residuals(press, law, Parameters.of(moved), times_s=times_s)
        columns.append(
            ((there.depth - here.depth) / step, (there.motion - here.motion) / step)
        )
    depth, motion = (np.stack(part, axis=1) for part in zip(*columns, strict=True))
    return Linearised(here, depth, motion)


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
