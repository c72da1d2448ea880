"""Surfaces seen in space: parallel rays, cast without a display."""

from dataclasses import dataclass, field

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from palpate.open3d_core import o3d, scene_of
from palpate.solid.mesh import doubled_normals
from palpate.surface.template import vertex_normals
from palpate.units import MILLIMETRES

SKIN = "#B9CDE0"
LIGHT = np.array([-0.45, 0.75, 0.9])
DARKEST = 0.42
SAMPLES = 2
EDGE_SHADE, EDGE_PX = 0.45, 0.9
MARGIN = 0.04


@dataclass(frozen=True)
class View:
    """Parallel projection from a direction; z of the object frame points up in the picture.

    Attributes
    ----------
    azimuth_deg, elevation_deg : float
        Of the viewer, from the x axis and above the x-y plane; 90 is from above.
    """

    azimuth_deg: float
    elevation_deg: float
    axes: NDArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        azimuth, elevation = np.deg2rad([self.azimuth_deg, self.elevation_deg])
        flat = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        right = np.array([-flat[1], flat[0], 0.0])
        towards = np.cos(elevation) * flat + np.sin(elevation) * np.array([0.0, 0.0, 1.0])
        object.__setattr__(self, "axes", np.stack([right, np.cross(towards, right), towards]))

    def project(self, points_m: NDArray) -> NDArray:
        """Right, up and towards the viewer, shape (n, 3) [mm]."""
        return np.asarray(points_m, dtype=float) @ self.axes.T * MILLIMETRES

    def frame(self, *points_m: NDArray, margin: float = MARGIN) -> NDArray:
        """Left, right, bottom and top of what holds all points, with a margin, shape (4,) [mm]."""
        flat = np.concatenate([self.project(points)[:, :2] for points in points_m])
        low, high = flat.min(axis=0), flat.max(axis=0)
        more = margin * (high - low).max()
        return np.array([low[0] - more, high[0] + more, low[1] - more, high[1] + more])

    def around(self, point_m: NDArray, width_mm: float, height_mm: float) -> NDArray:
        """Frame of a size about a point, shape (4,) [mm]."""
        x, y, _ = self.project(np.asarray(point_m)[None])[0]
        half, tall = width_mm / 2, height_mm / 2
        return np.array([x - half, x + half, y - tall, y + tall])


def view_from(camera_from_object: NDArray, *, elevation_deg: float | None = None) -> View:
    """View from where a camera stood; at another elevation where one is given."""
    camera = -camera_from_object[:3, :3].T @ camera_from_object[:3, 3]
    found = np.rad2deg(np.arctan2(camera[2], np.hypot(*camera[:2])))
    azimuth = np.rad2deg(np.arctan2(camera[1], camera[0]))
    return View(float(azimuth), float(found if elevation_deg is None else elevation_deg))


def render_surface(
    vertices_m: NDArray,
    faces: NDArray,
    view: View,
    frame_mm: NDArray,
    *,
    width_px: int,
    colours: NDArray | str = SKIN,
    edges: bool = False,
) -> NDArray:
    """Shaded picture of a surface by parallel rays, transparent where there is none.

    Parameters
    ----------
    vertices_m : (n, 3) array
        Vertices [m].
    faces : (m, 3) int array
        Outward triangles.
    view : View
    frame_mm : (4,) array
        Left, right, bottom and top of the picture in the view [mm].
    width_px : int
        Width of the picture; pixels are square.
    colours : (n, 3) array or colour, optional
        Of the vertices, or of all.
    edges : bool, optional
        Draw the edges of the triangles as thin lines.

    Returns
    -------
    (h, width_px, 4) array
        Red, green, blue and opacity, 0 to 1; first row on top.

    Raises
    ------
    ValueError
        If the frame has no area, or the picture no pixels.
    """
    left, right, bottom, top = frame_mm
    if not (right > left and top > bottom and width_px > 0):
        raise ValueError(f"frame_mm: expected an area and pixels, found {frame_mm}, {width_px} px")
    step = (right - left) / (width_px * SAMPLES)
    rows = SAMPLES * max(1, round((top - bottom) / step / SAMPLES))
    flat = view.project(vertices_m)
    x = left + step * (np.arange(width_px * SAMPLES) + 0.5)
    y = top - (top - bottom) / rows * (np.arange(rows) + 0.5)
    triangle, weights = _hits(flat, faces, x, y)
    seen = triangle >= 0
    corners, weights = faces[triangle[seen]], weights[seen]
    colour = _shaded(vertices_m, faces, view, colours, corners, weights)
    if edges:
        gap = _edge_distance(flat, corners, weights) / (step * SAMPLES)
        line = np.clip(EDGE_PX / 2 + 0.5 - gap, 0, 1)[:, None]
        colour *= 1 - (1 - EDGE_SHADE) * line
    rgba = np.zeros((len(y), len(x), 4))
    rgba[seen] = np.column_stack([colour, np.ones(len(colour))])
    return _averaged(rgba)


def _hits(flat: NDArray, faces: NDArray, x: NDArray, y: NDArray) -> tuple[NDArray, NDArray]:
    """Triangle (-1: none) and barycentric weights of each ray, (h, w) and (h, w, 3)."""
    scene = scene_of(flat, faces)
    rays = np.zeros((len(y), len(x), 6), dtype=np.float32)
    rays[..., 0], rays[..., 1] = x[None], y[:, None]
    rays[..., 2], rays[..., 5] = flat[:, 2].max() + 1.0, -1.0
    answer = scene.cast_rays(o3d.core.Tensor(rays), nthreads=1)
    hit = np.isfinite(answer["t_hit"].numpy())
    triangle = np.where(hit, answer["primitive_ids"].numpy().astype(np.int64), -1)
    u, v = np.moveaxis(answer["primitive_uvs"].numpy().astype(float), -1, 0)
    return triangle, np.stack([1 - u - v, u, v], axis=-1)


def _shaded(vertices_m, faces, view, colours, corners, weights) -> NDArray:
    """Lambert's shading of smooth and flat normals by equal parts."""
    smooth = np.einsum("kc,kcd->kd", weights, vertex_normals(vertices_m, faces)[corners])
    flat = doubled_normals(vertices_m, corners)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    # Smooth normals would round the sharp edges of a block.
    alike = (smooth * flat).sum(axis=1, keepdims=True) > 0.9 * np.linalg.norm(
        smooth, axis=1, keepdims=True
    )
    normals = np.where(alike, smooth, flat) @ view.axes.T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    light = np.clip(normals @ (LIGHT / np.linalg.norm(LIGHT)), 0, 1)
    if isinstance(colours, str):
        base = np.array(to_rgb(colours))
    else:
        base = np.einsum("kc,kcd->kd", weights, np.asarray(colours)[corners])
    return base * (DARKEST + (1 - DARKEST) * light)[:, None]


def _edge_distance(flat: NDArray, corners: NDArray, weights: NDArray) -> NDArray:
    """Distance of each hit from the nearest edge of its triangle in the picture [mm]."""
    points = flat[corners][..., :2]
    sides = np.roll(points, -2, axis=1) - np.roll(points, -1, axis=1)
    area = np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    heights = area[:, None] / np.maximum(np.linalg.norm(sides, axis=2), 1e-12)
    return (weights * heights).min(axis=1)


def _averaged(rgba: NDArray) -> NDArray:
    """Means of the samples of each pixel; colours weigh as much as they are opaque."""
    height, width = rgba.shape[0] // SAMPLES, rgba.shape[1] // SAMPLES
    blocks = rgba.reshape(height, SAMPLES, width, SAMPLES, 4).mean(axis=(1, 3))
    opacity = blocks[..., 3:]
    colour = np.where(opacity > 0, blocks[..., :3] / np.maximum(opacity, 1e-12), 1.0)
    return np.clip(np.concatenate([colour, opacity], axis=-1), 0, 1)


def upward(nodes_m: NDArray, triangles: NDArray) -> NDArray:
    """Which triangles (m, 3) over nodes face up, within 60 degrees, (m,) bool."""
    normals = doubled_normals(nodes_m, triangles)
    return normals[:, 2] > 0.5 * np.linalg.norm(normals, axis=1)
