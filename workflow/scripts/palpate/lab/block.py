"""The foam block pressed at a point: a ladder of depths that all its recordings share."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from palpate.lab.block_mesh import BlockMesh, block_mesh, graded_axis
from palpate.lab.contact import ContactStep, SphereContact
from palpate.lab.material import LAWS

VERTICAL_GROWTH = 1.6
FINE_STEP_M = 0.0007
FINE_REACH_M = 0.014
FINE_GROWTH = 1.35
# Hertz: force to the power 2/3 is about linear in depth, which interpolates well.
FORCE_POWER = 2 / 3


@dataclass(frozen=True)
class ContactLadder:
    """Force and surface of an object over a ladder of indentation depths.

    Attributes
    ----------
    point_m : (3,) array
        Point pressed, object frame [m].
    depth_m : (k,) array
        Depths, from 0 [m].
    force_n : (k,) array
        Force along the outward normal that the object returns [N].
    surface_rest_m : (n, 3) array
        Closed undeformed surface, object frame [m].
    surface_faces : (m, 3) int array
        Its triangles, outward.
    surface_displacement_m : (k, n, 3) array
        Its displacement at each depth [m].
    """

    point_m: NDArray
    depth_m: NDArray
    force_n: NDArray
    surface_rest_m: NDArray
    surface_faces: NDArray
    surface_displacement_m: NDArray

    def force_at(self, depth_m: NDArray) -> NDArray:
        """Elastic force at depths [N]; zero before contact."""
        curve = PchipInterpolator(self.depth_m, self.force_n**FORCE_POWER)
        return np.maximum(curve(self._within(depth_m)), 0) ** (1 / FORCE_POWER)

    def surface_at(self, depth_m: NDArray) -> NDArray:
        """Deformed surface at depths, shape (len(depth_m), n, 3) [m]."""
        curve = PchipInterpolator(self.depth_m, self.surface_displacement_m, axis=0)
        return self.surface_rest_m + curve(self._within(depth_m))

    def _within(self, depth_m: NDArray) -> NDArray:
        depth = np.maximum(np.asarray(depth_m, dtype=float), 0)
        if depth.max() > self.depth_m[-1]:
            found = f"{depth.max():.4f}"
            raise ValueError(f"depth: expected at most {self.depth_m[-1]:.4f} m, found {found} m")
        return depth


def press_block(spec: Mapping, point_m: NDArray, radius_m: float) -> ContactLadder:
    """Press a rigid sphere into a block bonded to its support.

    Where the point lies on the block's long mid-plane, half of the block is solved.

    Parameters
    ----------
    spec : mapping
        The object's block of lab.yaml: ``size_m``, ``material``, ``contact``.
    point_m : (3,) array
        Point of the top face, object frame [m].
    radius_m : float
        Radius of the sphere [m].

    Returns
    -------
    ContactLadder

    Raises
    ------
    ValueError
        If the point is not on the top face or the depth exceeds the block's thickness.
    """
    size, point_m = np.array(spec["size_m"]), np.asarray(point_m, dtype=float)
    _check(size, point_m, spec["contact"]["deepest_m"])
    half = abs(point_m[1]) < 1e-9
    mesh = _mesh(size, point_m, spec["contact"], half)
    fixed = np.zeros(mesh.nodes_m.shape, dtype=bool)
    fixed[mesh.nodes_m[:, 2] < 1e-9] = True
    if half:
        fixed[np.abs(mesh.nodes_m[:, 1]) < 1e-9, 1] = True
    material = spec["material"]
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    problem = SphereContact(
        mesh,
        LAWS[material["law"]](E, nu),
        point_m=point_m,
        radius_m=radius_m,
        stiffness_pa=E,
        fixed=fixed,
    )
    step, deepest = spec["contact"]["step_m"], spec["contact"]["deepest_m"]
    steps = problem.press(np.linspace(0, deepest, int(np.ceil(deepest / step)) + 1)[1:])
    return _ladder(mesh, steps, size, point_m, half)


def save_ladder(path: str | Path, ladder: ContactLadder) -> None:
    """Write a ladder as NPZ."""
    with Path(path).open("wb") as stream:
        np.savez_compressed(stream, **vars(ladder))


def load_ladder(path: str | Path) -> ContactLadder:
    """Read a ladder that `save_ladder` wrote."""
    with np.load(path, allow_pickle=False) as data:
        return ContactLadder(**{name: data[name] for name in data.files})


def _check(size: NDArray, point: NDArray, deepest_m: float) -> None:
    inside = np.abs(point[:2]) < size[:2] / 2
    if not inside.all() or abs(point[2] - size[2]) > 1e-6:
        raise ValueError(f"point: expected on the block's top face, found {point.tolist()} m")
    if not 0 < deepest_m < size[2]:
        raise ValueError(f"deepest_m: expected 0 < depth < {size[2]} m, found {deepest_m}")


def _mesh(size: NDArray, point: NDArray, options: Mapping, half: bool) -> BlockMesh:
    smallest, growth = options["element_m"], options["growth"]
    x = graded_axis(-size[0] / 2, size[0] / 2, point[0], smallest, growth)
    y = graded_axis(0.0 if half else -size[1] / 2, size[1] / 2, point[1], smallest, growth)
    z = graded_axis(0.0, size[2], size[2], smallest, VERTICAL_GROWTH)
    return block_mesh(x, y, z, reach_m=options["reach_m"], centre_m=point[:2])


def _ladder(
    mesh: BlockMesh, steps: list[ContactStep], size: NDArray, point: NDArray, half: bool
) -> ContactLadder:
    rest, faces = fine_surface(size, point)
    fields = [_grid_field(mesh, step.displacement_m, half) for step in steps]
    axes = list(mesh.axes_m)
    if half:
        axes[1] = np.concatenate([-axes[1][:0:-1], axes[1]])
    displacement = np.stack([np.zeros_like(rest), *(_sample(axes, f, rest) for f in fields)])
    share = 2.0 if half else 1.0
    return ContactLadder(
        point_m=point,
        depth_m=np.array([0.0, *(step.depth_m for step in steps)]),
        force_n=np.array([0.0, *(-share * step.force_n[2] for step in steps)]),
        surface_rest_m=rest,
        surface_faces=faces,
        surface_displacement_m=displacement,
    )


def _grid_field(mesh: BlockMesh, displacement: NDArray, half: bool) -> NDArray:
    """Displacement on the tensor grid of nodes, mirrored where half was solved."""
    field = displacement[mesh.grid]
    if not half:
        return field
    mirrored = field[:, :0:-1] * [1.0, -1.0, 1.0]
    return np.concatenate([mirrored, field], axis=1)


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
