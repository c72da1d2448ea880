"""The foam block: graded hexahedra for its mechanics, a fine surface for its pictures."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from virtual_lab.block_mesh import BlockMesh, block_mesh, graded_axis
from virtual_lab.model import Model
from virtual_lab.obstacle import Table

VERTICAL_GROWTH = 1.6
# A whole face stands on the table: with the sphere's stiffness its points come and go without end.
TABLE_PENALTY = 0.1
FINE_STEP_M = 0.0007
FINE_REACH_M = 0.014
# Triangles are flat: with 1.35 pictures show 1 % too much at 30 to 45 mm from the contact.
FINE_GROWTH = 1.15


def block_model(size_m: NDArray, point_m: NDArray, options: Mapping) -> Model:
    """Discretise a block that is pressed at a point of its top face.

    Where the point lies on the block's long mid-plane, half of the block is solved; of a press in
    the middle, if the options say that it is ``straight`` down, a quarter. The block is bonded to
    its support, or stands loose on the table where the options have ``table_friction``; then it is
    a quarter in any case, since little else keeps it from sliding. With ``glued`` the middle of its
    foot is bonded, of that part of its length and width, and the rest stands loose.

    Parameters
    ----------
    size_m : (3,) array
    point_m : (3,) array
        Object frame [m].
    options : mapping
        ``contact`` block of lab.yaml.

    Raises
    ------
    ValueError
        If the point is not on the top face or the depth exceeds the block's thickness.
    """
    size, point = np.asarray(size_m, dtype=float), np.asarray(point_m, dtype=float)
    _check(size, point, options["deepest_m"])
    glued = options.get("glued", 0.0 if "table_friction" in options else 1.0)
    loose = not glued
    planes = (0, 1) if loose or options.get("straight") else (1,)
    mirrors = tuple(axis for axis in planes if abs(point[axis]) < 1e-9)
    mesh = _mesh(size, point, options, mirrors)
    nodes = mesh.solid.nodes_m
    fixed = np.zeros(nodes.shape, dtype=bool)
    table = Table(options.get("table_friction", 0.0), penalty=TABLE_PENALTY)
    supports = (table,) if glued < 1 else ()
    held = (np.abs(nodes[:, :2]) <= glued * size[:2] / 2 + 1e-9).all(axis=1)
    fixed[(nodes[:, 2] < 1e-9) & held] = not loose
    for axis in mirrors:
        fixed[np.abs(nodes[:, axis]) < 1e-9, axis] = True
    rest, faces = fine_surface(size, point)
    axes = list(mesh.axes_m)
    for axis in mirrors:
        axes[axis] = np.concatenate([-axes[axis][:0:-1], axes[axis]])

    def sample(displacement_m: NDArray) -> NDArray:
        return _sample(axes, _grid_field(mesh, displacement_m, mirrors), rest)

    return Model(mesh.solid, fixed, supports, mirrors, rest, faces, sample)


def _check(size: NDArray, point: NDArray, deepest_m: float) -> None:
    inside = np.abs(point[:2]) < size[:2] / 2
    if not inside.all() or abs(point[2] - size[2]) > 1e-6:
        raise ValueError(f"point: expected on the block's top face, found {point.tolist()} m")
    if not 0 < deepest_m < size[2]:
        raise ValueError(f"deepest_m: expected 0 < depth < {size[2]} m, found {deepest_m}")


def _mesh(size: NDArray, point: NDArray, options: Mapping, mirrors: tuple) -> BlockMesh:
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
    """Coordinates with those where what is glued ends [m]."""
    ends = [end for end in (-reach_m, reach_m) if axis[0] < end < axis[-1]]
    return np.unique(np.round([*axis, *ends], 9))


def _grid_field(mesh: BlockMesh, displacement: NDArray, mirrors: tuple) -> NDArray:
    """Displacement on the tensor grid of nodes, mirrored where half was solved."""
    field = displacement[mesh.grid]
    for axis in mirrors:
        other = np.flip(field, axis) * np.where(np.arange(3) == axis, -1.0, 1.0)
        field = np.concatenate([np.delete(other, -1, axis), field], axis)
    return field


def _sample(axes: list[NDArray], field: NDArray, points: NDArray) -> NDArray:
    """Evaluate a quadratic tensor-product field at points, shape (n, 3)."""
    (i, u), (j, v), (k, w) = (_quadratic(axis, points[:, d]) for d, axis in enumerate(axes))
    result = np.zeros((len(points), 3))
    for a in range(3):
        for b in range(3):
            for c in range(3):
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
    low, high = np.array([-size[0] / 2, -size[1] / 2]), size[:2] / 2
    axes = [_fine_axis(low[d], high[d], point[d]) for d in range(2)]
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
    sides = [
        (index[:, :, -1], False),
        (index[:, :, 0], True),
        (index[-1], False),
        (index[0], True),
        (index[:, -1], True),
        (index[:, 0], False),
    ]
    faces = np.concatenate([_triangles(quad, flip) for quad, flip in sides])
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
