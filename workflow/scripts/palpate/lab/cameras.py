"""The lab's sensors: from linear radiance and true depth to the images that they record."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.images import mosaic_rggb
from palpate.lab.render import LIFT_M, View
from palpate.lab.scene import Scene

GAMMA = 2.2
FULL_SCALE = 255.0
# Khoshelham and Elberink 2012: sigma = 1.425e-6 z^2 [mm], which is a constant in disparity.
DEPTH_NOISE_PER_MM = 1.425e-6
CORRELATION_WINDOW_PX = 9
LARGEST_COUNT = 2046
GRAZING_COSINE = 0.15
LARGEST_STEP_PX = 2.0
DISTORTION_CELLS = (6, 8)


def color_image(
    radiance: NDArray, encoding: str, options: Mapping, rng: np.random.Generator
) -> NDArray:
    """Record a linear picture: lens blur, exposure, gamma, mosaic, noise, eight bits.

    Parameters
    ----------
    radiance : (h, w, 3) array
        Linear radiance; 1 is full scale at unit exposure.
    encoding : str
        ``bayer_rggb8``, ``rgb8`` or ``mono8``.
    options : mapping
        ``camera_noise`` block of lab.yaml: the variance of a sample [grey levels^2] is
        ``read_variance + shot_variance * level``.
    rng : numpy.random.Generator

    Returns
    -------
    uint8 array
        (h, w) mosaic or grey image, or (h, w, 3).
    """
    flicker = 1 + options["flicker"] * rng.standard_normal()
    blurred = cv2.GaussianBlur(radiance, (0, 0), options["blur_px"])
    levels = np.clip(blurred * flicker, 0, 1) ** (1 / GAMMA) * FULL_SCALE
    if encoding == "bayer_rggb8":
        levels = mosaic_rggb(levels)
    elif encoding == "mono8":
        levels = levels @ np.array([0.299, 0.587, 0.114])
    std = np.sqrt(options["read_variance"] + options["shot_variance"] * levels)
    noisy = levels + std * rng.standard_normal(levels.shape)
    return np.clip(np.round(noisy), 0, FULL_SCALE).astype(np.uint8)


class KinectDepth:
    """Structured-light depth camera: normalised disparity with the errors of the real one.

    Parameters
    ----------
    view : View
        The infrared camera.
    spec : mapping
        ``depth`` block of the sensor's file.
    range_m : (float, float)
        Depths that the sensor reports [m].
    options : mapping
        ``kinect`` block of lab.yaml.
    rng : numpy.random.Generator
        Draws the device's own low-frequency distortion.
    """

    def __init__(
        self, view: View, spec: Mapping, range_m: tuple, options: Mapping, rng: np.random.Generator
    ) -> None:
        self.view, self.spec, self.range_m = view, spec, range_m
        camera = view.camera
        self.product = camera.fx_px * spec["baseline_m"]
        cells = rng.standard_normal(DISTORTION_CELLS).astype(np.float32)
        size = (camera.width_px, camera.height_px)
        field = cv2.resize(cells, size, interpolation=cv2.INTER_CUBIC)
        self.distortion_px = options["distortion_px"] * field / field.std()
        self.noise_px = self.product * 1000 * DEPTH_NOISE_PER_MM
        self.projector = view.object_from_camera @ [spec["baseline_m"], 0, 0, 1]

    def image(self, scene: Scene, rng: np.random.Generator) -> NDArray:
        """Normalised disparity of Eq. 4.2, (h, w) uint16."""
        disparity, valid = self.true_disparity(scene)
        window = (CORRELATION_WINDOW_PX, CORRELATION_WINDOW_PX)
        filled = np.where(valid, disparity, 0).astype(np.float32)
        share = cv2.blur(valid.astype(np.float32), window)
        seen = cv2.blur(filled, window) / np.maximum(share, 1e-6)
        low = cv2.erode(np.where(valid, disparity, 1e6).astype(np.float32), np.ones((5, 5)))
        high = cv2.dilate(np.where(valid, disparity, -1e6).astype(np.float32), np.ones((5, 5)))
        valid &= (share > 0.6) & (high - low < LARGEST_STEP_PX)
        smooth = np.abs(seen - disparity) < 0.5
        measured = np.where(smooth, seen, disparity) + self.distortion_px + self._noise(rng)
        counts = (measured - self.spec["disparity_offset_px"]) / self.spec["disparity_scale"]
        valid &= (counts >= 0) & (counts <= LARGEST_COUNT)
        rounded = np.round(np.where(valid, counts, 0)).astype(np.uint16)
        return np.where(valid, rounded, self.spec["no_reading"]).astype(np.uint16)

    def true_disparity(self, scene: Scene) -> tuple[NDArray, NDArray]:
        """Exact disparity f b / Z [px] and where camera and projector both see, (h, w) each."""
        camera = self.view.camera
        origin, directions = self.view.rays(camera.pixel_grid())
        hits = scene.cast(origin, directions)
        seen = hits["kind"] >= 0
        points = origin + directions * np.where(seen, hits["t"], 0)[:, None]
        depth = (points - origin) @ self.view.object_from_camera[:3, 2]
        valid = seen & (depth > self.range_m[0]) & (depth < self.range_m[1])
        valid &= np.abs((hits["normal"] * directions).sum(axis=1)) > GRAZING_COSINE
        to_projector = self.projector[:3] - points
        distance = np.linalg.norm(to_projector, axis=1, keepdims=True)
        towards = to_projector / distance
        start = points + towards * 20 * LIFT_M
        valid[valid] = ~scene.blocked(start[valid], towards[valid])
        shape = (camera.height_px, camera.width_px)
        disparity = self.product / np.where(depth > 0, depth, np.inf)
        return disparity.reshape(shape), valid.reshape(shape)

    def _noise(self, rng: np.random.Generator) -> NDArray:
        """Disparity noise, correlated over the matching window [px]."""
        camera = self.view.camera
        white = rng.standard_normal((camera.height_px, camera.width_px)).astype(np.float32)
        smooth = cv2.GaussianBlur(white, (0, 0), CORRELATION_WINDOW_PX / np.sqrt(12))
        return self.noise_px * smooth / smooth.std()
