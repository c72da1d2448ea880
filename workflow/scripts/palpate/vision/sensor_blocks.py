"""Calibrated cameras as blocks of a sensor's file."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.calibration_problem import OPTICS
from palpate.vision.camera import PinholeCamera

# Digits behind the point: of pixels, of distortion and transforms, of lengths [m].
PIXEL_DIGITS, FINE_DIGITS, LENGTH_DIGITS = 4, 8, 6
SIDEWAYS = 0.5


def camera_block(camera: PinholeCamera, encoding: str) -> dict:
    """A camera's block: ``color``, or ``depth`` without its transform."""
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
    color_from_depth = np.linalg.inv(depth_from_color)
    rows = [[_rounded(v) for v in row] for row in color_from_depth]
    color, depth = (camera_block(c, e) for c, e in zip(cameras, encodings, strict=True))
    return {"color": color, "depth": depth | {"color_from_depth": rows}}


def _rounded(value: float) -> float:
    """With no sign at 0."""
    return round(float(value), FINE_DIGITS) + 0.0


def stereo_blocks(camera: PinholeCamera, baseline_m: float, encoding: str) -> dict:
    """Blocks of a rectified stereo head."""
    return {
        "color": camera_block(camera, encoding),
        "stereo": {"baseline_m": round(float(baseline_m), LENGTH_DIGITS)},
    }


def rectified(
    cameras: Sequence[PinholeCamera], right_from_left: NDArray
) -> tuple[PinholeCamera, float]:
    """The left camera of a pair after rectification, and the baseline [m].

    Parameters
    ----------
    cameras : two of PinholeCamera
        Left and right.
    right_from_left : (4, 4) array

    Returns
    -------
    (PinholeCamera, float)
        The camera has no distortion; both rectified pictures are its.

    Raises
    ------
    ValueError
        If the cameras' pictures differ in size, or the second is not to the first's right.
    """
    left, right = cameras
    size = (left.width_px, left.height_px)
    if (right.width_px, right.height_px) != size:
        raise ValueError(
            f"stereo: expected pictures of one size, found {size[0]} x {size[1]} and"
            f" {right.width_px} x {right.height_px}"
        )
    turn, shift = right_from_left[:3, :3], right_from_left[:3, 3]
    place = -turn.T @ shift
    if not place[0] > SIDEWAYS * np.linalg.norm(place):
        where = ", ".join(f"{1e3 * value:.0f}" for value in place)
        raise ValueError(
            "stereo: expected the left camera first and the right one to its right, found the"
            f" second at ({where}) mm of the first (right, down, ahead)"
        )
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
