"""Refine a board's pose on the brightness of all its pixels instead of its few corners.

Corners use a few pixels each; the tilt of a small board seen nearly square-on is then poorly
known, and the tip lies a board's length away from the board. The picture of the whole board,
outer squares included, knows the tilt two to three times better.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import erf

from palpate.vision.camera import PinholeCamera

# The rim of the outer squares is left out: what lies beyond the board is not known [squares].
RIM = 0.12
FEWEST_PIXELS = 200
ITERATIONS = 25
FIRST_DAMPING, DAMPED_LESS, DAMPED_MORE = 1e-3, 0.1, 10.0
CONVERGED_RAD_M, CONVERGED_GAIN = 5e-6, 1e-6
BLUR_PX, BLUR_RANGE_PX = 0.8, (0.3, 3.0)
# Residuals beyond this part of the contrast are something before the board: at first, when edges
# may be a pixel off, and in the end.
OCCLUDED = 0.4, 0.12
SHADING_PASSES = 2
# Pixels farther than this from all edges only tell the shading: every so many of them is used.
EDGE_PX, FLAT_STEP = 3.0, 16
# Neighbouring pixels of a demosaiced, blurred picture share their noise: so many pixels count for
# one when the covariance is worked out.
PIXELS_PER_SAMPLE = 4.0


@dataclass(frozen=True)
class PhotometricPose:
    """A refined pose.

    Attributes
    ----------
    camera_from_marker : (4, 4) array
        Rigid transform [m].
    covariance : (6, 6) array
        Of a rotation vector applied in the camera frame and the origin's place [rad, m].
    contrast_residual : float
        Root mean square residual over the contrast of black and white.
    """

    camera_from_marker: NDArray
    covariance: NDArray
    contrast_residual: float


@dataclass(frozen=True)
class _Pixels:
    """Rays (n, 3), grey levels (n,), and which of a mosaic's other sites each is (n, 0 or 3)."""

    rays: NDArray
    values: NDArray
    sites: NDArray


@dataclass(frozen=True)
class _Fit:
    """A pose and blur with residuals, weights (n,) and derivatives (n, k)."""

    pose: NDArray
    blur: float
    residual: NDArray
    weight: NDArray
    jacobian: NDArray
    contrast: float

    @property
    def cost(self) -> float:
        return float(self.residual @ self.residual)


class BoardRefiner:
    """Least-squares fit of pose, blur and shading of a checkerboard to an image.

    Parameters
    ----------
    camera : PinholeCamera
    marker : mapping
        ``marker`` block of the probe's file; the outer square beside the origin is black.
    mosaic : bool
        Whether images are mosaics: of the four kinds of pixels each has its own black and white.
        A mosaic tells more than the picture made of it, whose edges it shifts.
    """

    def __init__(self, camera: PinholeCamera, marker: Mapping, *, mosaic: bool) -> None:
        self.camera, self.mosaic, self.square_m = camera, mosaic, float(marker["square_m"])
        self.columns, self.rows = marker["inner_corners"]
        grid = camera.rays(camera.pixel_grid())
        self.rays = grid.reshape(camera.height_px, camera.width_px, 3)
        y, x = np.mgrid[: camera.height_px, : camera.width_px]
        self.sites = (2 * (y % 2) + x % 2).astype(np.uint8)

    def __call__(self, grey: NDArray, start: NDArray) -> PhotometricPose | None:
        """Refine a pose.

        Parameters
        ----------
        grey : (h, w) uint8 array
            Grey image, or mosaic.
        start : (4, 4) array
            camera_from_marker within about a pixel of the truth.

        Returns
        -------
        PhotometricPose or None
            None where too little of the board is in the image or the fit does not converge.
        """
        seen = self._pixels(grey, start)
        if seen is None:
            return None
        rough, _ = self._iterated(seen, start.copy(), BLUR_PX, OCCLUDED[0])
        fit, done = self._iterated(seen, rough.pose, rough.blur, OCCLUDED[1])
        return _result(fit) if done else None

    def _iterated(
        self, seen: "_Pixels", pose: NDArray, blur: float, occluded: float
    ) -> tuple["_Fit", bool]:
        """Levenberg and Marquardt's iterations, and whether they converged."""
        fit, damping = self._fit(seen, pose, blur, occluded), FIRST_DAMPING
        for _ in range(ITERATIONS):
            step = _step(fit, damping)
            blur = float(np.clip(fit.blur + step[6], *BLUR_RANGE_PX))
            moved = self._fit(seen, _moved(fit.pose, step[:6]), blur, occluded)
            gain = 1 - moved.cost / fit.cost
            damping *= DAMPED_LESS if gain >= 0 else DAMPED_MORE
            fit = moved if gain >= 0 else fit
            if np.abs(step[:6]).max() < CONVERGED_RAD_M or 0 <= gain < CONVERGED_GAIN:
                return fit, True
        return fit, False

    def _pixels(self, grey: NDArray, pose: NDArray) -> "_Pixels | None":
        """Pixels near the edges inside the board, and some of the flat ones."""
        columns, rows = self.columns, self.rows
        outline = np.array([[-1, -1], [columns, -1], [-1, rows], [columns, rows]])
        corners = np.column_stack([outline * self.square_m, np.zeros(4)])
        places = corners @ pose[:3, :3].T + pose[:3, 3]
        if places[:, 2].min() <= 0:
            return None
        pixels = self.camera.project(places)
        low = np.floor(pixels.min(axis=0)).astype(int).clip(0)
        high = np.ceil(pixels.max(axis=0)).astype(int) + 1
        box = slice(low[1], high[1]), slice(low[0], high[0])
        rays, values = self.rays[box].reshape(-1, 3), grey[box].ravel()
        sites = (self.sites[box] if self.mosaic else np.zeros_like(grey[box])).ravel()
        u, v, w, inverse = self._place(rays, pose)
        inside = (u > RIM - 1) & (u < self.columns - RIM) & (v > RIM - 1) & (v < self.rows - RIM)
        away = [
            np.abs(place - np.round(place).clip(0, count - 1)) / size
            for place, count, size in zip(
                (u, v),
                (self.columns, self.rows),
                _pixel_sizes(u, v, w, inverse, self.camera),
                strict=True,
            )
        ]
        flat = np.minimum(*away) > EDGE_PX
        inside &= ~flat | (np.arange(len(u)) % FLAT_STEP == 0)
        if inside.sum() < FEWEST_PIXELS:
            return None
        return _Pixels(rays[inside], values[inside].astype(float), _one_hot(sites[inside]))

    def _place(self, rays: NDArray, pose: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Board coordinates u, v [squares] of rays, their scale, and the inverse homography."""
        M = pose[:3, [0, 1, 3]] * [self.square_m, self.square_m, 1]
        inverse = np.linalg.inv(M)
        w = rays @ inverse.T
        return w[:, 0] / w[:, 2], w[:, 1] / w[:, 2], w[:, 2], inverse

    def _fit(self, seen: "_Pixels", pose: NDArray, blur: float, occluded: float) -> "_Fit":
        """Shading that fits a pose best, what is left, and the derivatives.

        Cameras don't store brightness in proportion: what lies between black and white is bent by
        two terms more than a straight line has.
        """
        u, v, w, inverse = self._place(seen.rays, pose)
        turned = _place_derivatives(u, v, w, inverse, pose, self.square_m)
        pixel = _pixel_sizes(u, v, w, inverse, self.camera)
        (S, dS, sS), (Q, dQ, sQ) = (
            _square_wave(place, count, blur * size)
            for place, count, size in ((u, self.columns, pixel[0]), (v, self.rows, pixel[1]))
        )
        white = (1 - S * Q) / 2
        bend = white * (1 - white)
        ramp = np.column_stack([np.ones_like(u), u, v])
        ramp = np.hstack([ramp, seen.sites])
        count = ramp.shape[1]
        basis = np.column_stack([ramp, white[:, None] * ramp, bend, bend * (1 - 2 * white)])
        shading, weight = _shading(basis, seen.values, occluded)
        gain = ramp @ shading[count : 2 * count]
        gain += shading[-2] * (1 - 2 * white) + shading[-1] * (1 - 6 * bend)
        by_place = -gain[:, None] / 2 * np.column_stack([dS * Q, S * dQ])
        by_pose = by_place[:, :1] * turned[0] + by_place[:, 1:] * turned[1]
        by_blur = -gain / 2 * (sS * pixel[0] * Q + S * sQ * pixel[1])
        model = basis @ shading
        contrast = np.ptp(model)
        limit = occluded * contrast
        residual = np.clip(seen.values - model, -limit, limit)
        jacobian = np.hstack([by_pose, by_blur[:, None], basis])
        return _Fit(pose, blur, residual, weight, jacobian, contrast)


def _one_hot(sites: NDArray) -> NDArray:
    """Columns for all but the first of the sites that occur, (n, k)."""
    return (sites[:, None] == np.unique(sites)[1:]).astype(float)


def _shading(basis: NDArray, values: NDArray, occluded: float) -> tuple[NDArray, NDArray]:
    """Coefficients of the shading without what is before the board, and the pixels' weights."""
    weight = np.ones(len(values))
    for _ in range(SHADING_PASSES):
        weighted = basis.T * weight
        shading = np.linalg.solve(weighted @ basis, weighted @ values)
        model = basis @ shading
        weight = (np.abs(values - model) < occluded * np.ptp(model)).astype(float)
    return shading, weight


def _step(fit: "_Fit", damping: float) -> NDArray:
    """Levenberg and Marquardt's step."""
    weighted = fit.jacobian * fit.weight[:, None]
    normal = fit.jacobian.T @ weighted
    damped = normal + damping * np.diag(np.diag(normal))
    return np.linalg.solve(damped, weighted.T @ fit.residual)


def _result(fit: "_Fit") -> PhotometricPose:
    normal = fit.jacobian.T @ (fit.jacobian * fit.weight[:, None])
    freedom = max(fit.weight.sum() - len(normal), 1)
    variance = float((fit.weight * fit.residual**2).sum() / freedom)
    covariance = np.linalg.inv(normal)[:6, :6] * variance * PIXELS_PER_SAMPLE
    return PhotometricPose(fit.pose, covariance, float(np.sqrt(variance) / fit.contrast))


def _moved(pose: NDArray, step: NDArray) -> NDArray:
    moved = pose.copy()
    moved[:3, :3] = Rotation.from_rotvec(step[:3]).as_matrix() @ pose[:3, :3]
    moved[:3, 3] += step[3:]
    return moved


def _place_derivatives(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, pose: NDArray, square_m: float
) -> tuple[NDArray, NDArray]:
    """Derivatives of u and v by rotation vector and shift of the board, (n, 6) each."""
    y = (np.column_stack([u, v]) * w[:, None] * square_m) @ pose[:3, :2].T
    parts = []
    for axis in np.eye(3):
        parts.append(-np.cross(axis, y) @ inverse.T)
    parts += [-w[:, None] * (inverse @ axis) for axis in np.eye(3)]
    dw = np.stack(parts, axis=1)
    return tuple(
        (dw[..., k] - place[:, None] * dw[..., 2]) / w[:, None] for k, place in ((0, u), (1, v))
    )


def _pixel_sizes(
    u: NDArray, v: NDArray, w: NDArray, inverse: NDArray, camera: PinholeCamera
) -> tuple[NDArray, NDArray]:
    """Squares per pixel across the edges of constant u and of constant v, (n,) each."""
    scale = np.array([1 / camera.fx_px, 1 / camera.fy_px])
    sizes = []
    for k, place in ((0, u), (1, v)):
        gradient = (inverse[k, :2] - place[:, None] * inverse[2, :2]) / w[:, None] * scale
        sizes.append(np.linalg.norm(gradient, axis=1))
    return tuple(sizes)


def _square_wave(place: NDArray, lines: int, blur: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Blurred square wave that starts at +1, its derivatives by place and by blur."""
    wave, slope, spread = np.ones_like(place), np.zeros_like(place), np.zeros_like(place)
    for line in range(lines):
        sign = -1 if line % 2 == 0 else 1
        z = (place - line) / blur
        bell = np.exp(-(z**2) / 2) * np.sqrt(2 / np.pi) / blur
        wave += sign * (1 + erf(z / np.sqrt(2)))
        slope += sign * bell
        spread -= sign * bell * z
    return wave, slope, spread
