"""Refine a board's pose on the brightness of all its pixels instead of its few corners.

Corners use a few pixels each; the tilt of a small board seen nearly square-on is then poorly
known, and the tip lies a board's length away from the board. The picture of all that is printed,
outer squares and tags included, knows the tilt two to three times better.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.vision.board import FlatBoard, pixel_sizes, place_derivatives
from palpate.vision.camera import PinholeCamera, pixel_rays
from palpate.vision.pose import corner_cofactor

# The rim of what is printed is left out: what lies beyond the board is not known [units].
RIM = 0.12
FEWEST_PIXELS = 200
ITERATIONS = 25
FIRST_DAMPING, DAMPED_LESS, DAMPED_MORE = 1e-3, 0.1, 10.0
CONVERGED_RAD_M, CONVERGED_GAIN, RESTLESS_RAD_M = 5e-6, 1e-6, 3e-5
BLUR_PX, BLUR_RANGE_PX = 0.8, (0.3, 3.0)
# Residuals beyond this part of the contrast are something before the board: at first, when edges
# may be a pixel off, and in the end.
OCCLUDED = 0.4, 0.12
SHADING_PASSES = 2
# Pixels farther than this from all edges only tell the shading: every so many of them is used.
EDGE_PX, FLAT_STEP = 3.0, 16
# What edges are off beyond their noise, as corners would be [px]: lenses and prints are not ideal,
# and filling in a mosaic shifts edges further.
SYSTEMATIC_PX, FILLED_IN_PX = 0.015, 0.04
# A fit says nothing when it leaves more of the contrast, when the contrast is no more than this
# [grey levels], when less of the board is seen, or when it ends farther from the start [px].
MOST_LEFT, LEAST_CONTRAST, LEAST_SEEN, FARTHEST_PX = 0.03, 20.0, 0.75, 3.0


@dataclass(frozen=True)
class PhotometricPose:
    """A refined pose.

    Attributes
    ----------
    camera_from_marker : (4, 4) array
        Rigid transform [m].
    covariance : (6, 6) array
        Of a rotation vector applied in the camera frame and the origin's place [rad, m].
    """

    camera_from_marker: NDArray
    covariance: NDArray


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
        """Sum of the squared residuals, those beyond the limit counted at it."""
        return float(self.residual @ self.residual)

    @property
    def variance(self) -> float:
        """Of a grey level about the model, hidden pixels left out."""
        freedom = max(self.weight.sum() - self.jacobian.shape[1], 1)
        return float((self.weight * self.residual**2).sum() / freedom)

    @property
    def left(self) -> float:
        """Root mean square residual as a part of the contrast."""
        return float(np.sqrt(self.variance) / max(self.contrast, 1e-9))


class BoardRefiner:
    """Least-squares fit of pose, blur and shading of a printed board to an image.

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
        self.mosaic, self.sampled = encoding == "bayer_rggb8", encoding != "rgb8"
        self.points, self.print = board.points_m, board.print
        # Least and largest u, v [units].
        self.outline = board.outline_m / board.unit_m
        grid = pixel_rays(camera)
        self.rays = grid.reshape(camera.height_px, camera.width_px, 3)
        y, x = np.mgrid[: camera.height_px, : camera.width_px]
        self.sites = (2 * (y % 2) + x % 2).astype(np.uint8)

    def __call__(
        self, grey: NDArray, start: NDArray, hidden: NDArray | None = None
    ) -> PhotometricPose | None:
        """Refine a pose.

        Parameters
        ----------
        grey : (h, w) uint8 array
            Grey image, or mosaic.
        start : (4, 4) array
            camera_from_marker within about a pixel of the truth.
        hidden : (n,) bool array, optional
            Corners that something hides: the board is not looked at about them.

        Returns
        -------
        PhotometricPose or None
            None where too little of the board is in the image, the fit does not converge, or what
            it found does not look like the board or lies far from the start.
        """
        seen = self._pixels(grey, start, hidden)
        if seen is None:
            return None
        rough, _ = self._iterated(seen, start.copy(), BLUR_PX, OCCLUDED[0])
        fit, done = self._iterated(seen, rough.pose, rough.blur, OCCLUDED[1])
        points = self.points if hidden is None else self.points[~hidden]
        if not done or not self._believable(fit, start, points):
            return None
        return self._result(fit, points)

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
            size = np.abs(step[:6]).max()
            small = size < CONVERGED_RAD_M and damping <= FIRST_DAMPING
            # Pixels that come and go at the limit of what is hidden leave no smooth minimum.
            small |= FIRST_DAMPING < damping and size * (1 + damping) < RESTLESS_RAD_M
            if small or 0 <= gain < CONVERGED_GAIN:
                return fit, True
        return fit, False

    def _believable(self, fit: "_Fit", start: NDArray, points: NDArray) -> bool:
        """Whether a fit looks like the board, near where it was looked for."""
        if fit.left > MOST_LEFT or fit.contrast < LEAST_CONTRAST or fit.weight.mean() < LEAST_SEEN:
            return False
        before, after = (
            self.camera.project(points @ pose[:3, :3].T + pose[:3, 3]) for pose in (start, fit.pose)
        )
        return bool(np.abs(after - before).max() < FARTHEST_PX)

    def _result(self, fit: "_Fit", points: NDArray) -> PhotometricPose:
        """The pose with its covariance: the samples' noise, and what all edges are off together."""
        noise = np.linalg.inv(fit.jacobian.T @ (fit.jacobian * fit.weight[:, None]))[:6, :6]
        systematic_px = SYSTEMATIC_PX if self.sampled else FILLED_IN_PX
        edges = corner_cofactor(points, fit.pose, self.camera)
        covariance = noise * fit.variance + edges * systematic_px**2
        return PhotometricPose(fit.pose, covariance)

    def _pixels(self, grey: NDArray, pose: NDArray, hidden: NDArray | None) -> "_Pixels | None":
        """Pixels near the edges inside the board, and some of the flat ones."""
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
        rays, values = self.rays[box].reshape(-1, 3), grey[box].ravel()
        sites = (self.sites[box] if self.mosaic else np.zeros_like(grey[box])).ravel()
        u, v, w, inverse = self._place(rays, pose)
        inside = (u > left + RIM) & (u < right - RIM) & (v > top + RIM) & (v < bottom - RIM)
        sizes = pixel_sizes(u, v, w, inverse, self.camera)
        away = [
            _to_nearest(place, lines) / size
            for place, lines, size in zip((u, v), (self.print.u, self.print.v), sizes, strict=True)
        ]
        flat = np.minimum(*away) > EDGE_PX
        inside &= ~flat | (np.arange(len(u)) % FLAT_STEP == 0)
        if hidden is not None and hidden.any():
            inside[inside] = self._in_sight(u[inside], v[inside], hidden)
        if inside.sum() < FEWEST_PIXELS:
            return None
        return _Pixels(rays[inside], values[inside].astype(float), _one_hot(sites[inside]))

    def _in_sight(self, u: NDArray, v: NDArray, hidden: NDArray) -> NDArray:
        """Whether the corner that is nearest to each place is seen."""
        nearest = cKDTree(self.points[:, :2] / self.unit_m).query(np.column_stack([u, v]))[1]
        return ~hidden[nearest]

    def _place(self, rays: NDArray, pose: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Board coordinates u, v [units] of rays, their scale, and the inverse homography."""
        M = pose[:3, [0, 1, 3]] * [self.unit_m, self.unit_m, 1]
        inverse = np.linalg.inv(M)
        w = rays @ inverse.T
        return w[:, 0] / w[:, 2], w[:, 1] / w[:, 2], w[:, 2], inverse

    def _fit(self, seen: "_Pixels", pose: NDArray, blur: float, occluded: float) -> "_Fit":
        """Shading that fits a pose best, what is left, and the derivatives.

        Cameras don't store brightness in proportion: what lies between black and white is bent by
        two terms more than a straight line has.
        """
        u, v, w, inverse = self._place(seen.rays, pose)
        turned = place_derivatives(u, v, w, inverse, pose, self.unit_m)
        pixel = pixel_sizes(u, v, w, inverse, self.camera)
        seen_so = self.print.blurred(u, v, blur * pixel[0], blur * pixel[1])
        white = seen_so.white
        bend = white * (1 - white)
        ramp = np.column_stack([np.ones_like(u), u, v])
        ramp = np.hstack([ramp, seen.sites])
        count = ramp.shape[1]
        basis = np.column_stack([ramp, white[:, None] * ramp, bend, bend * (1 - 2 * white)])
        shading, weight = _shading(basis, seen.values, occluded)
        gain = ramp @ shading[count : 2 * count]
        gain += shading[-2] * (1 - 2 * white) + shading[-1] * (1 - 6 * bend)
        by_pose = gain[:, None] * (
            seen_so.by_u[:, None] * turned[0] + seen_so.by_v[:, None] * turned[1]
        )
        by_blur = gain * (seen_so.by_blur_u * pixel[0] + seen_so.by_blur_v * pixel[1])
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


def _moved(pose: NDArray, step: NDArray) -> NDArray:
    moved = pose.copy()
    moved[:3, :3] = Rotation.from_rotvec(step[:3]).as_matrix() @ pose[:3, :3]
    moved[:3, 3] += step[3:]
    return moved
