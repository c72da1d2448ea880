"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.relaxation import elastic_force, elastic_force_derivatives
from palpate.estimate.direct.support_motion import MOTIONS, SupportAxes
from palpate.estimate.direct.table import SampleTable

# Of the difference that gives the derivative by nu.
STEP = 1e-4
# Unknowns that each capture has for itself: offset, clock, shift, and how the object settles.
OWN = 3 + MOTIONS


@dataclass(frozen=True)
class DirectIndentation:
    """What one capture gives to the direct estimate.

    Attributes
    ----------
    time_s, force_n : (f,) arrays
        Times of all frames [s] and force along the press in them [N].
    frames : (k,) int array
        Frames in contact that are compared.
    frames_beyond : int
        Frames that are not, as they are deeper than the indentation table.
    depth_m, speed_m_s : (k,) arrays
        Way of the sphere since its first touch in them [m], and its speed [m/s].
    depth_std_m : float
        Standard deviation of the depth from frame to frame [m].
    offset_std_m : float
        Of an error that all depths share [m].
    clock_expected_s, clock_std_s : float
        What the forces' clock offset is too large by if the clocks agree, and the deviation of the
        clocks' difference [s]. How far they differ is found with the moduli: what the press told
        of it before rests on a simpler contact, and the same record would count twice.
    force_std_n : float
        Of the force from frame to frame [N].
    shift_std_m : float
        Of what the camera is off by in common while the object is pressed [m].
    contact_m : (3,) array
        Middle of the contact, object frame [m].
    cell_m, normal : (c, 3) arrays
        Samples of the undeformed surface outside of the contact, object frame [m], and normals.
    moved_m, noise_std_m : (k, c) arrays
        Motion along the normals in the compared frames and the deviation of a frame's own noise
        [m]; NaN: not seen.
    moved_std_m : (k, c) array
        Deviation that the fit divides by [m].
    patch_m : float
        Least size of the parts of the surface whose errors are independent [m].
    cluster : (c,) int array
        Part of the surface that a sample belongs to; errors of different parts are independent.
    support_axes : SupportAxes
    models : dict of str to SampleTable
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
    clock_expected_s: float
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
    cluster: NDArray
    support_axes: SupportAxes
    models: dict[str, SampleTable]

    @cached_property
    def load(self) -> NDArray:
        """Force in the compared frames as part of the greatest in them, (k,)."""
        force = self.force_n[self.frames]
        return force / force.max()

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
    support_motion : (3,) array
        Motions of the object on its support under the greatest force (`SupportAxes`) [m, rad, rad].
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    gain: float
    fractions: NDArray
    offset_m: float
    clock_s: float
    shift_m: float
    support_motion: NDArray

    @property
    def vector(self) -> NDArray:
        """(log E, nu, gain, fractions, offset, clock, shift, settled)."""
        shared = [np.log(self.youngs_modulus_pa), self.poisson_ratio, self.gain]
        own = [self.offset_m, self.clock_s, self.shift_m]
        return np.array([*shared, *self.fractions, *own, *self.support_motion])

    @staticmethod
    def of(vector: NDArray) -> "Parameters":
        """Read a vector as `vector` writes it."""
        E, nu, gain = float(np.exp(vector[0])), float(vector[1]), float(vector[2])
        own, support_motion = vector[-OWN:-MOTIONS], vector[-MOTIONS:]
        return Parameters(E, nu, gain, vector[3:-OWN], *map(float, own), support_motion)


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


def predicted(
    indentation: DirectIndentation, law: str, of: Parameters, *, times_s: NDArray
) -> Predicted:
    """Depth and motion that a capture's measured force makes of the object.

    The force's history gives the elastic force, that over E the depth, and the depth the motion of
    the surface: the force, with few parts in a thousand of error, is what is least in doubt.

    Parameters
    ----------
    indentation : DirectIndentation
    law : str
    of : Parameters
    times_s : (p,) array
        Relaxation times [s].
    """
    model, nu = indentation.models[law], of.poisson_ratio
    elastic = elastic_force(
        indentation.time_s, indentation.force_n, fractions=of.fractions, times_s=times_s
    )
    unit = elastic[indentation.frames] / of.youngs_modulus_pa
    depth, softness = model.depth(unit, nu)
    # The camera saw the surface a little earlier or later than the force was read.
    seen_at = depth - of.clock_s * indentation.speed_m_s
    return Predicted(unit, depth, softness, *model.motion(seen_at, nu))


def residuals(
    indentation: DirectIndentation, law: str, of: Parameters, *, times_s: NDArray
) -> Residuals:
    """Compare a capture with what its measured force makes of the object."""
    return _residuals(indentation, of, predicted(indentation, law, of, times_s=times_s))


def linearised(
    indentation: DirectIndentation, law: str, of: Parameters, *, times_s: NDArray
) -> Linearised:
    """Residuals and their derivatives: by nu as a difference, else exact but for the deviations'.

    Columns are in the order of `Parameters.vector`.
    """
    here = predicted(indentation, law, of, times_s=times_s)
    there = predicted(
        indentation, law, replace(of, poisson_ratio=of.poisson_ratio + STEP), times_s=times_s
    )
    by_fraction = elastic_force_derivatives(
        indentation.time_s, indentation.force_n, fractions=of.fractions, times_s=times_s
    )[indentation.frames]
    by_fraction = here.softness_per_m[:, None] * by_fraction / of.youngs_modulus_pa
    by_log_E = -here.softness_per_m * here.unit_m2
    zero, one = np.zeros(len(indentation.frames)), np.ones(len(indentation.frames))
    by_nu = (there.depth_m - here.depth_m) / STEP
    # Depth: by log E, nu, gain, fractions; the measured depth's offset, clock, shift; settling.
    support_motion = indentation.load[:, None] * indentation.support_axes.tip_m
    depth = np.column_stack(
        [by_log_E, by_nu, zero, by_fraction, -one, -indentation.speed_m_s, zero, support_motion]
    )
    gain = 1 + of.gain
    motion = [
        gain * here.motion_slope * by_log_E[:, None],
        gain * (there.motion_m - here.motion_m) / STEP,
        here.motion_m + _support_motion(indentation, of),
        *(gain * here.motion_slope * column[:, None] for column in by_fraction.T),
        np.zeros_like(here.motion_m),
        -gain * here.motion_slope * indentation.speed_m_s[:, None],
        np.ones_like(here.motion_m),
        *(
            gain * indentation.load[:, None] * column
            for column in indentation.support_axes.samples_m.T
        ),
    ]
    divided = [(-column / indentation.moved_std_m)[indentation.seen] for column in motion]
    std = depth_std(indentation, of, here)
    return Linearised(
        _residuals(indentation, of, here), depth / std[:, None], np.stack(divided, axis=1)
    )


def depth_std(indentation: DirectIndentation, of: Parameters, here: Predicted) -> NDArray:
    """Deviation of each depth residual: of the tip, and of the force that gives the depth [m]."""
    return np.hypot(
        indentation.depth_std_m,
        indentation.force_std_n / of.youngs_modulus_pa * here.softness_per_m,
    )


def _residuals(indentation: DirectIndentation, of: Parameters, here: Predicted) -> Residuals:
    measured = indentation.depth_m + of.offset_m + of.clock_s * indentation.speed_m_s
    motion = (1 + of.gain) * (here.motion_m + _support_motion(indentation, of)) + of.shift_m
    gap = ((indentation.moved_m - motion) / indentation.moved_std_m)[indentation.seen]
    depth = here.depth_m + indentation.load * (indentation.support_axes.tip_m @ of.support_motion)
    return Residuals((depth - measured) / depth_std(indentation, of, here), gap)


def _support_motion(indentation: DirectIndentation, of: Parameters) -> NDArray:
    """Motion of the samples that the object's settling adds, (k, c) [m]."""
    return indentation.load[:, None] * (indentation.support_axes.samples_m @ of.support_motion)
