"""Ray casting with sun and sky: linear images of a scene, and what of them moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.vision.camera import PinholeCamera
from scipy.spatial.transform import Rotation

from virtual_lab.probe import OBJECT, PROBE_PARTS
from virtual_lab.scene import Scene, dot, look_at_hits, unit

RAYS_AT_ONCE = 16_000
LIFT_M = 2e-5
NEAREST_M = 0.05
BOX_MARGIN_PX = 10
# Rays a pixel of what moves, along each side.
MOVING_SAMPLES = 3
# A surface displacement up to this is none.
STILL_M = 2e-6
# Width of the square around a changed pixel that takes in the soft edge of its shadow [px].
SHADOW_EDGE_PX = 21


@dataclass(frozen=True)
class PosedCamera:
    """A camera and its pose (camera axes of OpenCV, object frame)."""

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

    def local(self, points_m: NDArray) -> NDArray:
        """Points of the object's frame in the camera's, (n, 3) [m]."""
        transform = self.camera_from_object
        return points_m @ transform[:3, :3].T + transform[:3, 3]

    def shows(self, points_m: NDArray, margin_px: int) -> bool:
        """Whether all points of the object's frame lie in the picture, a margin from its edge."""
        pixels = self.camera.project(self.local(points_m))
        limit = np.array([self.camera.width_px, self.camera.height_px]) - margin_px
        return bool((pixels > margin_px).all() and (pixels < limit).all())


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
        What each pixel's centre sees (`virtual_lab.probe`), -1 for nothing.
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
    turn_deg: float = 0,
    bumped_deg: Sequence[float] = (0, 0, 0),
) -> NDArray:
    """Pose of a level camera that looks at a target, shape (4, 4).

    It is on the side y < 0, or turned about the target's z; then bumped about its own x, y and z.
    """
    elevation, turn = np.deg2rad(elevation_deg), np.deg2rad(turn_deg)
    level = np.cos(elevation)
    # Not -0.0, which would be another byte of the truth.
    forward = np.array([0 - level * np.sin(turn), level * np.cos(turn), -np.sin(elevation)])
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = np.asarray(target_m) - distance_m * forward
    pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("xyz", bumped_deg, degrees=True).as_matrix()
    return pose


def render(view: PosedCamera, scene: Scene, light: Light, *, samples: int) -> Layer:
    """Render a whole picture with samples x samples rays a pixel."""
    camera = view.camera
    pixels = camera.pixel_grid()
    hits, lit = _at_centres(view, scene, light, pixels)
    colour = _supersampled(view, scene, light, pixels, samples)
    shape = (camera.height_px, camera.width_px)
    kind = hits["kind"].astype(np.int8)
    return Layer(colour.reshape(*shape, 3), kind.reshape(shape), lit.reshape(shape))


def render_change(
    view: PosedCamera,
    scene: Scene,
    light: Light,
    still: Layer,
    *,
    moved_m: NDArray | None = None,
    samples: int = MOVING_SAMPLES,
) -> Layer:
    """Render again what the probe, its shadow or the indentation changed of a still picture.

    Parameters
    ----------
    view, scene, light
        The moment to render, with a probe.
    still : Layer
        The same view without the probe.
    moved_m : (n,) array, optional
        How far each vertex of the object is from its place in the still picture [m].
    samples : int
        Rays a pixel along each side.
    """
    outline = scene.probe.outline() @ scene.object_from_force.T + scene.tip_m
    # The shadow lies between the table and the height of the tip.
    around_m = [outline] + [
        outline - light.towards * ((outline[:, 2:] - height) / light.towards[2])
        for height in (0.0, max(scene.tip_m[2], 0.0))
    ]
    if moved_m is not None and (moved_m > STILL_M).any():
        around_m.append(scene.rest_m[moved_m > STILL_M])
    candidates = np.zeros(still.kind.shape, dtype=np.uint8)
    for points in around_m:
        left, top, right, bottom = _projected_box(view, points)
        candidates[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)] = 1
    rows, columns = np.nonzero(candidates)
    pixels = np.column_stack([columns, rows]).astype(float)
    kind, lit = still.kind.copy(), still.lit.copy()
    hits, lit[rows, columns] = _at_centres(view, scene, light, pixels)
    kind[rows, columns] = hits["kind"]
    changed = (kind != still.kind) | (lit != still.lit) | np.isin(kind, PROBE_PARTS)
    if moved_m is not None:
        body = hits["kind"] == OBJECT
        body[body] = (moved_m > STILL_M)[scene.faces[hits["triangle"][body]]].any(axis=1)
        changed[rows, columns] |= body
    edge = np.ones((SHADOW_EDGE_PX, SHADOW_EDGE_PX), np.uint8)
    changed = cv2.dilate(changed.astype(np.uint8), edge) > 0
    rows, columns = np.nonzero(changed)
    pixels = np.column_stack([columns, rows]).astype(float)
    colour = still.colour.copy()
    colour[rows, columns] = _supersampled(view, scene, light, pixels, samples)
    return Layer(colour, kind, lit)


def _projected_box(view: PosedCamera, points_m: NDArray) -> tuple[int, int, int, int]:
    """Box around projected points [px]; all of the picture where one is not before the camera."""
    local = view.local(points_m)
    if local[:, 2].min() < NEAREST_M:
        return 0, 0, view.camera.width_px, view.camera.height_px
    pixels = view.camera.project(local)
    low, high = pixels.min(axis=0) - BOX_MARGIN_PX, pixels.max(axis=0) + BOX_MARGIN_PX
    size = np.array([view.camera.width_px, view.camera.height_px])
    low, high = np.clip(low, 0, size), np.clip(high, 0, size)
    return int(low[0]), int(low[1]), int(np.ceil(high[0])), int(np.ceil(high[1]))


def _at_centres(
    view: PosedCamera, scene: Scene, light: Light, pixels: NDArray
) -> tuple[dict, NDArray]:
    """First hits of the rays through pixels, and whether the key light's centre reaches them."""
    origin, directions = view.rays(pixels)
    hits = scene.cast(origin, directions)
    seen = hits["kind"] >= 0
    lit = np.zeros(len(pixels), dtype=bool)
    points = origin + directions[seen] * (hits["t"][seen, None] - LIFT_M)
    lit[seen] = ~scene.blocked(points, light.towards)
    return hits, lit


def _supersampled(
    view: PosedCamera, scene: Scene, light: Light, pixels: NDArray, samples: int
) -> NDArray:
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
    normals, colours, gloss, shininess = look_at_hits(scene, hits, points, directions, footprint)
    facing = dot(normals, directions) > 0
    normals[facing] *= -1
    cosine = np.maximum(normals @ sun, 0)
    reach = seen & (cosine > 0)
    lit = np.zeros(len(points), dtype=bool)
    lit[reach] = ~scene.blocked(points[reach] + normals[reach] * LIFT_M, sun)
    sky = light.ambient * (0.65 + 0.35 * normals[:, 2])
    radiance = colours * (sky + light.key * cosine * lit)[:, None]
    shiny = lit & (gloss > 0)
    half = unit(sun - directions[shiny])
    cosine = np.maximum(dot(normals[shiny], half), 0)
    highlight = gloss[shiny] * cosine ** shininess[shiny]
    radiance[shiny] += (light.key * highlight)[:, None]
    radiance[~seen] = 0
    return radiance
