"""Pinhole camera with lens distortion (Section 4.1.4), from and to a sensor's file."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.yaml_files import mismatch

# Iterations and step [px] at which the inverse of the distortion is found.
UNDISTORTED = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-6)
OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")
NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
# Digits behind the point: of pixels, of distortion and transforms, of lengths [m].
PIXEL_DIGITS, FINE_DIGITS, LENGTH_DIGITS = 4, 8, 6
# Least part of a baseline that goes to the right.
SIDEWAYS = 0.5


@dataclass(frozen=True)
class PinholeCamera:
    """Optics of one camera; integer pixel coordinates are pixel centres."""

    width_px: int
    height_px: int
    # focal lengths and principal point (Eq. 4.7)
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    # k1, k2, p1, p2, k3 of the radial and tangential lens distortion, or more of OpenCV's
    distortion: tuple[float, ...] = NO_DISTORTION

    @property
    def matrix(self) -> NDArray:
        """Camera matrix K of Eq. 4.7, shape (3, 3), in pixels."""
        return np.array([[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1.0]])

    def project(self, points_m: ArrayLike) -> NDArray:
        """Pixel coordinates x, y (n, 2) [px] of points (n, 3), camera frame [m] (Eq. 4.8)."""
        points = np.asarray(points_m, dtype=float).reshape(-1, 3)
        if not len(points):
            return np.zeros((0, 2))
        zero = np.zeros(3)
        pixels, _ = cv2.projectPoints(points, zero, zero, self.matrix, np.array(self.distortion))
        return pixels.reshape(-1, 2)

    def rays(self, pixels_px: ArrayLike) -> NDArray:
        """Directions (n, 3) with z = 1 through pixels x, y (n, 2) [px], distortion taken out."""
        pixels = np.asarray(pixels_px, dtype=float).reshape(-1, 2)
        if any(self.distortion):
            lens = self.matrix, np.array(self.distortion)
            flat = cv2.undistortPoints(pixels[:, None], *lens, criteria=UNDISTORTED)[:, 0]
        else:
            flat = (pixels - [self.cx_px, self.cy_px]) / [self.fx_px, self.fy_px]
        return np.column_stack([flat, np.ones(len(flat))])

    def pixel_grid(self) -> NDArray:
        """Coordinates of all pixel centres in row order, shape (height * width, 2) [px]."""
        rows, columns = np.mgrid[: self.height_px, : self.width_px]
        return np.column_stack([columns.ravel(), rows.ravel()]).astype(float)


@lru_cache(maxsize=4)
def pixel_rays(camera: PinholeCamera) -> NDArray:
    """Directions through all pixel centres in row order, (height * width, 3); not to be written."""
    rays = camera.rays(camera.pixel_grid())
    rays.flags.writeable = False
    return rays


def camera_from_spec(spec: Mapping) -> PinholeCamera:
    """Make a camera from the ``color`` or ``depth`` block of a sensor's YAML file."""
    optics = {key: float(spec[key]) for key in OPTICS}
    distortion = tuple(float(value) for value in spec.get("distortion", NO_DISTORTION))
    return PinholeCamera(spec["width_px"], spec["height_px"], **optics, distortion=distortion)


def with_calibration(sensor: Mapping, calibration: Mapping) -> dict:
    """A sensor's file with the optics of its own calibration.json: both cameras', and Eq. 4.12.

    Sizes, encodings and what depth's numbers mean stay the file's.
    """
    found = dict(sensor)
    for block, stream in (("color", "color"), ("depth", "infrared")):
        camera = calibration["cameras"][stream]
        known = [*OPTICS, "distortion", *(["covariance"] if "covariance" in camera else [])]
        found[block] = dict(sensor[block]) | {key: camera[key] for key in known}
    found["depth"]["color_from_depth"] = calibration["color_from_infrared"]
    # Where the depth image is cut out of the infrared one.
    right_px, down_px = sensor["depth"].get("infrared_shift_px", (0, 0))
    found["depth"]["cx_px"] -= right_px
    found["depth"]["cy_px"] -= down_px
    return found


def sensor_with_optics(spec: Mapping, optics_path: str | Sequence | None) -> Mapping:
    """The sensor's file `with_calibration` of a calibration.json; as it is without a path."""
    if not optics_path:
        return spec
    return with_calibration(spec, json.loads(Path(str(optics_path)).read_text(encoding="utf-8")))


def camera_block(camera: PinholeCamera, encoding: str) -> dict:
    """A camera's block of a sensor's file: ``color``, or ``depth`` without its transform."""
    return {
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        "encoding": encoding,
        **{name: round(float(getattr(camera, name)), PIXEL_DIGITS) for name in OPTICS},
        "distortion": [_rounded(value) for value in camera.distortion],
    }


def depth_blocks(
    cameras: Sequence[PinholeCamera], depth_from_color: NDArray, encodings: Sequence[str]
) -> dict:
    """Blocks of a colour and a depth camera."""
    rows = [[_rounded(v) for v in row] for row in np.linalg.inv(depth_from_color)]
    color, depth = (camera_block(c, e) for c, e in zip(cameras, encodings, strict=True))
    return {"color": color, "depth": depth | {"color_from_depth": rows}}


def stereo_blocks(camera: PinholeCamera, baseline_m: float, encoding: str) -> dict:
    """Blocks of a rectified stereo head."""
    stereo = {"baseline_m": round(float(baseline_m), LENGTH_DIGITS)}
    return {"color": camera_block(camera, encoding), "stereo": stereo}


def rectified(
    cameras: Sequence[PinholeCamera], right_from_left: NDArray
) -> tuple[PinholeCamera, float]:
    """The left camera of a pair, left and right, after rectification, and the baseline [m].

    It has no distortion; both rectified pictures are its. ``right_from_left`` is (4, 4) [m].

    Raises
    ------
    ValueError
        If the cameras' pictures differ in size, or the second is not to the first's right.
    """
    size, other = ((camera.width_px, camera.height_px) for camera in cameras)
    if other != size:
        found = " and ".join(f"{width} x {height}" for width, height in (size, other))
        raise mismatch("stereo", "pictures of one size", found)
    turn, shift = right_from_left[:3, :3], right_from_left[:3, 3]
    place = -turn.T @ shift
    if not place[0] > SIDEWAYS * np.linalg.norm(place):
        where = ", ".join(f"{1e3 * value:.0f}" for value in place)
        expected = "the left camera first and the right one to its right"
        found = f"the second at ({where}) mm of the first (right, down, ahead)"
        raise mismatch("stereo", expected, found)
    lenses = [item for c in cameras for item in (c.matrix, np.array(c.distortion))]
    _, _, P1, P2, *_ = cv2.stereoRectify(*lenses, size, turn, shift[:, None], alpha=0)
    camera = PinholeCamera(*size, P1[0, 0], P1[1, 1], P1[0, 2], P1[1, 2])
    return camera, float(-P2[0, 3] / P2[0, 0])


def opencv_text(cameras: Sequence[PinholeCamera], second_from_first: NDArray) -> str:
    """A pair as a FileStorage of OpenCV (YAML), for a program that rectifies its pictures."""
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    storage.write("image_width", cameras[0].width_px)
    storage.write("image_height", cameras[0].height_px)
    for k, camera in enumerate(cameras, start=1):
        storage.write(f"M{k}", camera.matrix)
        storage.write(f"D{k}", np.array([camera.distortion]))
    storage.write("R", np.ascontiguousarray(second_from_first[:3, :3]))
    storage.write("T", np.ascontiguousarray(second_from_first[:3, 3:]))
    return storage.releaseAndGetString()


def _rounded(value: float) -> float:
    """With no sign at 0."""
    return round(float(value), FINE_DIGITS) + 0.0
