"""What an indentation of a given depth does to samples of the surface, whatever the law."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly
from scipy.spatial import cKDTree

from palpate.open3d_core import ClosestPoints
from palpate.solid.indentation_table import IndentationModel, ratio_weights
from palpate.solid.laws import LAW_NAMES, SLIDING

# Hertz: force to the power 2/3 is about linear in depth, which interpolates well.
FORCE_POWER = 2 / 3
# Of the largest force: below it the root's slope has no end.
LEAST_FORCE = 1e-6
# Of the search for the material point that comes to lie on a sample's normal.
ROUNDS = 3
# Of the search for a depth, from a chord's guess on; of the table's depth.
NEWTON_STEPS = 8
CONVERGED = 1e-13
# Neighbours that show how the surface bends, and normals too different to be of one face.
NEIGHBOURS, SAME_FACE = 8, np.cos(np.deg2rad(40))
# Of a broad base that is not bonded, between one that sticks, 0, and one that slides freely, 1:
# captures do not determine it better (its error of nu is a source of the uncertainty budget).
SLIDING_PART = 0.5
# By which a contact is moved to either side, to see what its place does [m].
ASIDE_M = 0.001


def axes_across(up: NDArray) -> NDArray:
    """Two axes across a unit vector (3,), (2, 3): it x object's x, and it x that."""
    first = np.cross(up, [1.0, 0, 0]) if abs(up[0]) < 0.9 else np.cross(up, [0, 1.0, 0])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(up, first)])


@dataclass(frozen=True)
class DepthOfForce:
    """Depths at which an object returns forces, (n,) [m], with their derivatives."""

    depth_m: NDArray
    by_unit_per_m: NDArray
    by_nu_m: NDArray
    by_law_m: NDArray


@dataclass(frozen=True)
class MotionAtDepth:
    """Motions of c samples at n depths, (n, c) [m], with their derivatives; by place (2, n, c)."""

    motion_m: NDArray
    by_depth: NDArray
    by_nu_m: NDArray
    by_law_m: NDArray
    by_place: NDArray


@dataclass(frozen=True)
class SampleTable:
    """Force and surface displacement over depth, Poisson's ratio and law, at E = 1.

    Laws lie on the line through neo-Hooke's (0) and Blatz and Ko's (1); force and displacement have
    parameters of their own, q and m: F = F_first exp(q * stiffening), w = w_first + m *
    motion_change. What a force moves a little way off depends on the force, not on the law at the
    contact (Saint-Venant): displacements are those at the depth that the first law has under it.

    Attributes
    ----------
    poisson_ratios : (p,) array
    depth_m : (k,) array
        From 0 [m].
    force_per_modulus_m2 : (p, k) array
        F / E under the first law.
    stiffening : (p, k) array
        Logarithm of the second law's force over the first's; 0 at no depth.
    motion_m, motion_change_m : (p, k, c) arrays
        Signed distance of the deformed from the undeformed surface along each sample's normal under
        the first law, and what the second adds under the same force [m].
    motion_by_place : (2, p, k, c) array
        What a contact farther along the two axes across adds to the displacement under the first
        law, for each metre.
    softer : (p, k) array, optional
        Logarithm of the force on a base that slides freely over that on one that sticks, where the
        base is not bonded and so broad that its friction matters.
    """

    poisson_ratios: NDArray
    depth_m: NDArray
    force_per_modulus_m2: NDArray
    stiffening: NDArray
    motion_m: NDArray
    motion_change_m: NDArray
    motion_by_place: NDArray
    softer: NDArray | None = None

    def depth(self, force_per_modulus_m2: NDArray, nu: float, law: float) -> DepthOfForce:
        """Depth at which the object returns a force; linear in F^(2/3) beyond the table.

        Of elastic forces over Young's modulus (n,) [m^2], above 0, Poisson's ratio, and q.
        """
        force = np.maximum(force_per_modulus_m2, LEAST_FORCE * self.force_per_modulus_m2.max())
        wanted, power = force**FORCE_POWER, self._power_at(nu, law)
        depth = np.interp(wanted, power(self.depth_m)[0], self.depth_m)
        for _ in range(NEWTON_STEPS):
            at, slope, *others = power(depth)
            before, depth = depth, np.maximum(depth + (wanted - at) / slope, 0.0)
            if np.abs(depth - before).max() <= CONVERGED * self.depth_m[-1]:
                break
        by_unit = FORCE_POWER * wanted / force / slope
        return DepthOfForce(depth, by_unit, *(-by / slope for by in others))

    def force(self, depth_m: NDArray, nu: float, law: float) -> NDArray:
        """Elastic force over Young's modulus at depths, (n,) [m^2]; zero before contact."""
        depth = np.clip(depth_m, 0, self.depth_m[-1])
        return np.maximum(self._power_at(nu, law)(depth)[0], 0) ** (1 / FORCE_POWER)

    def stiffening_at(self, depth_m: NDArray, nu: float) -> tuple[NDArray, NDArray]:
        """Logarithm of the second law's force over the first's, (n,), and its slope by nu."""
        log = self._curves(np.clip(depth_m, 0, self.depth_m[-1]))[..., 1]
        weights, slopes = ratio_weights(self.poisson_ratios, nu)
        return log @ weights, log @ slopes

    def motion(self, depth_m: NDArray, nu: float, law: float, place_m: NDArray) -> MotionAtDepth:
        """Displacement of each sample at depths; linear beyond the table.

        Of depths (n,) that the first law has under the forces [m], Poisson's ratio, m, and the
        contact's place (2,) along the axes across [m].
        """
        depth = np.clip(depth_m, 0, self.depth_m[-1])
        beyond = np.maximum(depth_m - depth, 0)[:, None]
        weights, slopes = ratio_weights(self.poisson_ratios, nu)
        whole = self.motion_m + law * self.motion_change_m
        whole = whole + np.tensordot(place_m, self.motion_by_place, axes=1)
        here, by_law = (np.tensordot(weights, of, axes=1) for of in (whole, self.motion_change_m))
        by_nu = np.tensordot(slopes, whole, axes=1)
        by_place = np.tensordot(self.motion_by_place, weights, axes=(1, 0))
        bent = (depth_m > 0)[:, None] * self._basis(depth, 1)
        basis = self._basis(depth) + beyond * bent
        columns = bent @ here, basis @ by_nu, basis @ by_law, basis @ by_place
        return MotionAtDepth(basis @ here, *columns)

    @cached_property
    def _basis(self) -> CubicSpline:
        """Splines that are 1 at one depth of the table and 0 at the others."""
        return CubicSpline(self.depth_m, np.eye(len(self.depth_m)))

    @cached_property
    def _curves(self) -> PchipInterpolator:
        """Power of the force and stiffening over depth, of each ratio, (p, 2)."""
        tables = self.force_per_modulus_m2**FORCE_POWER, self.stiffening
        return PchipInterpolator(self.depth_m, np.stack(tables).T)

    def _power_at(self, nu: float, law: float) -> Callable[[NDArray], tuple[NDArray, ...]]:
        """F^(2/3) at depths, (n,), and its derivatives by depth, nu and law; linear beyond."""
        weights, part = np.stack(ratio_weights(self.poisson_ratios, nu)), FORCE_POWER * law
        curves = PPoly.construct_fast(weights @ self._curves.c, self.depth_m)

        def power(depth_m: NDArray) -> tuple[NDArray, ...]:
            inside = np.minimum(depth_m, self.depth_m[-1])
            (unit, stiff), (unit_by_nu, stiff_by_nu) = np.moveaxis(curves(inside), 0, -1)
            bent, stiff_bent = curves(inside, 1)[:, 0].T
            grown = np.exp(part * stiff)
            at = grown * unit
            by_depth = grown * bent + part * stiff_bent * at
            by_nu = grown * unit_by_nu + part * stiff_by_nu * at
            return at + (depth_m - inside) * by_depth, by_depth, by_nu, FORCE_POWER * stiff * at

        return power


def sample_table(table: IndentationModel, cell_m: NDArray, normal: NDArray) -> SampleTable:
    """Take force, and displacement of samples, from an indentation table.

    A sample's displacement is where its normal meets the deformed surface: the material point that
    comes to lie there is sought on the undeformed one. Samples are places on the undeformed surface
    (c, 3), table's frame [m], with outward unit normals (c, 3).

    Raises
    ------
    ValueError
        If the indentation table does not hold both laws.
    """
    forces = force_table(table)
    surface = ClosestPoints(table.surface_rest_m, table.surface_faces)
    bend = shape_operators(cell_m, normal)

    def motion(law: int, aside_m: NDArray | float = 0.0) -> NDArray:
        fields, places = table.surface_displacement_m[law].astype(float), cell_m + aside_m
        return np.array(
            [[_motion(surface, field, places, normal, bend) for field in each] for each in fields]
        )

    first = motion(0)
    # A contact farther on is a sample farther back.
    aside = ASIDE_M * axes_across(table.direction)
    by_place = np.array([(motion(0, -step) - motion(0, step)) / (2 * ASIDE_M) for step in aside])
    slid = SLIDING_PART * (motion(len(LAW_NAMES)) - first) if forces.softer is not None else 0.0
    return replace(
        forces,
        motion_m=first + slid,
        motion_change_m=_under(forces, motion(1)) - first,
        motion_by_place=by_place,
    )


def _under(forces: SampleTable, motion_m: NDArray) -> NDArray:
    """Motions (p, k, c) of the second law at the forces that the first one's depths take."""
    found, end = np.empty_like(motion_m), forces.depth_m[-1]
    for k, nu in enumerate(forces.poisson_ratios):
        unit = forces.force_per_modulus_m2[k]
        # What finds a depth stops a little beside the touch, where there is no motion.
        depth = np.where(unit > 0, forces.depth(unit, nu, 1.0).depth_m, 0.0)
        curve = CubicSpline(forces.depth_m, motion_m[k])
        beyond = np.maximum(depth - end, 0.0)[:, None]
        found[k] = curve(np.minimum(depth, end)) + beyond * curve(end, 1)
    return found


def force_table(table: IndentationModel) -> SampleTable:
    """Take the force alone from an indentation table, for no samples.

    Raises
    ------
    ValueError
        If the indentation table does not hold both laws.
    """
    if table.laws not in (LAW_NAMES, (*LAW_NAMES, LAW_NAMES[0] + SLIDING)):
        expected, found = ", ".join(LAW_NAMES), ", ".join(table.laws)
        raise ValueError(f"table: expected the laws {expected}, found {found} (an older one?)")
    force, *others = np.asarray(table.force_per_modulus_m2, dtype=float)
    stiffening, softer = np.zeros((2, *force.shape))
    for log, other in zip((stiffening, softer), others, strict=False):
        log[:, 1:] = np.log(other[:, 1:] / force[:, 1:])
    force = force * np.exp(SLIDING_PART * softer)
    none, nowhere = np.empty((*force.shape, 0)), np.empty((2, *force.shape, 0))
    ratios, depth = (np.asarray(one, dtype=float) for one in (table.poisson_ratios, table.depth_m))
    loose = softer if table.slides else None
    return SampleTable(ratios, depth, force, stiffening, none, none, nowhere, loose)


def shape_operators(cell_m: NDArray, normal: NDArray) -> NDArray:
    """How the normal turns along the surface at each sample, (c, 3, 3) [1/m]; 0 where it is flat.

    Least squares over the nearest samples of the same face, symmetric and in the tangent plane.
    """
    count = min(NEIGHBOURS + 1, len(cell_m))
    _, near = cKDTree(cell_m).query(cell_m, k=count)
    step = cell_m[near] - cell_m[:, None]
    turn = normal[near] - normal[:, None]
    same = (normal[near] @ normal[:, :, None])[..., 0] > SAME_FACE
    tangent = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    step, turn = (np.einsum("cij,cnj->cni", tangent, x * same[..., None]) for x in (step, turn))
    gram = np.einsum("cni,cnj->cij", step, step)
    cross = np.einsum("cni,cnj->cij", turn, step)
    size = np.trace(gram, axis1=1, axis2=2)[:, None, None]
    bend = cross @ np.linalg.pinv(gram + 1e-300 * np.eye(3), rcond=1e-3, hermitian=True)
    return np.where(size > 0, (bend + bend.swapaxes(1, 2)) / 2, 0.0)


def _motion(
    surface: ClosestPoints, displacement: NDArray, cell_m: NDArray, normal: NDArray, bend: NDArray
) -> NDArray:
    slide = np.zeros_like(cell_m)
    for _ in range(ROUNDS):
        sag = np.einsum("ci,cij,cj->c", slide, bend, slide) / 2
        start = slide - sag[:, None] * normal
        _, triangle, weights = surface(cell_m + start)
        moved = surface.interpolate(displacement, triangle, weights)
        along = (moved * normal).sum(axis=1)
        slide = -(moved - along[:, None] * normal)
    return along - sag
