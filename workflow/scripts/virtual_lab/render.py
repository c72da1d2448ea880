"""Ray casting with sun and sky: linear images of a scene, and what of them moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

from virtual_lab.part import OBJECT, PROBE_PARTS
from virtual_lab.scene import Scene, dot, unit
from virtual_lab.surface_look import look_at_hits

RAYS_AT_ONCE = 16_000
LIFT_M = 2e-5
NEAREST_M = 0.05
BOX_MARGIN_PX = 10
# Width of the square around a changed pixel that takes in the soft edge of its shadow [px].
SHADOW_EDGE_PX = 21


@dataclass(frozen=True)
class View:
    """A camera and where it stands (camera axes of OpenCV, object frame)."""

    camera: PinholeCamera
    object_from_camera: NDArray

    def rays(self, pixels_px: NDArray) -> tuple[NDArray, NDArray]:
        """Origin (3,) and unit directions (n, 3) through pixels, object frame."""
        directions = self.camera.rays(pixels_px) @ self.object_from_camera[:3, :3].T
        return self.object_from_camera[:3, 3], unit(directions)

    @property
    def camera_from_object(self) -> NDArray:
        """Transform from the object's frame, shape (4, 4)."""
        return np.linalg.inv(self.object_from_camera)


@dataclass(frozen=True)
class Light:
    """Key light and sky.

    Attributes
    ----------
    towards : (3,) array
        Unit vector to the key light.
    key, ambient : float
        Irradiance of the key light at normal incidence and of the sky, for reflectance 1.
    spread : float
        Half width of the key light, as seen from the bench [rad].
    """

    towards: NDArray
    key: float
    ambient: float
    spread: float


@dataclass(frozen=True)
class Layer:
    """Noise-free picture of one moment.

    Attributes
    ----------
    colour : (h, w, 3) float32 array
        Linear radiance.
    kind : (h, w) int8 array
        What each pixel's centre sees (`virtual_lab.part`), -1 for nothing.
    lit : (h, w) bool array
        Whether the key light's centre reaches it.
    """

    colour: NDArray
    kind: NDArray
    lit: NDArray


def look_at(
    target_m: NDArray,
    *,
    distance_m: float,
    elevation_deg: float,
    bumped_deg: Sequence[float] = (0, 0, 0),
) -> NDArray:
    """Pose of a level camera on the side y < 0 that looks at a target, shape (4, 4).

    Then it is bumped: turned about its own x, y and z.
    """
    elevation = np.deg2rad(elevation_deg)
    forward = np.array([0.0, np.cos(elevation), -np.sin(elevation)])
    right = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = np.asarray(target_m) - distance_m * forward
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("xyz", bumped_deg, degrees=True).as_matrix()
    return pose


def render(view: View, scene: Scene, light: Light, *, samples: int) -> Layer:
    """Render a whole picture with samples x samples rays a pixel."""
    camera = view.camera
    pixels = camera.pixel_grid()
    kind, lit = _at_centres(view, scene, light, pixels)
    colour = _supersampled(view, scene, light, pixels, samples)
    shape = (camera.height_px, camera.width_px)
    return Layer(colour.reshape(*shape, 3), kind.reshape(shape), lit.reshape(shape))


def render_change(
    view: View,
    scene: Scene,
    light: Light,
    still: Layer,
    boxes_px: list[tuple[int, int, int, int]],
    *,
    moved_m: NDArray | None,
    still_m: float,
    samples: int,
) -> Layer:
    """Render again what the probe, its shadow or the dent changed of a still picture.

    Parameters
    ----------
    view, scene, light
        The moment to render.
    still : Layer
        The same view without the probe.
    boxes_px : list of (left, top, right, bottom)
        Parts of the picture where anything can have changed [px].
    moved_m : (n,) array or None
        How far each vertex of the object is from its place in the still picture [m].
    still_m : float
        Moves up to this do not count [m].
    samples : int
        Rays a pixel along each side.

    Returns
    -------
    Layer
    """
    candidates = np.zeros(still.kind.shape, dtype=np.uint8)
    for left, top, right, bottom in boxes_px:
        candidates[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = 1
    rows, columns = np.nonzero(candidates)
    pixels = np.column_stack([columns, rows]).astype(float)
    kind, lit = still.kind.copy(), still.lit.copy()
    kind[rows, columns], lit[rows, columns] = _at_centres(view, scene, light, pixels)
    changed = (kind != still.kind) | (lit != still.lit) | np.isin(kind, PROBE_PARTS)
    if moved_m is not None:
        changed[rows, columns] |= _on_moved(view, scene, pixels, moved_m > still_m)
    edge = np.ones((SHADOW_EDGE_PX, SHADOW_EDGE_PX), np.uint8)
    changed = cv2.dilate(changed.astype(np.uint8), edge) > 0
    rows, columns = np.nonzero(changed)
    pixels = np.column_stack([columns, rows]).astype(float)
    colour = still.colour.copy()
    colour[rows, columns] = _supersampled(view, scene, light, pixels, samples)
    return Layer(colour, kind, lit)


def render_around(
    view: View, scene: Scene, light: Light, still: Layer, parts_m: list[NDArray], *, samples: int
) -> Layer:
    """Render again what parts of a scene (points (n, 3) each) and their shadows changed."""
    boxes = [projected_box(view, points, BOX_MARGIN_PX) for points in parts_m]
    return render_change(view, scene, light, still, boxes, moved_m=None, still_m=0, samples=samples)


def projected_box(view: View, points_m: NDArray, margin_px: int) -> tuple[int, int, int, int]:
    """Box around the projection of points of the object frame, with a margin [px].

    It is the whole picture where a point is not in front of the camera.
    """
    transform = view.camera_from_object
    local = points_m @ transform[:3, :3].T + transform[:3, 3]
    if local[:, 2].min() < NEAREST_M:
        return 0, 0, view.camera.width_px, view.camera.height_px
    pixels = view.camera.project(local)
    low, high = pixels.min(axis=0) - margin_px, pixels.max(axis=0) + margin_px
    size = np.array([view.camera.width_px, view.camera.height_px])
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    return int(low[0]), int(low[1]), int(np.ceil(high[0])), int(np.ceil(high[1]))


def _at_centres(view: View, scene: Scene, light: Light, pixels: NDArray) -> tuple[NDArray, NDArray]:
    origin, directions = view.rays(pixels)
    hits = scene.cast(origin, directions)
    seen = hits["kind"] >= 0
    lit = np.zeros(len(pixels), dtype=bool)
    points = origin + directions[seen] * (hits["t"][seen, None] - LIFT_M)
    lit[seen] = ~scene.blocked(points, light.towards)
    return hits["kind"].astype(np.int8), lit


def _on_moved(view: View, scene: Scene, pixels: NDArray, moved: NDArray) -> NDArray:
    origin, directions = view.rays(pixels)
    hits = scene.cast(origin, directions)
    body = hits["kind"] == OBJECT
    body[body] = moved[scene.faces[hits["triangle"][body]]].any(axis=1)
    return body


def _supersampled(view: View, scene: Scene, light: Light, pixels: NDArray, samples: int) -> NDArray:
    """Mean of samples x samples rays in each pixel, each with its own ray to the light."""
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    grid = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
    suns = _sun_directions(light, len(grid))
    total = np.zeros((len(pixels), 3))
    for offset, sun in zip(grid, suns, strict=True):
        for start in range(0, len(pixels), RAYS_AT_ONCE):
            part = slice(start, start + RAYS_AT_ONCE)
            origin, directions = view.rays(pixels[part] + offset)
            footprint = 1 / (samples * view.camera.fx_px)
            total[part] += _radiance(scene, light, sun, origin, directions, footprint)
    return (total / len(grid)).astype(np.float32)


def _sun_directions(light: Light, count: int) -> NDArray:
    """Directions spread evenly over the key light's disc (golden-angle spiral), (count, 3)."""
    k = np.arange(count)
    radius = light.spread * np.sqrt((k + 0.5) / count)
    angle = k * np.pi * (3 - np.sqrt(5))
    side = np.cross(light.towards, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    other = np.cross(light.towards, side)
    spread = np.outer(radius * np.cos(angle), side) + np.outer(radius * np.sin(angle), other)
    directions = light.towards + spread
    return unit(directions)


def _radiance(
    scene: Scene,
    light: Light,
    sun: NDArray,
    origin: NDArray,
    directions: NDArray,
    footprint: float,
) -> NDArray:
    hits = scene.cast(origin, directions)
    kind = hits["kind"]
    seen = kind >= 0
    points = origin + directions * np.where(seen, hits["t"], 0)[:, None]
    look = look_at_hits(scene, hits, points, directions, footprint)
    normals = look.normals
    facing = dot(normals, directions) > 0
    normals[facing] *= -1
    cosine = np.maximum(normals @ sun, 0)
    reach = seen & (cosine > 0)
    lit = np.zeros(len(points), dtype=bool)
    lit[reach] = ~scene.blocked(points[reach] + normals[reach] * LIFT_M, sun)
    sky = light.ambient * (0.65 + 0.35 * normals[:, 2])
    radiance = look.colours * (sky + light.key * cosine * lit)[:, None]
    shiny = lit & (look.gloss > 0)
    half = unit(sun - directions[shiny])
    cosine = np.maximum(dot(normals[shiny], half), 0)
    highlight = look.gloss[shiny] * cosine ** look.shininess[shiny]
    radiance[shiny] += (light.key * highlight)[:, None]
    radiance[~seen] = 0
    return radiance
