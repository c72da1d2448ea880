"""Refine a target's pose on the brightness of all its pixels instead of its few corners.

Corners use a few pixels each; the tilt of a small target seen nearly square-on is then poorly
known, and the tip lies a target's length away from it. The picture of all that is printed, outer
squares and tags included, knows the tilt two to three times better.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.vision.board import FlatBoard, pixel_sizes, place_derivatives
from palpate.vision.camera import PinholeCamera, pixel_rays
from palpate.vision.pose import MarkerPose, corner_cofactor

# The rim of what is printed is left out: what lies beyond the target is not known [units].
RIM = 0.12
FEWEST_PIXELS = 200
ITERATIONS = 25
FIRST_DAMPING, DAMPED_LESS, DAMPED_MORE = 1e-3, 0.1, 10.0
CONVERGED_RAD_M, CONVERGED_GAIN, RESTLESS_RAD_M = 5e-6, 1e-6, 3e-5
BLUR_PX, BLUR_RANGE_PX = 0.8, (0.3, 3.0)
# Residuals beyond this part of the contrast are something before the target: at first, when edges
# may be a pixel off, and in the end.
OCCLUDED = 0.4, 0.12
SHADING_PASSES = 2
# Pixels farther than this from all edges only show the shading: every so many of them is used.
EDGE_PX, FLAT_STEP = 3.0, 16
# What edges are off beyond their noise, as corners would be [px]: lenses and prints are not ideal,
# and filling in a mosaic shifts edges further.
SYSTEMATIC_PX, FILLED_IN_PX = 0.015, 0.04
# A fit says nothing when it leaves more of the contrast, when the contrast is no more than this
# [grey levels], when less of the target is seen, or when it ends farther from the start [px].
MOST_LEFT, LEAST_CONTRAST, LEAST_SEEN, FARTHEST_PX = 0.03, 20.0, 0.75, 3.0


class _Pixels(NamedTuple):
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
        """Sum of the squared residuals, those beyond the limit counted at it."""
        return float(self.residual @ self.residual)

    @property
    def variance(self) -> float:
        """Of a grey level about the model, hidden pixels left out."""
        freedom = max(self.weight.sum() - self.jacobian.shape[1], 1)
        return float((self.weight * self.residual**2).sum() / freedom)


class BoardRefiner:
    """Least-squares fit of pose, blur and shading of a printed target to an image.

    Parameters
    ----------
    camera : PinholeCamera
    board : FlatBoard
    encoding : str
        Of the images: of the four kinds of pixels of ``bayer_rggb8`` each has its own black and
        white; the colours of ``rgb8`` were filled in, which shifts edges.
    """

    def __init__(self, camera: PinholeCamera, board: FlatBoard, *, encoding: str) -> None:
        self.camera, self.unit_m = camera, board.unit_m
        self.points, self.print = board.points_m, board.print
        self.systematic_px = FILLED_IN_PX if encoding == "rgb8" else SYSTEMATIC_PX
        # Least and largest u, v [units].
        self.outline = board.outline_m / board.unit_m
        shape = camera.height_px, camera.width_px
        self.rays = pixel_rays(camera).reshape(*shape, 3)
        y, x = np.ogrid[: shape[0], : shape[1]]
        mosaic = encoding == "bayer_rggb8"
        self.sites = (mosaic * (2 * (y % 2) + x % 2)).astype(np.uint8)

    def __call__(
        self, grey: NDArray, start: NDArray, hidden: NDArray | None = None
    ) -> MarkerPose | None:
        """Refine a pose.

        Parameters
        ----------
        grey : (h, w) uint8 array
            Grey image, or mosaic.
        start : (4, 4) array
            camera_from_marker within about a pixel of the truth.
        hidden : (n,) bool array, optional
            Corners that something hides: the target is not looked at about them.

        Returns
        -------
        MarkerPose or None
            None where too little of the target is in the image, the fit does not converge, or what
            it found does not look like the target or lies far from the start.
        """
        seen = self._pixels(grey, start, hidden)
        if seen is None:
            return None
        rough, _ = self._iterated(seen, start.copy(), BLUR_PX, OCCLUDED[0])
        fit, done = self._iterated(seen, rough.pose, rough.blur, OCCLUDED[1])
        points = self.points if hidden is None else self.points[~hidden]
        return self._result(fit, start, points) if done else None

    def _iterated(
        self, seen: _Pixels, pose: NDArray, blur: float, occluded: float
    ) -> tuple[_Fit, bool]:
        """Levenberg and Marquardt's iterations, and whether they converged."""
        fit, damping = self._fit(seen, pose, blur, occluded), FIRST_DAMPING
        for _ in range(ITERATIONS):
            weighted = fit.jacobian * fit.weight[:, None]
            normal = fit.jacobian.T @ weighted
            damped = normal + damping * np.diag(np.diag(normal))
            step = np.linalg.solve(damped, weighted.T @ fit.residual)
            pose, blur = fit.pose.copy(), float(np.clip(fit.blur + step[6], *BLUR_RANGE_PX))
            pose[:3, :3] = Rotation.from_rotvec(step[:3]).as_matrix() @ fit.pose[:3, :3]
            pose[:3, 3] += step[3:6]
            tried = self._fit(seen, pose, blur, occluded)
            gain = 1 - tried.cost / fit.cost
            damping *= DAMPED_LESS if gain >= 0 else DAMPED_MORE
            fit = tried if gain >= 0 else fit
            size = np.abs(step[:6]).max()
            small = size < CONVERGED_RAD_M and damping <= FIRST_DAMPING
            # Pixels that come and go at the limit of what is hidden leave no smooth minimum.
            small |= FIRST_DAMPING < damping and size * (1 + damping) < RESTLESS_RAD_M
            if small or 0 <= gain < CONVERGED_GAIN:
                return fit, True
        return fit, False

    def _result(self, fit: _Fit, start: NDArray, points: NDArray) -> MarkerPose | None:
        """The pose, if it looks like the target near where it was looked for."""
        left = np.sqrt(fit.variance) / max(fit.contrast, 1e-9)
        if left > MOST_LEFT or fit.contrast < LEAST_CONTRAST or fit.weight.mean() < LEAST_SEEN:
            return None
        before, after = (
            self.camera.project(points @ pose[:3, :3].T + pose[:3, 3]) for pose in (start, fit.pose)
        )
        if not np.abs(after - before).max() < FARTHEST_PX:
            return None
        # Of the samples' noise, and of what all edges are off together.
        noise = np.linalg.inv(fit.jacobian.T @ (fit.jacobian * fit.weight[:, None]))[:6, :6]
        edges = corner_cofactor(points, fit.pose, self.camera)
        covariance = noise * fit.variance + edges * self.systematic_px**2
        return MarkerPose(fit.pose, covariance, refined=True)

    def _pixels(self, grey: NDArray, pose: NDArray, hidden: NDArray | None) -> _Pixels | None:
        """Pixels near the edges inside the target, and some of the flat ones."""
        (left, top), (right, bottom) = self.outline
        outline = np.array([[left, top], [right, top], [left, bottom], [right, bottom]])
        corners = np.column_stack([outline * self.unit_m, np.zeros(4)])
        places = corners @ pose[:3, :3].T + pose[:3, 3]
        if places[:, 2].min() <= 0:
            return None
        pixels = self.camera.project(places)
        low = np.floor(pixels.min(axis=0)).astype(int).clip(0)
        high = np.ceil(pixels.max(axis=0)).astype(int) + 1
        box = slice(low[1], high[1]), slice(low[0], high[0])
        rays = self.rays[box].reshape(-1, 3)
        u, v, w, inverse = self._place(rays, pose)
        inside = (u > left + RIM) & (u < right - RIM) & (v > top + RIM) & (v < bottom - RIM)
        sizes = pixel_sizes(u, v, w, inverse, self.camera)
        away = _to_nearest(u, self.print.u) / sizes[0], _to_nearest(v, self.print.v) / sizes[1]
        inside &= ~(np.minimum(*away) > EDGE_PX) | (np.arange(len(u)) % FLAT_STEP == 0)
        if hidden is not None and hidden.any():
            corners = cKDTree(self.points[:, :2] / self.unit_m)
            inside[inside] = ~hidden[corners.query(np.column_stack([u, v])[inside])[1]]
        if inside.sum() < FEWEST_PIXELS:
            return None
        # A column for all but the first of the sites that occur.
        sites = self.sites[box].ravel()[inside]
        others = (sites[:, None] == np.unique(sites)[1:]).astype(float)
        return _Pixels(rays[inside], grey[box].ravel()[inside].astype(float), others)

    def _place(self, rays: NDArray, pose: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Target's coordinates u, v [units] of rays, their scale, and the inverse homography."""
        M = pose[:3, [0, 1, 3]] * [self.unit_m, self.unit_m, 1]
        inverse = np.linalg.inv(M)
        w = rays @ inverse.T
        return w[:, 0] / w[:, 2], w[:, 1] / w[:, 2], w[:, 2], inverse

    def _fit(self, seen: _Pixels, pose: NDArray, blur: float, occluded: float) -> _Fit:
        """Shading that fits a pose best, what is left, and the derivatives."""
        u, v, w, inverse = self._place(seen.rays, pose)
        turned = place_derivatives(u, v, w, inverse, pose, self.unit_m)
        pixel = pixel_sizes(u, v, w, inverse, self.camera)
        white, *by_place, by_blur_u, by_blur_v = self.print.blurred(
            u, v, *(blur * p for p in pixel)
        )
        bend = white * (1 - white)
        ramp = np.column_stack([np.ones_like(u), u, v, seen.sites])
        count = ramp.shape[1]
        # Cameras don't store brightness in proportion: between black and white it is bent.
        basis = np.column_stack([ramp, white[:, None] * ramp, bend, bend * (1 - 2 * white)])
        shading, weight = _shading(basis, seen.values, occluded)
        gain = ramp @ shading[count : 2 * count]
        gain += shading[-2] * (1 - 2 * white) + shading[-1] * (1 - 6 * bend)
        by_u, by_v = (by[:, None] * turn for by, turn in zip(by_place, turned, strict=True))
        by_pose = gain[:, None] * (by_u + by_v)
        by_blur = gain * (by_blur_u * pixel[0] + by_blur_v * pixel[1])
        model = basis @ shading
        contrast = np.ptp(model)
        limit = occluded * contrast
        residual = np.clip(seen.values - model, -limit, limit)
        jacobian = np.hstack([by_pose, by_blur[:, None], basis])
        return _Fit(pose, blur, residual, weight, jacobian, contrast)


def _to_nearest(place: NDArray, lines: NDArray) -> NDArray:
    """Distance of places (n,) to the nearest of lines."""
    ends = np.concatenate([[-np.inf], lines, [np.inf]])
    after = np.searchsorted(ends, place)
    return np.minimum(place - ends[after - 1], ends[after] - place)


def _shading(basis: NDArray, values: NDArray, occluded: float) -> tuple[NDArray, NDArray]:
    """Coefficients of the shading without what is before the target, and the pixels' weights."""
    weight = np.ones(len(values))
    for _ in range(SHADING_PASSES):
        weighted = basis.T * weight
        shading = np.linalg.solve(weighted @ basis, weighted @ values)
        model = basis @ shading
        weight = (np.abs(values - model) < occluded * np.ptp(model)).astype(float)
    return shading, weight
