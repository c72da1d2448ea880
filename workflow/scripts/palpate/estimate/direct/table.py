"""What an indentation of a given depth does to samples of the surface, by law."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial import cKDTree

from palpate.solid.indentation import IndentationModel, ratio_weights
from palpate.surface.distance import ClosestPoints

# Hertz: force to the power 2/3 is about linear in depth, which interpolates well.
FORCE_POWER = 2 / 3
# Of the largest force: below it the root's slope has no end.
LEAST_FORCE = 1e-6
# Of the search for the material point that comes to lie on a sample's normal.
ROUNDS = 3
# Neighbours that tell how the surface bends, and normals too different to be of one face.
NEIGHBOURS, SAME_FACE = 8, np.cos(np.deg2rad(40))


@dataclass(frozen=True)
class SampleTable:
    """Force and surface motion of one law over depth and Poisson's ratio, at E = 1.

    Attributes
    ----------
    law : str
    poisson_ratios : (p,) array
    depth_m : (k,) array
        From 0 [m].
    force_per_modulus_m2 : (p, k) array
        F / E.
    motion_m : (p, k, c) array
        Signed distance of the deformed from the undeformed surface, along each sample's normal [m].
    """

    law: str
    poisson_ratios: NDArray
    depth_m: NDArray
    force_per_modulus_m2: NDArray
    motion_m: NDArray

    def depth(self, force_per_modulus_m2: NDArray, nu: float) -> tuple[NDArray, NDArray]:
        """Depth at which the object returns a force, and its slope; linear in F^(2/3) beyond.

        Parameters
        ----------
        force_per_modulus_m2 : (n,) array
            Elastic force over Young's modulus, above 0.
        nu : float

        Returns
        -------
        depth_m, slope_per_m : (n,) arrays
            Depth [m] and its derivative by F / E [1/m].
        """
        straight = self._power(nu)
        force = np.maximum(force_per_modulus_m2, LEAST_FORCE * self.force_per_modulus_m2.max())
        wanted = force**FORCE_POWER
        curve = PchipInterpolator(straight, self.depth_m)
        inside = np.minimum(wanted, straight[-1])
        by_power = curve.derivative()(inside)
        depth = curve(inside) + (wanted - inside) * by_power
        return depth, by_power * FORCE_POWER * wanted / force

    def force(self, depth_m: NDArray, nu: float) -> NDArray:
        """Elastic force over Young's modulus at depths, (n,) [m^2]; zero before contact."""
        curve = PchipInterpolator(self.depth_m, self._power(nu))
        depth = np.clip(depth_m, 0, self.depth_m[-1])
        return np.maximum(curve(depth), 0) ** (1 / FORCE_POWER)

    def motion(self, depth_m: NDArray, nu: float) -> tuple[NDArray, NDArray]:
        """Motion of each sample at depths (n, c) [m], and its derivative by the depth (n, c).

        Cubic splines over depth; the deepest's motion beyond the table.
        """
        depth = np.clip(depth_m, 0, self.depth_m[-1])
        table = np.tensordot(ratio_weights(self.poisson_ratios, nu), self.motion_m, axes=1)
        inside = (depth_m < self.depth_m[-1])[:, None]
        return self._basis(depth) @ table, inside * (self._basis(depth, 1) @ table)

    @cached_property
    def _basis(self) -> CubicSpline:
        """Splines that are 1 at one depth of the table and 0 at the others."""
        return CubicSpline(self.depth_m, np.eye(len(self.depth_m)))

    def _power(self, nu: float) -> NDArray:
        return ratio_weights(self.poisson_ratios, nu) @ self.force_per_modulus_m2**FORCE_POWER


def sample_table(
    indentation_table: IndentationModel, law: str, cell_m: NDArray, normal: NDArray
) -> SampleTable:
    """Take one law's force, and the motion of samples, from an indentation table.

    A sample's motion is where its normal meets the deformed surface. The material point that comes
    to lie there is sought on the undeformed surface, which bends as the samples' normals turn.

    Parameters
    ----------
    indentation_table : IndentationModel
    law : str
    cell_m, normal : (c, 3) arrays
        Places on the undeformed surface, object frame [m], and outward unit normals.

    Raises
    ------
    ValueError
        If the indentation table does not hold the law.
    """
    if law not in indentation_table.laws:
        raise ValueError(f"law: expected one of {', '.join(indentation_table.laws)}, found {law}")
    number = indentation_table.laws.index(law)
    surface = ClosestPoints(indentation_table.surface_rest_m, indentation_table.surface_faces)
    bend = shape_operators(cell_m, normal)
    fields = indentation_table.surface_displacement_m[number]
    motion = [
        [_motion(surface, field.astype(float), cell_m, normal, bend) for field in steps]
        for steps in fields
    ]
    return SampleTable(
        law,
        np.asarray(indentation_table.poisson_ratios, dtype=float),
        np.asarray(indentation_table.depth_m, dtype=float),
        np.asarray(indentation_table.force_per_modulus_m2[number], dtype=float),
        np.array(motion),
    )


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
