"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import EllipsisType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from palpate.estimate.direct.options import Fit
from palpate.estimate.direct.table import DepthOfForce, MotionAtDepth, SampleTable, axes_across
from palpate.estimate.relaxation import elastic_force, elastic_force_derivatives
from palpate.solid.support import Support

# Unknowns that all captures share, before what relaxes, and their places.
SHARED = 5
LOG_E, NU, FORCE_LAW, MOTION_LAW, GAIN = range(SHARED)
# Axes across the indentation. Sinking, and rocking about two axes.
PLACES, SUPPORT_MOTIONS = 2, 3
# Unknowns that each capture has for itself, and their places among these.
OWN = 4 + PLACES + SUPPORT_MOTIONS
OFFSET, CLOCK, SHIFT, CAMERA_CLOCK = 0, 1, 2, OWN - 1
PLACE, SUPPORT = slice(3, 3 + PLACES), slice(3 + PLACES, CAMERA_CLOCK)


@dataclass(frozen=True)
class SupportAxes:
    """Rigid motions of an unbonded object on its base when it bears the greatest force.

    The shape of a base that nobody saw, and how much of it sticks, move the whole of a ball by a
    hundredth of a millimetre or two; a tenth of Poisson's ratio moves it by three.

    Attributes
    ----------
    samples_m, tip_m : (c, 3), (3,) arrays
        Of the samples along their normals, and of the contact along the indentation, for a unit of
        each motion: 1 m, and 1 rad twice.
    std : (3,) array
        Deviations of the motions about 0 [m, rad, rad]; 0 where the object is bonded.
    """

    samples_m: NDArray
    tip_m: NDArray
    std: NDArray

    @staticmethod
    def of(
        cell_m: NDArray,
        normal: NDArray,
        *,
        support: Support,
        contact_m: NDArray,
        direction: NDArray,
        options: Fit,
    ) -> "SupportAxes":
        """Rigid motions about the base under the middle of a contact (3,) [m].

        Of samples (c, 3) in the object frame [m] with unit normals (c, 3) outward, and the unit
        vector (3,) of the indentation.
        """
        up, moves = support.up, float(support.resting)
        base = contact_m - ((contact_m - support.plane_point_m) @ up) * up
        std = moves * np.array([options.sinking_std_m, *[options.rocking_std_rad] * 2])

        def along(place: NDArray, way: NDArray) -> NDArray:
            turns = [(np.cross(a, place - base) * way).sum(axis=-1) for a in axes_across(up)]
            return np.stack([-way @ up, *turns], axis=-1)

        return SupportAxes(along(cell_m, normal), along(contact_m, direction), std)


@dataclass(frozen=True)
class DirectIndentation:
    """What one capture gives to the direct estimate.

    Attributes
    ----------
    time_s, force_n : (f,) arrays
        Times of all frames, and of poses between them where these come from elsewhere than the
        pictures [s], and force along the indentation [N].
    tip_depth_m : (f,) array
        Way of the sphere since its first touch in all of them, negative before [m].
    frames : (k,) int array
        Those of all these that are in contact and compared.
    frames_beyond : int
        Frames that are not, as they are deeper than the indentation table.
    oblique_rad : float
        Between the tip's way in them and the indentation.
    depth_m : (k,) array
        Way of the sphere as it is compared [m].
    tip_std_m, force_std_n : float
        Deviations from frame to frame of the tip along the indentation [m], and of the force [N].
    depth_root_m : (k, k) array
        Lower triangular root of the depths' covariance that the fit divides by [m].
    offset_std_m : float
        Of an error that all depths share, beside the tip's [m].
    clock_expected_s, clock_std_s : float
        What the forces' clock offset is too large by if the clocks agree, and the deviation of
        the force's clock from the camera's [s].
    camera_clock_std_s : float, optional
        Of the poses' clock against the camera's [s]; 0 where they come from its pictures.
    place_expected_m : (2,) array
        Contact from where the table has it, along the axes across the indentation [m].
    place_std_m : float
        Of that, beside the tip's [m].
    contact_m, cell_m : (3,), (c, 3) arrays
        Middle of the contact, and samples of the undeformed surface outside, object frame [m].
    moved_m, noise_std_m, moved_std_m : (k, c) arrays
        Displacement along the normals in the compared frames, deviation of a frame's own noise, and
        that which the fit divides by [m]; NaN: not seen, or between the camera's frames.
    cluster : (c,) int array
        Part of the surface; errors of different ones are independent.
    support_axes : SupportAxes
    table : SampleTable
        Of the indented point, brought to the contact, at the samples.
    shared_roots_m : mapping of str to (3, e) array, optional
        Of errors that captures share, by source: what each of a deviation moves the tip by, along
        the indentation and the axes across it [m].
    pictured : (g,) int array, optional
        Which of all frames the camera took.
    """

    time_s: NDArray
    force_n: NDArray
    tip_depth_m: NDArray
    frames: NDArray
    frames_beyond: int
    oblique_rad: float
    depth_m: NDArray
    tip_std_m: float
    depth_root_m: NDArray
    offset_std_m: float
    clock_expected_s: float
    clock_std_s: float
    force_std_n: float
    place_expected_m: NDArray
    place_std_m: float
    contact_m: NDArray
    cell_m: NDArray
    moved_m: NDArray
    noise_std_m: NDArray
    moved_std_m: NDArray
    cluster: NDArray
    support_axes: SupportAxes
    table: SampleTable
    camera_clock_std_s: float = 0.0
    shared_roots_m: Mapping[str, NDArray] = field(default_factory=dict)
    pictured: NDArray | EllipsisType = ...

    @property
    def zero_std_m(self) -> float:
        """Deviation of the depth's zero: of an error of its own, and of the shared ones [m]."""
        return zero_std(self.offset_std_m, self.shared_roots_m)

    @property
    def depth_std_m(self) -> NDArray:
        """Deviations of the depths, (k,) [m]."""
        return np.linalg.norm(self.depth_root_m, axis=1)

    @cached_property
    def tip_speed_m_s(self) -> NDArray:
        """Speed of the sphere in all frames, by its way from picture to picture, (f,) [m/s]."""
        time_s, depth_m = self.time_s[self.pictured], self.tip_depth_m[self.pictured]
        return np.interp(self.time_s, time_s, np.gradient(depth_m, time_s))

    @property
    def speed_m_s(self) -> NDArray:
        """The same in the compared frames, (k,) [m/s]."""
        return self.tip_speed_m_s[self.frames]

    @property
    def frames_pictured(self) -> tuple[NDArray, NDArray, NDArray]:
        """Where the camera's frames are; which compared rows are of them, and which frames."""
        at = np.arange(len(self.time_s))[self.pictured]
        rows = np.flatnonzero(np.isin(self.frames, at))
        return at, rows, np.searchsorted(at, self.frames[rows])

    @cached_property
    def load(self) -> NDArray:
        """Force in the compared frames as part of the greatest in them, (k,)."""
        force = self.force_n[self.frames]
        return force / force.max()

    @cached_property
    def seen(self) -> NDArray:
        """Which displacements count, (k, c) bool."""
        return np.isfinite(self.moved_m) & np.isfinite(self.moved_std_m)


def zero_std(offset_std_m: float, shared_roots_m: Mapping[str, NDArray]) -> float:
    """Deviation of a depth's zero, of errors of its own and of roots (3, e) of shared ones [m]."""
    shared = [np.linalg.norm(root[0]) for root in shared_roots_m.values()]
    return float(np.hypot.reduce([offset_std_m, *shared]))


def _one(place: int, doc: str) -> property:
    """An unknown by its place in a vector."""
    return property(lambda self: float(self.vector[place]), doc=doc)


def _own(places: slice, doc: str) -> property:
    """Unknowns by their places among those that each capture has for itself."""
    return property(lambda self: self.vector[-OWN:][places], doc=doc)


@dataclass(frozen=True)
class Parameters:
    """Unknowns of one capture.

    Attributes
    ----------
    vector : (q,) array
        (log E, nu, q, m, gain, fractions; offset, clock, shift, place, support, camera's clock).
    times_s : (p,) array
        Times of what relaxes, which are no unknowns [s].
    """

    vector: NDArray
    times_s: NDArray

    poisson_ratio = _one(NU, "Poisson's ratio.")
    force_law = _one(FORCE_LAW, "Material-law parameter of the force, q (`SampleTable`).")
    motion_law = _one(MOTION_LAW, "That of the displacement, m.")
    gain = _one(GAIN, "Relative error of the camera's distances along the normals.")
    offset_m = _one(OFFSET - OWN, "Error of the depth [m].")
    clock_s = _one(CLOCK - OWN, "Error of the force's clock against the poses' [s].")
    camera_clock_s = _one(CAMERA_CLOCK - OWN, "Poses' clock minus camera clock [s].")
    shift_m = _one(SHIFT - OWN, "What all displacements have in common [m].")
    place_m = _own(PLACE, "Contact beside where it was seen, along the axes across, (2,) [m].")
    support_motion = _own(SUPPORT, "Of the object under the greatest force (`SupportAxes`), (3,).")

    @property
    def youngs_modulus_pa(self) -> float:
        """Instantaneous modulus [Pa]."""
        return float(np.exp(self.vector[LOG_E]))

    @property
    def fractions(self) -> NDArray:
        """Relaxation amplitudes (Prony series), (p,)."""
        return self.vector[SHARED:-OWN]


@dataclass(frozen=True)
class Residuals:
    """Residuals of depths (k,) and displacements (number seen,), of deviation 1 each."""

    depth: NDArray
    motion: NDArray


@dataclass(frozen=True)
class Linearised(Residuals):
    """The same with their derivatives by a capture's parameters (k, q), (number seen, q)."""

    depth_slope: NDArray
    motion_slope: NDArray


class _Predicted(NamedTuple):
    """Elastic force over E (k,) [m^2], and what it makes of depths (by q; by the first law)."""

    unit_m2: NDArray
    depth: DepthOfForce
    first_depth: DepthOfForce
    motion: MotionAtDepth


def _predicted(indentation: DirectIndentation, of: Parameters) -> _Predicted:
    """Elastic force by the measured force's history; over E it gives depth and displacement."""
    time_s, force_n, nu = indentation.time_s, indentation.force_n, of.poisson_ratio
    elastic = elastic_force(time_s, force_n, fractions=of.fractions, times_s=of.times_s)
    unit, table = elastic[indentation.frames] / of.youngs_modulus_pa, indentation.table
    first = table.depth(unit, nu, 0.0)
    # The camera saw the surface a little earlier or later than the force was read.
    seen_at = first.depth_m - (of.clock_s - of.camera_clock_s) * indentation.speed_m_s
    motion = table.motion(seen_at, nu, of.motion_law, of.place_m)
    return _Predicted(unit, table.depth(unit, nu, of.force_law), first, motion)


def residuals(
    indentation: DirectIndentation, of: Parameters, here: _Predicted | None = None
) -> Residuals:
    """Compare a capture with what its measured force makes of the object.

    ``here`` is what was predicted at ``of``, where it is there already.
    """
    here = _predicted(indentation, of) if here is None else here
    measured = indentation.depth_m + of.offset_m + of.clock_s * indentation.speed_m_s
    motion = here.motion.motion_m + _support_motion(indentation, of)
    motion = (1 + of.gain) * motion + of.shift_m
    gap = ((indentation.moved_m - motion) / indentation.moved_std_m)[indentation.seen]
    settled = indentation.load * (indentation.support_axes.tip_m @ of.support_motion)
    depth = here.depth.depth_m + settled - measured
    return Residuals(solve_triangular(indentation.depth_root_m, depth, lower=True), gap)


def linearised(indentation: DirectIndentation, of: Parameters) -> Linearised:
    """Residuals and their derivatives, in the order of `Parameters.vector`."""
    here, axes = _predicted(indentation, of), indentation.support_axes
    record, speed_m_s = (indentation.time_s, indentation.force_n), indentation.speed_m_s
    relaxing = {"fractions": of.fractions, "times_s": of.times_s}
    by_fraction = elastic_force_derivatives(*record, **relaxing)[indentation.frames]

    def by_force(deeper: DepthOfForce) -> list[NDArray]:
        """Slopes of a depth that the force gives, by log E, nu, q and each fraction."""
        own = [-deeper.by_unit_per_m * here.unit_m2, deeper.by_nu_m, deeper.by_law_m]
        shares = deeper.by_unit_per_m[:, None] * by_fraction / of.youngs_modulus_pa
        return [*own, *shares.T]

    by_E, by_nu, by_q, *by_fractions = by_force(here.depth)
    zero, one = np.zeros(len(indentation.frames)), np.ones(len(indentation.frames))
    # Those of the measured depth's offset, clock and shift; the support's motion is added.
    own = [-one, -speed_m_s, *[zero] * (1 + PLACES)]
    settled = indentation.load[:, None] * axes.tip_m
    depth = np.column_stack([by_E, by_nu, by_q, zero, zero, *by_fractions, *own, settled, zero])
    motion, seen = here.motion, indentation.seen
    frame, sample = np.nonzero(seen)
    scale = -1 / indentation.moved_std_m[seen]
    gain = (1 + of.gain) * scale
    deeper = gain * motion.by_depth[seen]
    follows = [deeper * column[frame] for column in by_force(here.first_depth)]
    whole = motion.motion_m + _support_motion(indentation, of)
    sideways = gain * motion.by_place[:, seen]
    tilted = gain * indentation.load[frame] * axes.samples_m.T[:, sample]
    late, none = deeper * speed_m_s[frame], np.zeros(len(frame))
    by_nu, by_law = gain * motion.by_nu_m[seen], gain * motion.by_law_m[seen]
    columns = [follows[0], follows[1] + by_nu, none, by_law, scale * whole[seen], *follows[3:]]
    columns += [none, -late, scale, *sideways, *tilted, late]
    by_depth = solve_triangular(indentation.depth_root_m, depth, lower=True)
    gaps = residuals(indentation, of, here)
    return Linearised(gaps.depth, gaps.motion, by_depth, np.stack(columns).T)


def depth_by_force(indentation: DirectIndentation, of: Parameters) -> tuple[NDArray, NDArray]:
    """Depths that the force gives, and how far tip and force let them scatter, (k,) [m]."""
    depth = _predicted(indentation, of).depth
    of_force = indentation.force_std_n / of.youngs_modulus_pa * depth.by_unit_per_m
    return depth.depth_m, np.hypot(indentation.tip_std_m, of_force)


def _support_motion(indentation: DirectIndentation, of: Parameters) -> NDArray:
    """Displacement of the samples that the support's motion adds, (k, c) [m]."""
    return indentation.load[:, None] * (indentation.support_axes.samples_m @ of.support_motion)
