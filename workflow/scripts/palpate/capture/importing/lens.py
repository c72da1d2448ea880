"""Lens models of other software as the five coefficients of a sensor's file."""

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.pixels import Form

NO_DISTORTION = [0.0] * 5
# Names of the model of Brown and Conrady with k1, k2, p1, p2, k3, which is OpenCV's. RealSense
# calls that of its colour cameras inverse, yet takes rays to the image with it (rs2_project).
BROWN_CONRADY = ("plumb_bob", "radtan", "brown_conrady", "inverse_brown_conrady")
RATIONAL = "rational_polynomial"
RATIONAL_COUNTS = 8, 12, 14
# A twentieth of a pixel is less than a marker's corner is known by.
LARGEST_MISFIT_PX = 0.05
STEPS = 25
# Rays are looked for so much beyond the image, since a lens may bend them into it.
BEYOND = 1.2


def five_coefficients(model: str, coefficients: NDArray, K: NDArray, form: Form) -> list[float]:
    """Distortion k1, k2, p1, p2, k3 of a lens.

    Parameters
    ----------
    model : str
        As a CameraInfo names it.
    coefficients : (n,) array
    K : (9,) array
        Camera matrix, row by row [px].
    form : Form
        Size of the images.

    Returns
    -------
    list of 5 floats
        Those of a model of Brown and Conrady are kept, others are fitted over the image.

    Raises
    ------
    ValueError
        If the model is unknown, or five coefficients do not follow it.
    """
    if not np.any(coefficients):
        return NO_DISTORTION
    plain = model.lower().replace(" ", "_")
    if not np.isfinite(coefficients).all():
        raise ValueError("camera_info: D: expected finite numbers, found others")
    if plain in BROWN_CONRADY and len(coefficients) in (4, 5):
        return [*map(float, coefficients), 0.0][:5]
    if plain != RATIONAL or len(coefficients) not in RATIONAL_COUNTS:
        names = ", ".join((*BROWN_CONRADY, RATIONAL))
        expected = f"one of {names} with its number of coefficients (or rectified images)"
        found = f"{model} with {len(coefficients)}"
        raise ValueError(f"camera_info: distortion_model: expected {expected}, found {found}")
    fitted, misfit_px = _fitted(*_rays(coefficients, K, form), focal_px=float(K[0]))
    if not misfit_px <= LARGEST_MISFIT_PX:
        expected = f"one that k1, k2, p1, p2, k3 follow within {LARGEST_MISFIT_PX} px"
        found = f"{model} at {misfit_px:.2g} px (record rectified images)"
        raise ValueError(f"camera_info: distortion_model: expected {expected}, found {found}")
    return fitted


def _rays(coefficients: NDArray, K: NDArray, form: Form) -> tuple[NDArray, NDArray]:
    """Normalised image points (n, 2) that cover the image, and their undistorted rays."""
    across = np.linspace(0, form.width_px - 1, STEPS), np.linspace(0, form.height_px - 1, STEPS)
    pixels = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
    seen = (pixels - K[[2, 5]]) / K[[0, 4]]
    rays, edge = BEYOND * seen, np.abs(seen).max(axis=0)
    bent, _ = cv2.projectPoints(
        np.column_stack([rays, np.ones(len(rays))]), *np.zeros((2, 3)), np.eye(3), coefficients
    )
    bent = bent.reshape(-1, 2)
    inside = (np.abs(bent) <= edge).all(axis=1)
    return bent[inside], rays[inside]


def _fitted(seen: NDArray, rays: NDArray, *, focal_px: float) -> tuple[list[float], float]:
    """Coefficients that take rays to where they were seen, and the largest misfit [px]."""
    terms = _terms(rays)
    flat = terms.reshape(-1, 5)
    found = np.linalg.lstsq(flat, (seen - rays).ravel(), rcond=None)[0]
    misfit = np.abs(rays + terms @ found - seen).max()
    return [float(f"{value:.9g}") for value in found], float(misfit * focal_px)


def _terms(points: NDArray) -> NDArray:
    """Displacement of points (n, 2) by each coefficient k1, k2, p1, p2, k3, (n, 2, 5)."""
    x, y = points.T
    r2 = x**2 + y**2
    radial = points[..., None] * np.stack([r2, r2**2, r2**3], axis=-1)[:, None]
    first = np.stack([2 * x * y, r2 + 2 * y**2], axis=-1)
    second = np.stack([r2 + 2 * x**2, 2 * x * y], axis=-1)
    return np.stack([*np.moveaxis(radial[..., :2], -1, 0), first, second, radial[..., 2]], axis=-1)
