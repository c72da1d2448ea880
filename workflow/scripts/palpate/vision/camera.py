"""Pinhole camera with lens distortion (Section 4.1.4)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

# Iterations and step [px] at which the inverse of the distortion is found.
UNDISTORTED = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-6)
OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px", "distortion")
NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PinholeCamera:
    """Optics of one camera; integer pixel coordinates are pixel centres.

    Attributes
    ----------
    width_px, height_px : int
        Size of the image.
    fx_px, fy_px, cx_px, cy_px : float
        Focal lengths and principal point (Eq. 4.7).
    distortion : tuple of float
        k1, k2, p1, p2, k3 of the radial and tangential lens distortion, or more of OpenCV's.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, ...] = NO_DISTORTION

    @property
    def matrix(self) -> NDArray:
        """Camera matrix K of Eq. 4.7, shape (3, 3), in pixels."""
        return np.array([[self.fx_px, 0, self.cx_px], [0, self.fy_px, self.cy_px], [0, 0, 1.0]])

    def project(self, points_m: ArrayLike) -> NDArray:
        """Project points of the camera frame into the image (Eq. 4.8).

        Parameters
        ----------
        points_m : (n, 3) array
            Points in front of the camera [m].

        Returns
        -------
        (n, 2) array
            Pixel coordinates x, y [px].
        """
        points = np.asarray(points_m, dtype=float).reshape(-1, 3)
        if not len(points):
            return np.zeros((0, 2))
        zero = np.zeros(3)
        pixels, _ = cv2.projectPoints(points, zero, zero, self.matrix, np.array(self.distortion))
        return pixels.reshape(-1, 2)

    def rays(self, pixels_px: ArrayLike) -> NDArray:
        """Directions through pixels, with the distortion taken out.

        Parameters
        ----------
        pixels_px : (n, 2) array
            Pixel coordinates x, y [px].

        Returns
        -------
        (n, 3) array
            Directions in the camera frame with z = 1.
        """
        pixels = np.asarray(pixels_px, dtype=float).reshape(-1, 2)
        if any(self.distortion):
            lens = self.matrix, np.array(self.distortion)
            flat = cv2.undistortPoints(pixels[:, None], *lens, criteria=UNDISTORTED)
            flat = flat.reshape(-1, 2)
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
    optics = {key: float(spec[key]) for key in ("fx_px", "fy_px", "cx_px", "cy_px")}
    distortion = tuple(float(value) for value in spec.get("distortion", NO_DISTORTION))
    return PinholeCamera(spec["width_px"], spec["height_px"], **optics, distortion=distortion)


def with_calibration(sensor: Mapping, calibration: Mapping) -> dict:
    """A sensor's specification with the optics that its own pictures of a board gave.

    Parameters
    ----------
    sensor : mapping
        The sensor's file.
    calibration : mapping
        calibration.json: optics of both cameras and Eq. 4.12.

    Returns
    -------
    dict
        Size, encoding and depth's encoding are the file's.
    """
    found = dict(sensor)
    for block, stream in (("color", "color"), ("depth", "infrared")):
        camera = calibration["cameras"][stream]
        found[block] = dict(sensor[block]) | {key: camera[key] for key in OPTICS}
        if "covariance" in camera:
            found[block]["covariance"] = camera["covariance"]
    found["depth"]["color_from_depth"] = calibration["color_from_infrared"]
    # Where the depth image is cut out of the infrared one.
    for centre, shift_px in zip(
        ("cx_px", "cy_px"), sensor["depth"].get("infrared_shift_px", (0, 0)), strict=True
    ):
        found["depth"][centre] -= shift_px
    return found


def sensor_with_optics(spec: Mapping, optics_path: str | Sequence | None) -> Mapping:
    """The sensor's file, with the optics of its own calibration where there is one.

    Parameters
    ----------
    spec : mapping
        The sensor's file.
    optics_path : str or sequence or None
        calibration.json; empty where the file's own optics hold.
    """
    if not optics_path:
        return spec
    calibration = json.loads(Path(str(optics_path)).read_text(encoding="utf-8"))
    return with_calibration(spec, calibration)
