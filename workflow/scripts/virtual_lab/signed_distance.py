"""Signed distances [m] to forms that are neither block nor ball: closed meshes, a silicone ear.

The ear, a right one, lies on its flat back, the lobe at low x, the face at low y, the table z = 0.
Its body is a plate with the ear's outline. Grooves are cut out of it and ridges are put on it, all
with rounded joints.
"""

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree

Distance = Callable[[NDArray], NDArray]
STEP_M = 1e-5

EAR_BOX_M = (0.094, 0.062, 0.038)

MM = 1e-3
LINE_STEP_M = 0.0005
# The drawing below is moved and stretched by these to fill the box exactly.
DRAWN_CENTRE_M = (-0.000181, -0.000243)
DRAWN_SIZE_M = (0.094972, 0.062517, 0.037927)

# Outline of the body, x and y [mm].
OUTLINE_MM = [
    (43.5, 3), (41.5, -8), (34, -18.5), (24, -25), (10, -29.5), (-5, -31), (-18, -27.5),
    (-28.5, -18.5), (-37, -13), (-44, -8), (-47, 0.5), (-44.5, 8.5), (-38, 13.5), (-29, 17),
    (-15, 22), (-2, 26), (11, 27.5), (24, 26), (35, 20), (41.5, 12),
]  # fmt: skip
# Ridges and grooves: x, y and z of a middle line and the radius about it [mm].
HELIX_MM = [
    (4, -11, 17, 3.6), (12, -16.5, 21, 4.0), (23, -18.5, 24, 4.4), (33, -14, 27, 4.7),
    (40.5, -4, 29.5, 4.9), (42, 8, 31.5, 5.0),
    (36, 18.5, 32.7, 5.0),
    (25, 24.5, 33, 4.9), (11, 26.3, 32.3, 4.7), (-3, 24.8, 29, 4.4), (-14, 21.5, 23.5, 4.1),
    (-23, 17.6, 17.5, 3.9), (-30, 14, 12.2, 3.5), (-37, 10.5, 8.8, 3), (-43, 4.5, 4.5, 2.5),
]  # fmt: skip
CRUS_MM = [(8, -14, 18, 3.6), (3, -10, 16, 3.6), (-2, -3, 12, 3.3), (-6, 4, 8, 3)]
ANTIHELIX_MM = [
    (-23, 7.5, 14.5, 4), (-16.5, 11.3, 20, 4.6), (-9, 14.2, 24, 5.2), (2, 15, 25.7, 5.6),
    (12, 12.5, 25.5, 5.8), (21, 8, 25.5, 5.4), (29, 2.5, 24, 5), (36, -4.5, 20.5, 4.5),
]  # fmt: skip
LOWER_CRUS_MM = [(9, 12, 25, 5), (15, 4, 23.5, 4.4), (18, -5, 21, 4), (19, -14, 19, 3.5)]
SCAPHA_MM = [(16, 20.5, 22.5, 3), (5, 21, 25, 3.2), (-5, 19.8, 24, 3.2), (-14, 17, 20.5, 3.2)]
CHEEK_MM = [(22, -19, 16, 5.5), (10, -20.5, 14.5, 6), (-3, -21.5, 12, 6), (-11, -20.5, 10, 5)]
TRAGUS_MM = [(1, -18, 16, 4.5), (-5, -14.6, 19.6, 4.8), (-9.5, -14.8, 18.8, 4.5), (-14, -19, 13, 4)]
ANTITRAGUS_MM = [(-19, -6, 13.5, 4), (-19.5, -0.5, 18, 4.2), (-18, 6, 18.2, 4), (-15, 11, 16.5, 4)]
FOSSA_MM = [(20, 3, 27, 2), (25, -4, 26, 4), (28, -9, 27, 4.5)]
CONCHA_MM = [(-10, 0, 20.5, 9.5), (-3, 0, 20.5, 10.5), (5, 0.5, 22, 8.5)]
CYMBA_MM = [(5, 0, 22.5, 7.5), (9.5, -4.5, 23.5, 6.5)]
CANAL_MM = [(-5, -1, 18, 8), (-6, -7.5, 15.5, 5)]
NOTCH_MM = [(-10, -3, 19, 8), (-15, -7, 19.5, 5.5), (-20, -10.5, 20, 3.8), (-25, -13, 21.5, 2.5)]


class ClosedMesh:
    """Signed distance to a closed mesh, negative inside.

    Parameters
    ----------
    path : path
        PLY or OBJ file, object frame [m].

    Raises
    ------
    ValueError
        If the mesh is open, or does not reach from above the table (z = 0) to below it: where the
        table cuts it, it is flat and bonded.
    """

    def __init__(self, path: str | Path) -> None:
        # Only here: Snakemake's own process looks at points of other forms.
        import trimesh
        from palpate.open3d_core import o3d

        mesh, self.tensor = trimesh.load_mesh(path), o3d.core.Tensor
        if not mesh.is_watertight:
            raise ValueError(f"{path}: mesh: expected a closed surface, found an open one")
        self.low_m, self.high_m = mesh.bounds
        if not self.low_m[2] < 0 < self.high_m[2]:
            found = f"{self.low_m[2]:g} to {self.high_m[2]:g}"
            raise ValueError(f"{path}: mesh: expected z from below 0 m to above it, found {found}")
        # Single precision: coordinates are taken from the middle to lose nothing.
        self.middle_m = mesh.bounds.mean(axis=0)
        self.scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        self.scene.add_triangles(
            self.tensor((mesh.vertices - self.middle_m).astype(np.float32)),
            self.tensor(mesh.faces.astype(np.uint32)),
        )

    def __call__(self, points_m: NDArray) -> NDArray:
        """Signed distances of points (n, 3), shape (n,) [m]."""
        query = self.tensor((np.asarray(points_m) - self.middle_m).astype(np.float32))
        return self.scene.compute_signed_distance(query, nthreads=1).numpy().astype(float)


def distance_of(shape: Mapping) -> Distance:
    """Signed distance of a ``shape`` block of lab.yaml of kind ear or mesh."""
    return ear_distance if shape["kind"] == "ear" else ClosedMesh(shape["file"])


def slope(points_m: NDArray, distance: Distance) -> NDArray:
    """Gradient of a signed distance by central differences, shape (n, 3)."""
    offsets = STEP_M * np.eye(3)
    sides = [distance(points_m + o) - distance(points_m - o) for o in offsets]
    return np.stack(sides, axis=1) / (2 * STEP_M)


def ear_distance(points_m: NDArray) -> NDArray:
    """Approximate signed distance (n,) [m] of points (n, 3) [m] to the ear, negative inside.

    Object frame; the ear stands on its table.
    """
    points = np.asarray(points_m, dtype=float)
    return np.maximum(uncut_ear_distance(points), -points[:, 2])


def uncut_ear_distance(points_m: NDArray) -> NDArray:
    """As `ear_distance`, of an ear that goes on below the table.

    Meshers that cut the solid at z = 0 themselves get an exact edge from it.
    """
    stretch = np.array(DRAWN_SIZE_M) / EAR_BOX_M
    points = np.asarray(points_m, dtype=float) * stretch + [*DRAWN_CENTRE_M, 0]
    distance = _body(points)
    for groove, joint_m in _grooves():
        distance = _smooth_max(distance, -groove(points), joint_m)
    for ridge, joint_m in _ridges():
        distance = _smooth_min(distance, ridge(points), joint_m)
    return distance


def _body(points: NDArray) -> NDArray:
    """Plate with a sloped upper face and a domed lobe."""
    side = _outline()(points)
    roof = _smooth_max(_above(points, 20.5, 0.09, 0.19), _above(points, 37.0, 0.8, 0.0), 6 * MM)
    lobe = np.linalg.norm(points - np.array([-34.5, 1, -10]) * MM, axis=1) - 26 * MM
    plate = _smooth_max(roof, side, 7 * MM)
    return _smooth_min(plate, _smooth_max(lobe, side, 12 * MM), 6 * MM)


def _above(points: NDArray, height_mm: float, x_slope: float, y_slope: float) -> NDArray:
    """Distance above a plane that has a height at the origin and slopes."""
    normal = np.array([-x_slope, -y_slope, 1.0])
    return (points @ normal - height_mm * MM) / np.linalg.norm(normal)


@cache
def _outline() -> "_Outline":
    return _Outline(OUTLINE_MM)


@cache
def _grooves() -> list[tuple["_Tube", float]]:
    """Grooves, each with the length over which its edge is rounded."""
    drawn = [(FOSSA_MM, 3.0), (CONCHA_MM, 4.0), (CYMBA_MM, 4.0), (CANAL_MM, 4.0), (NOTCH_MM, 5.0)]
    return [(_Tube(line), joint * MM) for line, joint in drawn]


@cache
def _ridges() -> list[tuple["_Tube", float]]:
    """Ridges, each with the length over which its base is rounded."""
    walls = [(HELIX_MM, -0.35, 4.0), (ANTIHELIX_MM, 0.3, 5.0), (LOWER_CRUS_MM, 0.2, 4.0)]
    rolls = [(CRUS_MM, 4.0), (SCAPHA_MM, 3.0), (CHEEK_MM, 8.0), (TRAGUS_MM, 7.0)]
    rolls += [(ANTITRAGUS_MM, 8.0)]
    ridges = [(_Wall(line, swell), joint * MM) for line, swell, joint in walls]
    return ridges + [(_Tube(line), joint * MM) for line, joint in rolls]


class _Tube:
    """Round tube along a line (x, y, z, radius) [mm], nearest by its first two or three axes."""

    def __init__(self, line_mm: list[tuple], axes: int = 3) -> None:
        drawn = np.array(line_mm, dtype=float) * MM
        place = _along(drawn[:, :3])
        spline = make_interp_spline(place, drawn, k=min(3, len(drawn) - 1))
        place = np.linspace(0, place[-1], round(place[-1] / LINE_STEP_M) + 1)
        self.axes, self.value, self.rate = axes, spline(place), spline(place, 1)
        self.rate /= np.linalg.norm(self.rate[:, :axes], axis=1)[:, None]
        self.reach = np.full((2, len(place)), 2 * LINE_STEP_M)
        self.reach[0, 0] = self.reach[1, -1] = 0
        self.tree = cKDTree(self.value[:, :axes])

    def __call__(self, points: NDArray) -> NDArray:
        """Signed distance."""
        value = self.nearest(points)
        return np.linalg.norm(points - value[:, :3], axis=1) - value[:, 3]

    def nearest(self, points: NDArray) -> NDArray:
        """Place and radius of the line next to points, shape (n, 4) or more columns."""
        _, i = self.tree.query(points[:, : self.axes])
        value, rate = self.value[i], self.rate[i]
        ahead = np.einsum("ij,ij->i", (points - value[:, :3])[:, : self.axes], rate[:, : self.axes])
        ahead = np.clip(ahead, -self.reach[0, i], self.reach[1, i])
        return value + ahead[:, None] * rate


class _Wall(_Tube):
    """Ridge on the ground: a tube above its middle line, below a wall that swells to its base."""

    def __init__(self, line_mm: list[tuple], swell: float) -> None:
        super().__init__(line_mm, axes=2)
        self.swell, tilt = swell, np.hypot(1, self.rate[:, 2])
        change = np.gradient(tilt, _along(self.value[:, :2]))
        self.value = np.column_stack([self.value, tilt])
        self.rate = np.column_stack([self.rate, change])

    def __call__(self, points: NDArray) -> NDArray:
        """Signed distance."""
        value = self.nearest(points)
        aside = np.linalg.norm(points[:, :2] - value[:, :2], axis=1)
        rise = (points[:, 2] - value[:, 2]) / value[:, 4]
        fall, radius = np.maximum(-rise, 0), value[:, 3]
        wider = self.swell * fall**2 / (fall**2 + radius**2)
        return np.hypot(aside, np.maximum(rise, 0)) - radius * (1 + wider)


class _Outline:
    """Upright cylinder over a closed smooth line (x, y) [mm], clockwise seen from above."""

    def __init__(self, line_mm: list[tuple]) -> None:
        drawn = np.array([*line_mm, line_mm[0]], dtype=float) * MM
        place = _along(drawn)
        spline = make_interp_spline(place, drawn, k=3, bc_type="periodic")
        place = np.arange(0, place[-1], LINE_STEP_M)
        self.place, rate = spline(place), spline(place, 1)
        self.outward = np.stack([-rate[:, 1], rate[:, 0]], axis=1)
        self.outward /= np.linalg.norm(rate, axis=1)[:, None]
        self.tree = cKDTree(self.place)

    def __call__(self, points: NDArray) -> NDArray:
        """Signed distance."""
        _, i = self.tree.query(points[:, :2])
        return np.einsum("ij,ij->i", points[:, :2] - self.place[i], self.outward[i])


def _along(places: NDArray) -> NDArray:
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.concatenate([[0], np.cumsum(steps)])


def _smooth_min(a: NDArray, b: NDArray, joint: float) -> NDArray:
    """Polynomial smooth minimum: rounded where the two differ by less than the joint."""
    near = np.maximum(joint - np.abs(a - b), 0)
    return np.minimum(a, b) - near**2 / (4 * joint)


def _smooth_max(a: NDArray, b: NDArray, joint: float) -> NDArray:
    return -_smooth_min(-a, -b, joint)
