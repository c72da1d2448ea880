"""The foam block: graded hexahedra, a fine surface for pictures; the study's simulated block."""

from collections.abc import Mapping
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementHex2, ElementTetP1, ElementVector, MeshHex, MeshTet, condense, solve
from skfem.models.elasticity import linear_elasticity

from virtual_lab.obstacle import Table
from virtual_lab.solid import Model, SolidMesh, solid_mesh

# Polynomial orders that are integrated exactly.
QUADRATURE = {"volume_order": 4, "facet_order": 10}
VERTICAL_GROWTH = 1.6
Grid = tuple[tuple[NDArray, ...], NDArray, SolidMesh]
# A whole face stands on the table: with the sphere's stiffness its points come and go without end.
TABLE_PENALTY = 0.1
FINE_STEP_M, FINE_REACH_M = 0.0007, 0.014
# Triangles are flat: with 1.35 pictures show 1 % too much at 30 to 45 mm from the contact.
FINE_GROWTH = 1.15
ON_PLANE_M = 1e-9


def block_model(size_m: NDArray, point_m: NDArray, options: Mapping) -> Model:
    """Discretise a block that is indented at a point of its top face.

    Where the point lies on the block's long mid-plane, half of the block is solved; of an
    indentation in the middle, if the options say that it is ``straight`` down, a quarter. The block
    is bonded to its support, or unbonded where the options have ``table_friction``; then it is a
    quarter in any case, since little else keeps it from sliding. With ``glued`` the middle of its
    base is bonded, of that part of its length and width, and the remainder is not.

    Parameters
    ----------
    size_m : (3,) array
    point_m : (3,) array
        Object frame [m].
    options : mapping
        ``contact`` block of lab.yaml.
    """
    size, point = np.asarray(size_m, dtype=float), np.asarray(point_m, dtype=float)
    bonded = options.get("glued", 0.0 if "table_friction" in options else 1.0)
    planes = (0, 1) if not bonded or options.get("straight") else (1,)
    mirrors = tuple(axis for axis in planes if abs(point[axis]) < 1e-9)
    axes, grid, solid = _mesh(size, point, options, mirrors)
    axes, nodes = list(axes), solid.nodes_m
    table = Table(options.get("table_friction", 0.0), penalty=TABLE_PENALTY)
    inner = (np.abs(nodes[:, :2]) <= bonded * size[:2] / 2 + 1e-9).all(axis=1)
    fixed = np.zeros(nodes.shape, dtype=bool)
    fixed[(nodes[:, 2] < 1e-9) & inner] = bool(bonded)
    for axis in mirrors:
        fixed[np.abs(nodes[:, axis]) < 1e-9, axis] = True
        axes[axis] = np.concatenate([-axes[axis][:0:-1], axes[axis]])
    surface = fine_surface(size, point)

    def sample(displacement_m: NDArray) -> NDArray:
        return _sample(axes, _mirrored(displacement_m[grid], mirrors), surface[0])

    return Model(solid, fixed, (table,) if bonded < 1 else (), mirrors, *surface, sample)


def _mesh(size: NDArray, point: NDArray, options: Mapping, mirrors: tuple) -> Grid:
    smallest, growth = options["element_m"], options["growth"]
    x, y = (
        graded_axis(0.0 if k in mirrors else -size[k] / 2, size[k] / 2, point[k], smallest, growth)
        for k in range(2)
    )
    if options.get("glued", 1.0) < 1:
        x, y = (_with_ends(axis, options["glued"] * size[k] / 2) for k, axis in enumerate((x, y)))
    z = graded_axis(0.0, size[2], size[2], smallest, VERTICAL_GROWTH)
    return block_mesh(x, y, z, reach_m=options["reach_m"], centre_m=point[:2])


def _with_ends(axis: NDArray, reach_m: float) -> NDArray:
    """Coordinates with those where what is bonded ends [m]."""
    ends = [end for end in (-reach_m, reach_m) if axis[0] < end < axis[-1]]
    return np.unique(np.round([*axis, *ends], 9))


def block_mesh(x: NDArray, y: NDArray, z: NDArray, *, reach_m: float, centre_m: NDArray) -> Grid:
    """Mesh a block of quadratic hexahedra from its vertex coordinates along each axis.

    Parameters
    ----------
    x, y, z : arrays
        Increasing vertex coordinates [m]; z from the support up.
    reach_m : float
        Facets of the top within this distance of the centre can be touched [m].
    centre_m : (2,) array
        x and y of the contact [m].

    Returns
    -------
    axes_m : tuple of three arrays
        Node coordinates along x, y and z, vertices and midpoints in turn [m].
    grid : (nx, ny, nz) int array
        Number of the node at each place of their tensor grid.
    solid : SolidMesh
        With the patches ``top`` and ``bottom``.
    """
    mesh = MeshHex.init_tensor(x, y, z)

    def near(x: NDArray) -> NDArray:
        distance = np.hypot(x[0] - centre_m[0], x[1] - centre_m[1])
        return (np.abs(x[2] - z[-1]) < 1e-9) & (distance < reach_m)

    facets = {
        "top": mesh.facets_satisfying(near, boundaries_only=True),
        "bottom": mesh.facets_satisfying(lambda x: x[2] < 1e-9, boundaries_only=True),
    }
    solid = solid_mesh(mesh, ElementHex2(), facets, **QUADRATURE)
    places = np.round(solid.nodes_m, 12)
    axes = tuple(np.unique(places[:, k]) for k in range(3))
    grid = np.empty([len(axis) for axis in axes], dtype=int)
    index = (np.searchsorted(axis, places[:, k]) for k, axis in enumerate(axes))
    grid[tuple(index)] = np.arange(len(places))
    return axes, grid, solid


def graded_axis(
    start: float, stop: float, centre: float, smallest: float, growth: float
) -> NDArray:
    """Vertex coordinates from start to stop, finest at the centre, growing geometrically [m]."""
    below = centre - _graded(centre - start, smallest, growth)
    above = centre + _graded(stop - centre, smallest, growth)
    return np.concatenate([below[:0:-1], above])


def _graded(length: float, smallest: float, growth: float) -> NDArray:
    """Distances 0 ... length in steps that start near the smallest and grow."""
    if length <= 0:
        return np.zeros(1)
    steps = max(1, int(np.ceil(np.log1p(length * (growth - 1) / smallest) / np.log(growth))))
    distances = np.concatenate([[0.0], np.cumsum(growth ** np.arange(steps))])
    return distances * (length / distances[-1])


def _mirrored(field: NDArray, mirrors: tuple) -> NDArray:
    """Displacement on the tensor grid of nodes, mirrored where half was solved."""
    for axis in mirrors:
        other = np.flip(field, axis) * np.where(np.arange(3) == axis, -1.0, 1.0)
        field = np.concatenate([np.delete(other, -1, axis), field], axis)
    return field


def _sample(axes: list[NDArray], field: NDArray, points: NDArray) -> NDArray:
    """Evaluate a quadratic tensor-product field at points, shape (n, 3)."""
    (i, u), (j, v), (k, w) = (_quadratic(axis, points[:, d]) for d, axis in enumerate(axes))
    result = np.zeros((len(points), 3))
    for a, b, c in np.ndindex(3, 3, 3):
        shape = u[:, a] * v[:, b] * w[:, c]
        result += shape[:, None] * field[i + a, j + b, k + c]
    return result


def _quadratic(axis: NDArray, x: NDArray) -> tuple[NDArray, NDArray]:
    """First node of each coordinate's element and its three shape functions."""
    element = np.clip(np.searchsorted(axis[::2], x, side="right") - 1, 0, len(axis) // 2 - 1)
    start, stop = axis[2 * element], axis[2 * element + 2]
    s = np.clip((x - start) / (stop - start), 0, 1)
    return 2 * element, np.stack([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)], axis=1)


def fine_surface(size: NDArray, point: NDArray) -> tuple[NDArray, NDArray]:
    """Closed surface of a block on z = 0, fine around a point of the top; see `box_surface`."""
    axes = [_fine_axis(-size[d] / 2, size[d] / 2, point[d]) for d in range(2)]
    return box_surface([*axes, np.linspace(0.0, size[2], 11)])


def box_surface(axes: list[NDArray]) -> tuple[NDArray, NDArray]:
    """Closed surface of a box from its vertex coordinates along x, y and z [m].

    Returns
    -------
    vertices : (n, 3) array
        Object frame [m].
    faces : (m, 3) int array
        Triangles, outward.
    """
    shape = [len(axis) for axis in axes]
    index = np.arange(np.prod(shape)).reshape(shape)
    sides = index[:, :, -1], index[:, :, 0], index[-1], index[0], index[:, -1], index[:, 0]
    inward = False, True, False, True, True, False
    faces = np.concatenate(list(map(_triangles, sides, inward)))
    used, faces = np.unique(faces, return_inverse=True)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[used], faces.reshape(-1, 3)


def _fine_axis(start: float, stop: float, centre: float) -> NDArray:
    left, right = max(start, centre - FINE_REACH_M), min(stop, centre + FINE_REACH_M)
    fine = np.linspace(left, right, round((right - left) / FINE_STEP_M) + 1)
    below = graded_axis(start, left, left, FINE_STEP_M * 2, FINE_GROWTH)
    above = graded_axis(right, stop, right, FINE_STEP_M * 2, FINE_GROWTH)
    return np.unique(np.concatenate([below, fine, above]).round(12))


def _triangles(quad: NDArray, flip: bool) -> NDArray:
    a, b, c, d = quad[:-1, :-1], quad[1:, :-1], quad[1:, 1:], quad[:-1, 1:]
    triangles = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    return triangles[:, ::-1] if flip else triangles


def load_block(
    mesh_file: str | Path, *, lambda_pa: float, mu_pa: float, traction_pa: float, steps: int
) -> dict[str, NDArray]:
    """Solve the simulated block of Section 3.3.2: a traction on a triangle of its top, in steps.

    The triangle is the one nearest to the middle of the top face; its load is shared evenly by
    its three nodes, as linear elements have it.

    Parameters
    ----------
    mesh_file : path
        Linear tetrahedra of a block that stands on z = 0.
    lambda_pa, mu_pa : float
        Lame parameters.
    traction_pa : float
        Traction along the top's outward normal at the last step.
    steps : int

    Returns
    -------
    dict
        ``nodes_m`` (n, 3), ``tetrahedra`` (m, 4), ``triangle`` (3,), ``force_n`` (k, n, 3) nodal
        loads, ``displacement_m`` (k, n, 3).
    """
    data = meshio.read(mesh_file)
    nodes, tetrahedra = np.asarray(data.points, dtype=float), data.cells_dict["tetra"]
    mesh = MeshTet(np.ascontiguousarray(nodes.T), np.ascontiguousarray(tetrahedra.T))
    basis = Basis(mesh, ElementVector(ElementTetP1()), intorder=0)
    K = linear_elasticity(lambda_pa, mu_pa).assemble(basis)
    top = mesh.facets_satisfying(lambda x: np.abs(x[2] - mesh.p[2].max()) < ON_PLANE_M)
    middles = mesh.p[:2][:, mesh.facets[:, top]].mean(axis=1)
    triangle = mesh.facets[:, top[np.argmin(np.linalg.norm(middles, axis=0))]]
    a, b, c = nodes[triangle]
    area = np.linalg.norm(np.cross(b - a, c - a)) / 2
    f = np.zeros_like(nodes)
    f[triangle, 2] = traction_pa * area / 3
    fixed = basis.get_dofs(mesh.facets_satisfying(lambda x: np.abs(x[2]) < ON_PLANE_M)).all()
    u = solve(*condense(K, f.ravel(), D=fixed)).reshape(-1, 3)
    share = (np.arange(steps) + 1)[:, None, None] / steps
    return {
        "nodes_m": nodes,
        "tetrahedra": tetrahedra,
        "triangle": triangle,
        "force_n": share * f,
        "displacement_m": share * u,
    }
