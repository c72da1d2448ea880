"""Elastic stiffness of tetrahedra, split by the Lame parameters (Eq. 3.21-3.24)."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from palpate.solid.mesh import EDGES, SolidMesh, element_volumes

# Four points of equal weight, exact for polynomials of degree 2 (barycentric coordinates).
NEAR, FAR = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
QUADRATURE = {1: np.full((1, 4), 0.25), 2: np.full((4, 4), FAR) + (NEAR - FAR) * np.eye(4)}


def elastic_stiffness(mesh: SolidMesh) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Assemble K1 and K2 of K = lam K1 + mu K2 (Eq. 3.24).

    With C = lam C1 + mu C2 of Eq. 3.21 and G the integral of dN_i/dx_a dN_j/dx_b, the entry of
    nodes i, j and axes a, b is G[ia,jb] in K1 and delta_ab G[ic,jc] + G[ib,ja] in K2.

    Parameters
    ----------
    mesh : SolidMesh
        n nodes; m elements of either order.

    Returns
    -------
    K1, K2 : (3n, 3n) sparse matrices
        Degree of freedom 3 * node + axis; [m], to be multiplied by Pa. Both have the same entries.
    """
    points = QUADRATURE[mesh.order]
    gradients = shape_gradients(mesh, points)
    weight = point_volumes(mesh, points)
    elements, count, nodes, _ = gradients.shape
    flat = gradients.reshape(elements, count, 3 * nodes)
    G = np.matmul(flat.transpose(0, 2, 1), weight[:, :, None] * flat)
    G1 = G.reshape(elements, nodes, 3, nodes, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 3, 3)
    G2 = G1.transpose(0, 2, 1) + np.trace(G1, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    pattern = BlockPattern(mesh.tetrahedra, len(mesh.nodes_m))
    return pattern.matrix(pattern.sums(G1)), pattern.matrix(pattern.sums(G2))


def combined(
    K1: sparse.csr_matrix, K2: sparse.csr_matrix, lam: float, mu: float
) -> sparse.csr_matrix:
    """K = lam K1 + mu K2 (Eq. 3.24) for two matrices with the same entries; K has them too.

    Parameters
    ----------
    K1, K2 : sparse matrices
        As `elastic_stiffness` gives them, or the same rows and columns of them [m].
    lam, mu : float
        Lame parameters [Pa].

    Raises
    ------
    ValueError
        If the matrices have entries in different places.
    """
    pairs = ((K1.indptr, K2.indptr), (K1.indices, K2.indices))
    if K1.shape != K2.shape or not all(a is b or np.array_equal(a, b) for a, b in pairs):
        raise ValueError("K2: expected the shape and the places of K1's entries, found others")
    return sparse.csr_matrix(
        (lam * K1.data + mu * K2.data, K1.indices, K1.indptr), shape=K1.shape, copy=False
    )


def dofs(nodes: NDArray) -> NDArray:
    """Degrees of freedom of nodes, 3 * node + axis."""
    return (3 * nodes[:, None] + np.arange(3)).ravel()


def shape_gradients(mesh: SolidMesh, points: NDArray) -> NDArray:
    """Gradients of the shape functions at points of each element (Eq. 3.15).

    Parameters
    ----------
    mesh : SolidMesh
        m elements of k nodes.
    points : (p, 4) array
        Barycentric coordinates.

    Returns
    -------
    (m, p, k, 3) array
        [1/m].
    """
    if mesh.order == 1:
        corners = mesh.nodes_m[mesh.corners]
        inner = np.linalg.inv(corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
        linear = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        return np.repeat(linear[:, None], len(points), axis=1)
    return np.matmul(_sides_slopes(points), np.linalg.inv(_jacobians(mesh, points)))


def point_volumes(mesh: SolidMesh, points: NDArray) -> NDArray:
    """Volume that each of equal points of an element stands for, (m, p) [m^3].

    Parameters
    ----------
    mesh : SolidMesh
        m elements.
    points : (p, 4) array
        Barycentric coordinates.
    """
    if mesh.order == 1:
        whole = np.repeat(element_volumes(mesh.nodes_m, mesh.corners)[:, None], len(points), axis=1)
    else:
        whole = np.linalg.det(_jacobians(mesh, points)) / 6
    return whole / len(points)


def _jacobians(mesh: SolidMesh, points: NDArray) -> NDArray:
    """Derivatives of the place by the last three barycentric coordinates, (m, p, 3, 3) [m]."""
    places = mesh.nodes_m[mesh.tetrahedra].swapaxes(1, 2)
    return np.matmul(places[:, None], _sides_slopes(points))


def _sides_slopes(points: NDArray) -> NDArray:
    """Derivatives of the ten shape functions by the last three coordinates, (p, 10, 3)."""
    slopes = _slopes(points)
    return slopes[..., 1:] - slopes[..., :1]


def shape_values(points: NDArray, order: int) -> NDArray:
    """Shape functions of tetrahedra (p, 4) or triangles (p, 3) at barycentric points, (p, k)."""
    if order == 1:
        return points
    # A triangle's edges are the first three.
    first, second = EDGES[: 3 * (points.shape[1] - 2)].T
    middles = 4 * points[:, first] * points[:, second]
    return np.concatenate([points * (2 * points - 1), middles], axis=1)


def _slopes(points: NDArray) -> NDArray:
    """Derivatives of the ten shape functions by the barycentric coordinates, (p, 10, 4)."""
    slopes = np.zeros((len(points), 10, 4))
    slopes[:, np.arange(4), np.arange(4)] = 4 * points - 1
    for k, (i, j) in enumerate(EDGES, start=4):
        slopes[:, k, i], slopes[:, k, j] = 4 * points[:, j], 4 * points[:, i]
    return slopes


class BlockPattern:
    """Where the 3x3 blocks of all pairs of an element's nodes go in a block sparse row matrix.

    Parameters
    ----------
    tetrahedra : (m, k) int array
        Nodes of each element.
    size : int
        Number of nodes.
    """

    def __init__(self, tetrahedra: NDArray, size: int) -> None:
        pairs = (tetrahedra[:, :, None] * size + tetrahedra[:, None, :]).ravel()
        order = np.argsort(pairs, kind="stable")
        ranked = pairs[order]
        new = np.concatenate([[True], ranked[1:] != ranked[:-1]])
        self._size, self._keys = size, ranked[new]
        self._columns = self._keys % size
        counts = np.bincount(self._keys // size, minlength=size)
        self._starts = np.concatenate([[0], np.cumsum(counts)])
        bounds = np.append(np.flatnonzero(new), len(order))
        self._place = sparse.csr_matrix((np.ones(len(order)), order, bounds))

    def sums(self, blocks: NDArray) -> NDArray:
        """Blocks (b, 3, 3) of the whole: sums of the elements' own, pairs of nodes row by row."""
        return (self._place @ blocks.reshape(-1, 9)).reshape(-1, 3, 3)

    def block_of(self, rows: NDArray, columns: NDArray) -> NDArray:
        """Numbers of the blocks of pairs of nodes that share an element."""
        return np.searchsorted(self._keys, rows * self._size + columns)

    def matrix(self, blocks: NDArray) -> sparse.csr_matrix:
        """Sparse matrix (3n, 3n) of blocks (b, 3, 3)."""
        return sparse.bsr_matrix((blocks, self._columns, self._starts)).tocsr()

    def places(self) -> sparse.csr_matrix:
        """For each entry of `matrix`, its number among all the blocks' own."""
        return self.matrix(np.arange(9 * len(self._keys)).reshape(-1, 3, 3))
