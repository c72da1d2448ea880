"""A sphere pressed into a linear solid: Hertz's pressure on ten-node elements."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palpate.solid.contact_pressure import contact_pressure, hertz_contact_radius
from palpate.solid.mesh import SolidMesh
from palpate.solid.moduli import lame_from_engineering, lame_ratio
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness

# Mean of d - r^2/(2 R) under Hertz's pressure, over d, where a^2 = R d.
MEAN_SINK = 4 / 5


def linear_indentations(
    mesh: SolidMesh,
    held: NDArray,
    point_m: NDArray,
    direction: NDArray,
    *,
    radius_m: float,
    depth_m: Sequence[float],
    poisson_ratios: Sequence[float],
) -> tuple[NDArray, NDArray]:
    """Force and displacement of presses of given depths at E = 1.

    The pressure has the contact radius sqrt(R d). Its work says how far the sphere sinks: a sphere
    of depth d asks for the displacement d - r^2/(2 R) under it, and the mean of that under the
    pressure is 4/5 d (a half-space then gives Hertz's force exactly).

    Parameters
    ----------
    mesh : SolidMesh
        Ten-node elements (four-node ones lock).
    held : (n,) bool array
        Nodes on the support.
    point_m, direction : (3,) arrays
        First touch [m] and unit vector of the press, into the object.
    radius_m : float
        Of the sphere.
    depth_m : sequence of k floats
        Above 0 [m].
    poisson_ratios : sequence of p floats

    Returns
    -------
    force_per_modulus_m2 : (p, k) array
        F / E.
    displacement_m : (p, k, n, 3) array
        Of all nodes [m].

    Raises
    ------
    ValueError
        If no triangle is in reach of the pressure, or all nodes or none are held.
    """
    if held.all() or not held.any():
        found = "all" if held.all() else "none"
        raise ValueError(f"held: expected some nodes on the support, found {found}")
    loads = [_unit_load(mesh, point_m, direction, radius_m, depth) for depth in depth_m]
    free = np.flatnonzero(np.repeat(~held, 3))
    K1, K2 = (K[free][:, free] for K in elastic_stiffness(mesh))
    right = np.column_stack([load.ravel()[free] for load in loads])
    solve, forces, fields = None, [], []
    for nu in poisson_ratios:
        K = combined(K1, K2, *_lame(nu))
        solve = solve.refactorise(K) if solve else factorise(K)
        answer = solve(right)
        force = MEAN_SINK * np.asarray(depth_m) / (right * answer).sum(axis=0)
        field = np.zeros((len(depth_m), mesh.nodes_m.size))
        field[:, free] = (force * answer).T
        forces.append(force)
        fields.append(field.reshape(len(depth_m), -1, 3))
    return np.array(forces), np.array(fields)


def _unit_load(mesh, point_m, direction, radius_m: float, depth_m: float) -> NDArray:
    a = hertz_contact_radius(indenter_radius_m=radius_m, depth_m=depth_m)
    return contact_pressure(mesh, point_m, direction, direction, contact_radius_m=a)


def _lame(nu: float) -> tuple[float, float]:
    """Lame parameters at E = 1."""
    _, mu = lame_from_engineering(1.0, nu)
    return lame_ratio(nu) * mu, mu
