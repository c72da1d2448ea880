"""Structured-light depth camera: dots matched against a reference image (Section 4.1.2)."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.capture.images import DISPARITY, count_m, depth_of

from virtual_lab.render import LIFT_M, PosedCamera
from virtual_lab.scene import Scene, dot, look_at_hits

WINDOW_PX = 9
LARGEST_COUNT = 2046
LARGEST_U16 = 65535
DISTORTION_CELLS = (6, 8)
# Dots of the projected pattern: part of the cells that are lit, cell and blur on the image.
DOT_SHARE, DOT_CELL_PX, DOT_BLUR_PX = 0.12, 1.0, 0.75
OVERSAMPLING = 4
PATTERN_MARGIN_PX = 140
# The infrared image, with 1 for a white wall's dot at 1 m head-on.
AMBIENT, LARGEST_SIGNAL = 0.02, 4.0
SEARCH_MARGIN_PX, SEARCH_STEP_PX = 3, 0.5
# Most things are lighter at 830 nm than in visible light.
INFRARED_FLOOR = 0.3


class KinectDepth:
    """Depth camera that matches its dot pattern with a 9 x 9 window.

    The firmware knows its lens: candidates are compared in undistorted coordinates. It searches
    the disparities that occur in the scene, so gross false matches outside them do not occur.

    Parameters
    ----------
    view : PosedCamera
        The infrared camera.
    spec : mapping
        ``depth`` block of the sensor's file.
    range_m : (float, float)
        Depths that the sensor reports [m].
    options : mapping
        ``kinect`` block of lab.yaml: ``distortion_px``, ``noise``, ``shot_noise``, ``correlation``.
    rng : numpy.random.Generator
        Draws the device: its pattern and its own low-frequency distortion.
    """

    def __init__(
        self,
        view: PosedCamera,
        spec: Mapping,
        range_m: tuple,
        options: Mapping,
        rng: np.random.Generator,
    ) -> None:
        self.view, self.spec, self.range_m, self.options = view, spec, range_m, options
        camera = view.camera
        self.shape = (camera.height_px, camera.width_px)
        self.product = camera.fx_px * spec["baseline_m"]
        # By which it makes depths of disparities.
        self.stated_px_m = spec.get("stated_product_px_m", self.product)
        cells = rng.standard_normal(DISTORTION_CELLS).astype(np.float32)
        field = cv2.resize(cells, self.shape[::-1], interpolation=cv2.INTER_CUBIC)
        self.distortion_px = options["distortion_px"] * field / field.std()
        self.projector = view.object_from_camera @ [spec["baseline_m"], 0, 0, 1]
        self.pattern = _pattern(self.shape, rng)
        self.origin_m, self.directions = view.rays(camera.pixel_grid())
        flat = camera.rays(camera.pixel_grid())[:, :2]
        # Undistorted pixel coordinates; the projector sees the same ones, shifted by f b / Z.
        ideal = flat * [camera.fx_px, camera.fy_px] + [camera.cx_px, camera.cy_px]
        self.ideal_px = ideal.T.reshape(2, *self.shape).astype(np.float32)
        self.references: dict[int, NDArray] = {}

    def image(self, scene: Scene, rng: np.random.Generator) -> NDArray:
        """Normalised disparity of Eq. 4.2, or counts of depth, (h, w) uint16."""
        disparity, strength = self.true_signal(scene)
        seen = np.isfinite(disparity)
        depths = self.spec["encoding"] != DISPARITY
        nothing = 0 if depths else self.spec["no_reading"]
        if not seen.any():
            return np.full(self.shape, nothing, dtype=np.uint16)
        infrared = self.infrared(disparity, strength, rng)
        ends = disparity[seen].min(), disparity[seen].max()
        found, score = self._match(infrared, *ends)
        depth = self.product / np.maximum(found, 1e-6)
        found = found + self.distortion_px
        if depths:
            counts = self.stated_px_m / np.maximum(found, 1e-6) / count_m(self.spec)
        else:
            counts = (found - self.spec["disparity_offset_px"]) / self.spec["disparity_scale"]
        valid = (score > self.options["correlation"]) & (counts >= 0)
        valid &= counts <= (LARGEST_U16 if depths else LARGEST_COUNT)
        valid &= (depth > self.range_m[0]) & (depth < self.range_m[1])
        rounded = np.round(np.where(valid, counts, 0)).astype(np.uint16)
        return np.where(valid, rounded, nothing).astype(np.uint16)

    def points(self, image: NDArray) -> NDArray:
        """Points of an image's readings in its order, colour camera's frame, (n, 3) [m]."""
        depth, pose = depth_of(image, self.spec).ravel(), np.array(self.spec["color_from_depth"])
        local = self.view.camera.rays(self.view.camera.pixel_grid()) * depth[:, None]
        return local[np.isfinite(depth)] @ pose[:3, :3].T + pose[:3, 3]

    def true_signal(self, scene: Scene) -> tuple[NDArray, NDArray]:
        """Exact disparity f b / Z [px], NaN where nothing is seen, and the light that returns."""
        camera = self.view.camera
        origin, directions = self.origin_m, self.directions
        hits = scene.cast(origin, directions)
        seen = hits["kind"] >= 0
        points = origin + directions * np.where(seen, hits["t"], 0)[:, None]
        depth = (points - origin) @ self.view.object_from_camera[:3, 2]
        to_projector = self.projector[:3] - points
        distance = np.linalg.norm(to_projector, axis=1, keepdims=True)
        towards = to_projector / distance
        normals, colours, _, _ = look_at_hits(scene, hits, points, directions, 1 / camera.fx_px)
        cosine = np.abs(dot(normals, towards))
        lit = np.zeros(len(points), dtype=bool)
        start = points + towards * 20 * LIFT_M
        lit[seen] = ~scene.blocked(start[seen], towards[seen])
        reflectance = INFRARED_FLOOR + (1 - INFRARED_FLOOR) * colours.mean(axis=1)
        strength = np.where(lit, reflectance * cosine / np.maximum(distance[:, 0], 0.1) ** 2, 0)
        disparity = np.where(seen & (depth > 0), self.product / np.maximum(depth, 1e-6), np.nan)
        return disparity.reshape(self.shape), strength.reshape(self.shape)

    def infrared(self, disparity: NDArray, strength: NDArray, rng: np.random.Generator) -> NDArray:
        """The infrared image of the dots, (h, w) float32."""
        shift = np.nan_to_num(disparity).astype(np.float32)
        signal = self._projected(shift) * strength + AMBIENT
        options = self.options
        std = np.sqrt(options["noise"] ** 2 + options["shot_noise"] ** 2 * signal)
        noisy = signal + std * rng.standard_normal(self.shape, dtype=np.float32)
        return np.clip(noisy, 0, LARGEST_SIGNAL).astype(np.float32)

    def _projected(self, shift_px: NDArray | float) -> NDArray:
        """The pattern as it falls on pixels whose disparity is a shift."""
        x = (self.ideal_px[0] + shift_px + PATTERN_MARGIN_PX) * OVERSAMPLING
        y = (self.ideal_px[1] + PATTERN_MARGIN_PX) * OVERSAMPLING
        border = cv2.BORDER_REFLECT_101
        return cv2.remap(self.pattern, x.astype(np.float32), y, cv2.INTER_LINEAR, borderMode=border)

    def _match(self, infrared: NDArray, low: float, high: float) -> tuple[NDArray, NDArray]:
        """Disparity [px] and correlation of the best candidate, refined between neighbours."""
        image = _normalised(infrared)
        first = int((low - SEARCH_MARGIN_PX) / SEARCH_STEP_PX)
        last = int((high + SEARCH_MARGIN_PX) / SEARCH_STEP_PX) + 1
        best, before = np.full((2, *self.shape), -1.0, dtype=np.float32)
        place, *sides = np.zeros((3, *self.shape), dtype=np.float32)
        rising = np.zeros(self.shape, dtype=bool)
        for candidate in range(first, last + 1):
            score = cv2.blur(image * self._reference(candidate), (WINDOW_PX, WINDOW_PX))
            np.copyto(sides[1], score, where=rising)
            np.greater(score, best, out=rising)
            np.copyto(best, score, where=rising)
            np.copyto(place, candidate, where=rising)
            np.copyto(sides[0], before, where=rising)
            before = score
        curvature = sides[0] - 2 * best + sides[1]
        fitted = 0.5 * (sides[0] - sides[1]) / np.minimum(curvature, -1e-6)
        offset = np.where(curvature < 0, fitted, 0)
        return SEARCH_STEP_PX * (place + np.clip(offset, -0.5, 0.5)), best

    def _reference(self, candidate: int) -> NDArray:
        if candidate not in self.references:
            self.references[candidate] = _normalised(self._projected(SEARCH_STEP_PX * candidate))
        return self.references[candidate]


def _normalised(image: NDArray) -> NDArray:
    """Zero mean and unit deviation over the window around each pixel."""
    window = (WINDOW_PX, WINDOW_PX)
    mean = cv2.blur(image, window)
    variance = cv2.blur(image * image, window) - mean * mean
    return (image - mean) / np.sqrt(np.maximum(variance, 1e-8))


def _pattern(shape: tuple[int, int], rng: np.random.Generator) -> NDArray:
    """Random dots in undistorted pixels with a margin, finely sampled, peak about 1."""
    cells = [int((size + 2 * PATTERN_MARGIN_PX) / DOT_CELL_PX) for size in shape]
    dots = (rng.random(cells) < DOT_SHARE).astype(np.float32)
    size = [int((side + 2 * PATTERN_MARGIN_PX) * OVERSAMPLING) for side in shape]
    fine = cv2.resize(dots, size[::-1], interpolation=cv2.INTER_NEAREST)
    blurred = cv2.GaussianBlur(fine, (0, 0), DOT_BLUR_PX * OVERSAMPLING)
    return blurred / np.percentile(blurred[::7, ::7], 99.5)
