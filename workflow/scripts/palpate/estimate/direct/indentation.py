"""One capture in the direct estimate: what it measured, and what moduli and nuisances predict."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from palpate.estimate.direct.support_motion import MOTIONS, SupportAxes
from palpate.estimate.direct.table import DepthOfForce, MotionAtDepth, SampleTable
from palpate.estimate.minimise.scatter import error_clusters
from palpate.estimate.relaxation import elastic_force, elastic_force_derivatives

# Unknowns that all captures share, before what relaxes: log E, nu, q, m, gain.
SHARED = 5
# Unknowns that each capture has for itself: offset, clock, shift, the contact's place, where the
# picture shows it beside that, and how the object settles.
PLACES = 2
# Motions along the normals, along the picture's columns and along its rows; the first, and the two
# others, have errors of one kind.
AXES, KINDS = 3, 2
OWN = 2 + AXES + 2 * PLACES + MOTIONS


@dataclass(frozen=True)
class DirectIndentation:
    """What one capture gives to the direct estimate.

    Attributes
    ----------
    time_s, force_n, sideways_n : (f,) arrays
        Times of all frames [s], force along the press in them, and across it [N].
    tip_depth_m : (f,) array
        Way of the sphere since its first touch in all frames, negative before [m].
    frames : (k,) int array
        Frames in contact that are compared.
    frames_beyond : int
        Frames that are not, as they are deeper than the indentation table.
    oblique_rad : float
        Between the tip's way in them and the press.
    depth_m, speed_m_s : (k,) arrays
        That way in them as it is compared [m], and its speed [m/s].
    tip_std_m : float
        Standard deviation of the tip along the press from frame to frame [m].
    pattern_std_m : float
        Least deviation of what of a depth's error hangs on where the probe is [m].
    depth_root_m : (k, k) array
        Lower triangular root of the depths' covariance that the fit divides by [m].
    offset_std_m : float
        Of an error that all depths share, beside the tip's [m].
    clock_expected_s, clock_std_s : float
        What the forces' clock offset is too large by if the clocks agree, and the deviation of the
        clocks' difference [s]. How far they differ is found with the moduli: what the press told
        of it before rests on a simpler contact, and the same record would count twice.
    force_std_n : float
        Of the force from frame to frame [N].
    shift_std_m : float
        Of what the camera is off by in common while the object is pressed [m].
    place_expected_m : (2,) array
        Contact from where the table has it, along the axes across the press [m].
    place_std_m : float
        Of that, beside the tip's [m].
    picture_std_m : float
        Of how far what the picture shows is beside what depth does [m].
    contact_m : (3,) array
        Middle of the contact, object frame [m].
    cell_m, way : (c, 3) arrays
        Samples of the undeformed surface outside of the contact, object frame [m], and the
        directions that their motion is seen along.
    axis : (c,) int array
        Of `MotionAlong`: 0 along the normal; 1, 2 of the material, across the line of sight.
    moved_m, noise_std_m : (k, c) arrays
        Motion in the compared frames and the deviation of a frame's own noise [m]; NaN: not seen.
    moved_std_m : (k, c) array
        Deviation that the fit divides by [m].
    patch_m : float
        Least size of the parts of the surface whose errors are independent [m].
    cluster : (c,) int array
        Part of the surface that a sample belongs to, and kind of its motion; errors of different
        ones are independent.
    support_axes : SupportAxes
    table : SampleTable
        Of the pressed point, brought to the contact, at the samples.
    turned_m_s2 : (f,) array or float, optional
        What a kilogram more on the force sensor adds to its force, by the probe's turn [m/s^2].
    tip_root_m : (3, 3) array, optional
        Root of the covariance of the tip's place in the target's frame, which captures share [m].
    tip_axes : (3, 3) array, optional
        The press, and the axes across it, in that frame: an error of the tip along them is one of
        the depth and of the contact's place.
    across : (2, 3) array, optional
        The axes across, object frame.
    """

    time_s: NDArray
    force_n: NDArray
    sideways_n: NDArray
    tip_depth_m: NDArray
    frames: NDArray
    frames_beyond: int
    oblique_rad: float
    depth_m: NDArray
    speed_m_s: NDArray
    tip_std_m: float
    pattern_std_m: float
    depth_root_m: NDArray
    offset_std_m: float
    clock_expected_s: float
    clock_std_s: float
    force_std_n: float
    shift_std_m: float
    place_expected_m: NDArray
    place_std_m: float
    picture_std_m: float
    contact_m: NDArray
    cell_m: NDArray
    way: NDArray
    axis: NDArray
    moved_m: NDArray
    noise_std_m: NDArray
    moved_std_m: NDArray
    patch_m: float
    cluster: NDArray
    support_axes: SupportAxes
    table: SampleTable
    turned_m_s2: NDArray | float = 0.0
    tip_root_m: NDArray = field(default_factory=lambda: np.zeros((3, 3)))
    tip_axes: NDArray = field(default_factory=lambda: np.eye(3))
    across: NDArray = field(default_factory=lambda: np.eye(2, 3))

    @property
    def zero_std_m(self) -> float:
        """Deviation of the depth's zero: of an error of its own, and of the tip's [m]."""
        return float(
            np.hypot(self.offset_std_m, np.linalg.norm(self.tip_axes[0] @ self.tip_root_m))
        )

    @property
    def depth_std_m(self) -> NDArray:
        """Deviations of the depths, (k,) [m]."""
        return np.linalg.norm(self.depth_root_m, axis=1)

    @cached_property
    def load(self) -> NDArray:
        """Force in the compared frames as part of the greatest in them, (k,)."""
        force = self.force_n[self.frames]
        return force / force.max()

    @cached_property
    def seen(self) -> NDArray:
        """Which motions count, (k, c) bool."""
        return np.isfinite(self.moved_m) & np.isfinite(self.moved_std_m)

    @cached_property
    def kind(self) -> NDArray:
        """Of those that count, whether they are across, (number seen,): 0 or 1."""
        return np.broadcast_to(np.minimum(self.axis, 1), self.seen.shape)[self.seen]


@dataclass(frozen=True)
class Parameters:
    """Unknowns of one capture.

    Attributes
    ----------
    youngs_modulus_pa, poisson_ratio : float
        Instantaneous modulus [Pa].
    force_law, motion_law : float
        Places of force and motion among the laws, q and m (`SampleTable`).
    gain : float
        Relative error of the camera's distances along the normals.
    fractions : (p,) array
        Shares of the modulus that relax.
    offset_m, clock_s : float
        Errors of the depth [m] and of the clock [s].
    shift_m : (3,) array
        What all motions along an axis have in common [m].
    place_m, picture_m : (2,) arrays
        How far the contact is beside where it was seen, along the axes across the press, and how
        much farther beside it is in the picture [m].
    support_motion : (3,) array
        Motions of the object on its support under the greatest force (`SupportAxes`) [m, rad, rad].
    """

    youngs_modulus_pa: float
    poisson_ratio: float
    force_law: float
    motion_law: float
    gain: float
    fractions: NDArray
    offset_m: float
    clock_s: float
    shift_m: NDArray
    place_m: NDArray
    picture_m: NDArray
    support_motion: NDArray

    @property
    def vector(self) -> NDArray:
        """(log E, nu, q, m, gain, fractions, offset, clock, shift, places, settled)."""
        laws = [self.force_law, self.motion_law]
        shared = [np.log(self.youngs_modulus_pa), self.poisson_ratio, *laws, self.gain]
        own = [self.offset_m, self.clock_s, *self.shift_m]
        places = [*self.place_m, *self.picture_m]
        return np.array([*shared, *self.fractions, *own, *places, *self.support_motion])

    @staticmethod
    def of(vector: NDArray) -> "Parameters":
        """Read a vector as `vector` writes it."""
        E, others = float(np.exp(vector[0])), map(float, vector[1:SHARED])
        fractions, own = vector[SHARED:-OWN], map(float, vector[-OWN : 2 - OWN])
        ends = AXES + PLACES * np.arange(3)
        return Parameters(E, *others, fractions, *own, *np.split(vector[2 - OWN :], ends))


def patches_of(cell_m: NDArray, axis: NDArray, sizes_m: Sequence[float]) -> NDArray:
    """Parts of the surface whose errors are independent, by kind of motion, (c,) int.

    Parameters
    ----------
    cell_m : (c, 3) array
        Samples [m].
    axis : (c,) int array
    sizes_m : (2,) sequence
        Of the parts of each kind [m].
    """
    found, count = np.zeros(len(axis), dtype=int), 0
    for kind, size in enumerate(sizes_m):
        of = np.minimum(axis, 1) == kind
        if of.any():
            found[of] = count + error_clusters(cell_m[of], size_m=size)
            count = found[of].max() + 1
    return found


@dataclass(frozen=True)
class Residuals:
    """Depth residuals (k,) and motion residuals (number seen,), of deviation 1, each by itself."""

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
    """What parameters make of a capture's force.

    Attributes
    ----------
    unit_m2 : (k,) array
        Elastic force over E [m^2].
    depth, first_depth : DepthOfForce
        When it was measured, and what the first law has in its place.
    motion : MotionAtDepth
        When the camera saw it, without gain and shift.
    """

    unit_m2: NDArray
    depth: DepthOfForce
    first_depth: DepthOfForce
    motion: MotionAtDepth


def predicted(indentation: DirectIndentation, of: Parameters, *, times_s: NDArray) -> Predicted:
    """Depth and motion that a capture's measured force makes of the object.

    The force's history gives the elastic force, and that over E the depth and the motion of the
    surface: the force, with few parts in a thousand of error, is what is least in doubt.

    Parameters
    ----------
    indentation : DirectIndentation
    of : Parameters
    times_s : (p,) array
        Relaxation times [s].
    """
    nu, table = of.poisson_ratio, indentation.table
    elastic = elastic_force(
        indentation.time_s, indentation.force_n, fractions=of.fractions, times_s=times_s
    )
    unit = elastic[indentation.frames] / of.youngs_modulus_pa
    depth = table.depth(unit, nu, of.force_law)
    first = table.depth(unit, nu, 0.0)
    # The camera saw the surface a little earlier or later than the force was read.
    seen_at = first.depth_m - of.clock_s * indentation.speed_m_s
    places = np.append(of.place_m, of.picture_m)
    motion = table.motion(seen_at, nu, of.motion_law, places)
    return Predicted(unit, depth, first, motion)


def residuals(indentation: DirectIndentation, of: Parameters, *, times_s: NDArray) -> Residuals:
    """Compare a capture with what its measured force makes of the object."""
    return _residuals(indentation, of, predicted(indentation, of, times_s=times_s))


def linearised(indentation: DirectIndentation, of: Parameters, *, times_s: NDArray) -> Linearised:
    """Residuals and their derivatives, in the order of `Parameters.vector`."""
    here = predicted(indentation, of, times_s=times_s)
    by_fraction = elastic_force_derivatives(
        indentation.time_s, indentation.force_n, fractions=of.fractions, times_s=times_s
    )[indentation.frames]
    motion = here.motion

    def by_force(deeper: DepthOfForce) -> list[NDArray]:
        """Slopes of a depth that the force gives, by log E, nu, q and each fraction."""
        own = [-deeper.by_unit_per_m * here.unit_m2, deeper.by_nu_m, deeper.by_law_m]
        shares = deeper.by_unit_per_m[:, None] * by_fraction / of.youngs_modulus_pa
        return [*own, *shares.T]

    by_E, by_nu, by_q, *by_fractions = by_force(here.depth)
    zero, one = np.zeros(len(indentation.frames)), np.ones(len(indentation.frames))
    # Those of the measured depth's offset, clock and shift; what settles is added.
    own = [-one, -indentation.speed_m_s, *[zero] * (AXES + 2 * PLACES)]
    settled = indentation.load[:, None] * indentation.support_axes.tip_m
    depth = np.column_stack([by_E, by_nu, by_q, zero, zero, *by_fractions, *own, settled])
    gain, none = 1 + of.gain, np.zeros_like(motion.motion_m)
    follows = [gain * motion.by_depth * column[:, None] for column in by_force(here.first_depth)]
    columns = [
        follows[0],
        follows[1] + gain * motion.by_nu_m,
        none,
        gain * motion.by_law_m,
        motion.motion_m + _support_motion(indentation, of),
        *follows[3:],
        none,
        -gain * motion.by_depth * indentation.speed_m_s[:, None],
        *(none + (indentation.axis == axis) for axis in range(AXES)),
        *gain * motion.by_place,
        *(
            gain * indentation.load[:, None] * column
            for column in indentation.support_axes.samples_m.T
        ),
    ]
    divided = [(-column / indentation.moved_std_m)[indentation.seen] for column in columns]
    return Linearised(
        _residuals(indentation, of, here),
        solve_triangular(indentation.depth_root_m, depth, lower=True),
        np.stack(divided, axis=1),
    )


def depth_noise(indentation: DirectIndentation, of: Parameters, *, times_s: NDArray) -> NDArray:
    """Deviations of the depths from frame to frame, (k,) [m]: of the tip, and of the force."""
    softness = predicted(indentation, of, times_s=times_s).depth.by_unit_per_m
    of_force = indentation.force_std_n / of.youngs_modulus_pa * softness
    return np.hypot(indentation.tip_std_m, of_force)


def _residuals(indentation: DirectIndentation, of: Parameters, here: Predicted) -> Residuals:
    measured = indentation.depth_m + of.offset_m + of.clock_s * indentation.speed_m_s
    motion = here.motion.motion_m + _support_motion(indentation, of)
    motion = (1 + of.gain) * motion + np.asarray(of.shift_m)[indentation.axis]
    gap = ((indentation.moved_m - motion) / indentation.moved_std_m)[indentation.seen]
    settled = indentation.load * (indentation.support_axes.tip_m @ of.support_motion)
    depth = here.depth.depth_m + settled
    return Residuals(solve_triangular(indentation.depth_root_m, depth - measured, lower=True), gap)


def _support_motion(indentation: DirectIndentation, of: Parameters) -> NDArray:
    """Motion of the samples that the object's settling adds, (k, c) [m]."""
    return indentation.load[:, None] * (indentation.support_axes.samples_m @ of.support_motion)
