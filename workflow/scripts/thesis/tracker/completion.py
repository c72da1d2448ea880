"""Places of unobserved vertices by linear elasticity between two frames (Algorithm 3).

The study uses it to regularise: moduli are found anew in each frame and mean nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints
from palpate.solid.load import contact_triangle, nodal_force
from palpate.solid.mesh import SolidMesh, element_volumes
from palpate.solid.solve import factorise
from palpate.solid.stiffness import combined, elastic_stiffness
from palpate.solid.support import support_nodes
from palpate.surface.pose import to_camera
from palpate.surface.tracked import Recorded
from scipy import sparse
from scipy.interpolate import RBFInterpolator
from scipy.optimize import lsq_linear

# l of Algorithm 3 at most, and the relative change of the support's forces that ends it.
ITERATIONS = 20
SETTLED = 1e-3
# lam <= 99 mu keeps nu at 0.495 or less; moduli of gels and rubber bound mu [Pa].
LARGEST_RATIO = 99.0
SHEAR_MODULUS_PA = (1e2, 1e8)
UNIT_PA = 1e5
# A node is known where data hold at least so much of its triangle.
HELD_PART = 0.5


@dataclass(frozen=True)
class Known:
    """What Algorithm 3 starts from.

    Attributes
    ----------
    displacement_m : (n, 3) array
        Of all nodes: observed, interpolated or to be replaced [m].
    observed : (n,) bool array
        Nodes whose displacement is reliable, the support's among them.
    force_n : (n, 3) array
        Nodal forces [N]; of the support any value.
    support : (k,) int array
        Nodes of unknown force.
    interior : (n,) bool array
    """

    displacement_m: NDArray
    observed: NDArray
    force_n: NDArray
    support: NDArray
    interior: NDArray


def complete(
    K1: sparse.csr_matrix, K2: sparse.csr_matrix, known: Known
) -> tuple[NDArray, float, float]:
    """Find the displacement of nodes that were not observed.

    Parameters
    ----------
    K1, K2 : (3n, 3n) sparse matrices
        Of K = lam K1 + mu K2 (Eq. 3.24) [m].
    known : Known

    Returns
    -------
    displacement_m : (n, 3) array
        Of all nodes [m].
    lam_pa, mu_pa : float
    """
    u, force = known.displacement_m, known.force_n.copy()
    products = [(K @ u.ravel()).reshape(-1, 3) for K in (K1, K2)]
    rows = known.observed | known.interior
    rows[known.support] = False
    force[known.support] = 0.0
    for _ in range(ITERATIONS):
        lam, mu = _moduli(products, force, rows)
        before = force[known.support].copy()
        force[known.support] = (lam * products[0] + mu * products[1])[known.support]
        rows[known.support] = True
        change = np.linalg.norm(force[known.support] - before)
        if change <= SETTLED * np.linalg.norm(force[known.support]):
            break
    K = combined(K1, K2, lam, mu)
    return _solved(K, u, force, ~known.observed), lam, mu


class Completion:
    """Algorithm 3 for the frames of one capture, in turn.

    Parameters
    ----------
    recorded : Recorded
    rest_m, faces : (n, 3), (m, 3) arrays
        Undeformed template, camera frame [m].
    """

    def __init__(self, recorded: Recorded, rest_m: NDArray, faces: NDArray) -> None:
        mesh, pose = recorded.solid, recorded.alignment.camera_from_object
        contact, radius = recorded.alignment.contact_point_m, recorded.indenter_radius_m
        self.support = support_nodes(mesh, recorded.support)
        self.mesh = SolidMesh(to_camera(pose, mesh.nodes_m), mesh.tetrahedra)
        self.surface, nodes = mesh.surface_nodes(), self.mesh.nodes_m
        self.interior = np.ones(len(nodes), dtype=bool)
        self.interior[self.surface] = False
        # The spline is linear in what it interpolates: one for all frames.
        identity = np.eye(len(self.surface))
        spline = RBFInterpolator(nodes[self.surface], identity, kernel="thin_plate_spline")
        self.spline = spline(nodes[self.interior]) if self.interior.any() else identity[:0]
        self.template = ClosestPoints(rest_m, faces)
        self.to_nodes = self.template(nodes[self.surface])[1:]
        self.solid = ClosestPoints(nodes, mesh.surface_triangles())
        self.to_vertices = self.solid(rest_m)[1:]
        reach = {"largest_distance_m": 2 * radius}
        self.triangle = contact_triangle(self.mesh, to_camera(pose, contact), **reach)
        # The force changes from frame to frame with the shape.
        steps = np.diff(recorded.forces_n, axis=0, prepend=np.zeros((1, 3)))
        self.radius_m, self.forces_n = radius, iter(steps)

    def __call__(self, before_m: NDArray, vertices_m: NDArray, held: NDArray) -> NDArray:
        """Places TP of the template's vertices in the next frame.

        Parameters
        ----------
        before_m, vertices_m : (n, 3) arrays
            Vertices of the frame before and of this one as tracked [m].
        held : (n,) bool array
            Vertices that data hold.
        """
        K1, K2 = elastic_stiffness(self.mesh)
        moved_m, *_ = complete(K1, K2, self._known(vertices_m - before_m, held))
        moved = SolidMesh(self.mesh.nodes_m + moved_m, self.mesh.tetrahedra)
        # Noise may turn an element inside out; the shape before then serves once more.
        if (element_volumes(moved.nodes_m, moved.corners) > 0).all():
            self.mesh = moved
        return before_m + self.solid.interpolate(moved_m, *self.to_vertices)

    def _known(self, moved_m: NDArray, held: NDArray) -> Known:
        nodes = np.zeros_like(self.mesh.nodes_m)
        nodes[self.surface] = self.template.interpolate(moved_m, *self.to_nodes)
        nodes[self.support] = 0.0
        nodes[self.interior] = self.spline @ nodes[self.surface]
        observed = np.zeros(len(nodes), dtype=bool)
        part = self.template.interpolate(held[:, None].astype(float), *self.to_nodes)
        observed[self.surface] = part[:, 0] >= HELD_PART
        observed[self.support] = True
        force = nodal_force(
            self.mesh,
            self.triangle,
            next(self.forces_n),
            rule="conserve",
            turn_to_normal=True,
            indenter_radius_m=self.radius_m,
            depth_m=self.radius_m,
        )
        return Known(nodes, observed, force, self.support, self.interior)


def _moduli(products: list[NDArray], force: NDArray, rows: NDArray) -> tuple[float, float]:
    """Lame parameters that minimise Eq. 4.27 over some nodes, within bounds."""
    first, second = (product[rows].ravel() * UNIT_PA for product in products)
    # mu = m + lam / 99 with m and lam in a box.
    A = np.column_stack([first + second / LARGEST_RATIO, second])
    low, high = (value / UNIT_PA for value in SHEAR_MODULUS_PA)
    bounds = ([0.0, low], [LARGEST_RATIO * high, high])
    lam, part = UNIT_PA * lsq_linear(A, force[rows].ravel(), bounds=bounds, method="bvls").x
    return float(lam), float(part + lam / LARGEST_RATIO)


def _solved(K: sparse.csr_matrix, u: NDArray, force: NDArray, free: NDArray) -> NDArray:
    """Displacement of free nodes from their forces and the others' displacement."""
    if not free.any():
        return u
    unknown = np.repeat(free, 3)
    rows = K[unknown]
    right = force.ravel()[unknown] - rows[:, ~unknown] @ u.ravel()[~unknown]
    result = u.ravel().copy()
    result[unknown] = factorise(rows[:, unknown])(right)
    return result.reshape(-1, 3)
