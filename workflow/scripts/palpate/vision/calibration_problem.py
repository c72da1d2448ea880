"""Views of a board as one least-squares problem: lenses, transform and poses (Section 4.1.4)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.camera import OPTICS, PinholeCamera

TERMS = ("k1", "k2", "p1", "p2", "k3")
PARAMETERS = (*OPTICS, *TERMS)
LENS, POSE = len(PARAMETERS), 6
# Where Huber's loss leaves the parabola, in standard deviations: few good corners lie beyond.
ROBUST_FROM = 2.0
# A step that does not bring the residuals down is tried in parts.
MOST_STEPS, PARTS_OF_STEP = 50, (1.0, 0.25, 0.06, 0.015)
# A step that moves the projected corners by less than this in all, in deviations, is the last.
LAST_STEP = 1e-3
# Of a scaled normal matrix: below, an eigenvalue is what rounding leaves. An unknown is not
# determined if it has more than this part in such a direction.
SMALLEST, SHARE_LOST = 1e-10, 1e-3
# Of corners with normal errors: the median distance over the standard deviation of a coordinate.
MEDIAN_DISTANCE = np.sqrt(2 * np.log(2))
# Below this, corners are exact: rounding, and the noise of no picture.
LEAST_SIGMA_PX = 1e-4
# Coordinates less unknowns over coordinates: fewer would be no measure of anything.
LEAST_SPARE = 0.1
# A corner is an outlier beyond this many standard deviations of a coordinate: of 100,000 good ones
# 4 are. A view that would lose more than a part of its corners keeps them all: its pose may be
# wrong.
CORNER_FACTOR, LARGEST_SHARE_LOST = 4.5, 0.4
FEWEST_CORNERS = 8


@dataclass(frozen=True)
class Problem:
    """All views of a board by one or two cameras, and where the unknowns are."""

    points_m: NDArray  # (n, 3), the board's corners
    names: Sequence[str]  # of the views
    # (views, 6), turn [rad] and shift [m] of the board in the frame of the first camera to see it
    poses: NDArray
    # (views, cameras, n, 2), corners that were found, and those that count; NaN for the others
    found_px: NDArray
    corners_px: NDArray
    # nine numbers of each camera and, of two, the second's transform from the first
    shared: NDArray
    terms: tuple[tuple[str, ...], ...]  # names of the distortion's free terms, by camera
    sigma_px: NDArray  # (cameras,), standard deviation of a coordinate of a corner
    sizes_px: tuple[tuple[int, int], ...]  # of the pictures, by camera

    @property
    def free(self) -> NDArray:
        """Which of the shared unknowns are fitted."""
        lenses = [[name in (*OPTICS, *kept) for name in PARAMETERS] for kept in self.terms]
        return np.r_[np.ravel(lenses), np.ones(self.shared.size - LENS * len(lenses))].astype(bool)

    @property
    def seen(self) -> NDArray:
        """Which camera has found the board in which view, (views, cameras)."""
        return np.isfinite(self.found_px).any(axis=(2, 3))

    @property
    def transform(self) -> NDArray:
        """Second camera from the first: turn and shift, shape (6,)."""
        return self.shared[-POSE:]

    def camera(self, number: int) -> PinholeCamera:
        """Optics of a camera."""
        lens = self.shared[numbers_of(number)].tolist()
        return PinholeCamera(*self.sizes_px[number], *lens[:4], tuple(lens[4:]))

    def of_views(self, kept: NDArray) -> "Problem":
        """The problem with some of the views."""
        parts = {name: getattr(self, name)[kept] for name in ("poses", "found_px", "corners_px")}
        return replace(self, names=tuple(compress(self.names, kept)), **parts)

    def of_camera(self, number: int) -> "Problem":
        """The problem of one camera alone, with the poses in its own frame."""
        own, only = self.of_views(self.seen[:, number]), slice(number, number + 1)
        return replace(
            own,
            poses=np.array([own._placed(view, number)[0] for view in range(len(own.names))]),
            found_px=own.found_px[:, only],
            corners_px=own.corners_px[:, only],
            shared=self.shared[numbers_of(number)],
            **{name: getattr(self, name)[only] for name in ("terms", "sigma_px", "sizes_px")},
        )

    def with_terms(self, *terms: tuple[str, ...]) -> "Problem":
        """The problem with other terms of distortion; those that are dropped are 0."""
        changed = replace(self, terms=terms)
        return replace(changed, shared=np.where(changed.free, self.shared, 0.0))

    def _placed(self, view: int, camera: int) -> tuple[NDArray, tuple[NDArray, ...]]:
        """A board's pose in a camera, and its derivatives if they are not those of the view's."""
        first = np.isfinite(self.found_px[view]).any(axis=(1, 2)).argmax()
        pose = self.poses[view]
        return (pose, ()) if camera == first else _composed(pose, self.transform)

    def _projected(self, view: int, camera: int) -> tuple[NDArray, NDArray, NDArray]:
        """Projected less found corners (2 n,) [px], and derivatives by shared unknowns and pose."""
        optics, (pose, chain) = self.camera(camera), self._placed(view, camera)
        lens = optics.matrix, np.array(optics.distortion)
        pixels, by = cv2.projectPoints(self.points_m, pose[:3], pose[3:], *lens)
        by_pose, shared = by[:, :POSE], np.zeros((len(by), self.shared.size))
        shared[:, numbers_of(camera)] = by[:, POSE:]
        if chain:
            shared[:, -POSE:], by_pose = by_pose @ chain[1], by_pose @ chain[0]
        return (pixels[:, 0] - self.corners_px[view, camera]).ravel(), shared, by_pose

    def linearised(self) -> Iterator[tuple[NDArray, NDArray, NDArray]]:
        """Each view's residuals (m,), and derivatives by the free shared unknowns and the pose.

        All are in standard deviations; a corner that counts has two rows.
        """
        for view, seen in enumerate(self.seen):
            parts = []
            for camera in np.flatnonzero(seen):
                off, shared, by_pose = self._projected(view, camera)
                counts, rows = np.isfinite(off), (off, shared[:, self.free], by_pose)
                parts.append([part[counts] / self.sigma_px[camera] for part in rows])
            yield tuple(np.concatenate(part) for part in zip(*parts, strict=True))

    def residuals(self) -> NDArray:
        """Of all corners that count, in standard deviations."""
        return np.concatenate([off for off, _, _ in self.linearised()])

    def distances(self) -> NDArray:
        """Of found and projected corners, (views, cameras, n) [px]; NaN if they don't count."""
        off = np.full(self.corners_px.shape, np.nan)
        for view, camera in np.argwhere(self.seen):
            off[view, camera] = self._projected(view, camera)[0].reshape(-1, 2)
        return np.linalg.norm(off, axis=-1)

    def errors(self) -> NDArray:
        """Root mean square distances of views that all cameras see, (views, cameras) [px]."""
        return root_mean_square(self.distances(), axis=2)

    def fitted(self) -> "Problem":
        """The unknowns that fit best by Huber's loss, in weighted steps of Gauss and Newton."""
        found = self
        for _ in range(MOST_STEPS):
            rows, inner = [], []
            for off, shared, by_pose in found.linearised():
                weights = np.sqrt(ROBUST_FROM / np.maximum(np.abs(off), ROBUST_FROM))[:, None]
                outer, by_pose = weights * np.column_stack([shared, off]), weights * by_pose
                inner.append(np.linalg.pinv(by_pose) @ outer)
                rows.append(outer - by_pose @ inner[-1])
            by, off = np.split(np.concatenate(rows), [-1], axis=1)
            scale = np.linalg.norm(by, axis=0)
            step = -np.linalg.lstsq(by / scale, off[:, 0], rcond=None)[0] / scale
            moves = -np.array(inner) @ np.append(step, 1)
            last, cost, move = found, found._cost(), np.zeros(found.shared.size)
            move[found.free] = step
            ways = (
                replace(last, shared=last.shared + part * move, poses=last.poses + part * moves)
                for part in PARTS_OF_STEP
            )
            found = next((one for one in ways if one._cost() < cost), last)
            if found is last or np.linalg.norm(by @ step) < LAST_STEP:
                break
        return found

    def _cost(self) -> float:
        """Huber's loss of all residuals."""
        off = self.residuals()
        bent = np.clip(off, -ROBUST_FROM, ROBUST_FROM)
        return float(bent @ (off - bent / 2))

    def covariance(self) -> NDArray:
        """Covariance of the shared unknowns; 0 for terms that were dropped.

        That of an estimate with Huber's loss: P. J. Huber, Robust Statistics (1981), Section 7.6.
        Infinite for what the corners don't determine.
        """
        off = self.residuals()
        spare = off.size - self.free.sum() - self.poses.size
        bent, inside = np.clip(off, -ROBUST_FROM, ROBUST_FROM), np.mean(np.abs(off) < ROBUST_FROM)
        variance, normal = (bent @ bent) / spare / inside**2, 0.0
        for _, shared, by_pose in self.linearised():
            left = shared - by_pose @ (np.linalg.pinv(by_pose) @ shared)
            normal = normal + left.T @ left
        found = np.zeros((self.shared.size, self.shared.size))
        found[np.ix_(self.free, self.free)] = variance * _inverse(normal)
        return found

    def without_outliers(self) -> "Problem":
        """With those of the corners found that are near where these unknowns project them.

        The standard deviations become what its corners scatter by, but for outliers.
        """
        far = self.distances()
        unknowns = self.free.sum() + self.poses.size
        spare = max(1 - unknowns / (2 * np.isfinite(far).sum()), LEAST_SPARE)
        sigma = np.nanmedian(far, axis=(0, 2)) / MEDIAN_DISTANCE / np.sqrt(spare)
        sigma = np.maximum(sigma, LEAST_SIGMA_PX)
        far = replace(self, corners_px=self.found_px).distances()
        seen, good = np.isfinite(far), far <= CORNER_FACTOR * sigma[:, None]
        least = np.maximum(FEWEST_CORNERS, (1 - LARGEST_SHARE_LOST) * seen.sum(axis=2))
        counts = np.where((good.sum(axis=2) >= least)[..., None], good, seen)
        corners = np.where(counts[..., None], self.found_px, np.nan)
        return replace(self, corners_px=corners, sigma_px=sigma)

    def counts_as(self, other: "Problem") -> bool:
        """Whether the same corners count as in another problem of the same views."""
        return np.array_equal(np.isnan(self.corners_px), np.isnan(other.corners_px))


def numbers_of(camera: int) -> slice:
    """Where a camera's nine numbers are among the shared unknowns."""
    return slice(LENS * camera, LENS * (camera + 1))


def _composed(pose: NDArray, transform: NDArray) -> tuple[NDArray, tuple[NDArray, NDArray]]:
    """A pose after a transform, and its derivatives (6, 6) by the one and the other."""
    parts = [part.reshape(3, 1) for part in (pose[:3], pose[3:], transform[:3], transform[3:])]
    turn, shift, *by = cv2.composeRT(*parts)
    matrices = np.array(by).reshape(2, 4, 3, 3)  # turn and shift by each of the four parts
    chain = tuple(np.block([[part[k], part[k + 1]] for part in matrices]) for k in (0, 2))
    return np.concatenate([turn, shift]).ravel(), chain


def _inverse(normal: NDArray) -> NDArray:
    """Inverse of a normal matrix; infinite variances where it has none."""
    scale = np.sqrt(np.diag(normal))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    kept = values > SMALLEST
    inner = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    lost = (np.abs(vectors[:, ~kept]) > SHARE_LOST).any(axis=1)
    inner[lost, lost] = np.inf
    return inner / np.outer(scale, scale)


def matrix_of(pose: NDArray) -> NDArray:
    """Turn and shift as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = cv2.Rodrigues(pose[:3])[0]
    matrix[:3, 3] = pose[3:]
    return matrix


def vector_of(matrix: NDArray) -> NDArray:
    """A matrix (4, 4) as turn and shift."""
    return np.concatenate([cv2.Rodrigues(matrix[:3, :3])[0].ravel(), matrix[:3, 3]])


def root_mean_square(values: NDArray, axis: int | None = None) -> NDArray:
    """Root mean square of distances, but for those that are NaN."""
    return np.sqrt(np.nanmean(np.square(values), axis=axis))
