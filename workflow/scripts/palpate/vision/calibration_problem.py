"""Views of a board as one least-squares problem: lenses, transform and poses (Section 4.1.4)."""

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")
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

# A view's name, and the first camera that sees it.
Key = tuple[str, int]


@dataclass(frozen=True)
class View:
    """A board at one pose.

    Attributes
    ----------
    pose : (6,) array
        Turn [rad] and shift [m], in the frame of the first camera that sees it.
    corners_px : dict of int to (n, 2) array
        By camera, in the board's order; NaN for those that don't count.
    """

    pose: NDArray
    corners_px: Mapping[int, NDArray]


@dataclass(frozen=True)
class Problem:
    """All views of a board by one or two cameras, and where the unknowns are.

    Attributes
    ----------
    points_m : (n, 3) array
        The board's corners.
    views : dict of (str, int) to View
    shared : array
        Nine numbers of each camera and, of two, the second's transform from the first.
    terms : tuple
        Names of the distortion's free terms, by camera.
    sigma_px : tuple of float
        Standard deviation of a coordinate of a corner, by camera.
    """

    points_m: NDArray
    views: Mapping[Key, View]
    shared: NDArray
    terms: tuple[tuple[str, ...], ...]
    sigma_px: tuple[float, ...]

    @property
    def free(self) -> NDArray:
        """Which of the shared unknowns are fitted."""
        lenses = [[name in (*OPTICS, *kept) for name in PARAMETERS] for kept in self.terms]
        return np.r_[np.ravel(lenses), np.ones(self.shared.size - LENS * len(lenses))].astype(bool)

    @property
    def transform(self) -> NDArray:
        """Second camera from the first: turn and shift, shape (6,)."""
        return self.shared[-POSE:]

    def lens(self, camera: int) -> NDArray:
        """The nine numbers of a camera."""
        return self.shared[LENS * camera : LENS * (camera + 1)]

    def pose(self, key: Key, camera: int) -> NDArray:
        """A board's pose in a camera that sees it: turn and shift, shape (6,)."""
        pose = self.views[key].pose
        return pose if camera == key[1] else composed(pose, self.transform)[0]

    def without(self, names: Container[str]) -> "Problem":
        """The problem without some views."""
        return replace(self, views={k: v for k, v in self.views.items() if k[0] not in names})

    def with_terms(self, *terms: tuple[str, ...]) -> "Problem":
        """The problem with other terms of distortion; those that are dropped are 0."""
        changed = replace(self, terms=terms)
        return replace(changed, shared=np.where(changed.free, self.shared, 0.0))

    def linearised(self, key: Key) -> tuple[NDArray, NDArray, NDArray]:
        """A view's residuals (m,), and their derivatives by the free shared unknowns and the pose.

        All are in standard deviations; a corner that counts has two rows.
        """
        parts = []
        for camera, corners in self.views[key].corners_px.items():
            lens, pose, chain = self.lens(camera), self.views[key].pose, None
            if camera != key[1]:
                pose, chain = composed(pose, self.transform)
            pixels, by = cv2.projectPoints(
                self.points_m, pose[:3], pose[3:], camera_matrix(lens), lens[OPTICS_END:]
            )
            off = (pixels[:, 0] - corners).ravel()
            counts = np.isfinite(off)
            by_pose, shared = by[:, :POSE], np.zeros((len(by), self.shared.size))
            shared[:, LENS * camera : LENS * (camera + 1)] = by[:, POSE:]
            if chain is not None:
                shared[:, -POSE:], by_pose = by_pose @ chain[1], by_pose @ chain[0]
            one = off[:, None], shared[:, self.free], by_pose
            parts.append([part[counts] / self.sigma_px[camera] for part in one])
        off, shared, by_pose = (np.concatenate(part) for part in zip(*parts, strict=True))
        return off[:, 0], shared, by_pose

    def fitted(self) -> "Problem":
        """The unknowns that fit best by Huber's loss, in weighted steps of Gauss and Newton."""
        found = self
        for _ in range(MOST_STEPS):
            rows, poses = [], {}
            for key in found.views:
                off, shared, by_pose = found.linearised(key)
                weights = np.sqrt(ROBUST_FROM / np.maximum(np.abs(off), ROBUST_FROM))
                off = weights * off
                shared, by_pose = (weights[:, None] * one for one in (shared, by_pose))
                inner = np.linalg.pinv(by_pose)
                poses[key] = inner @ off, inner @ shared
                rows.append(np.column_stack([shared - by_pose @ poses[key][1], off]))
            by, off = np.split(np.concatenate(rows), [-1], axis=1)
            scale = np.linalg.norm(by, axis=0)
            step = -np.linalg.lstsq(by / scale, off[:, 0], rcond=None)[0] / scale
            steps = {key: -to - by_shared @ step for key, (to, by_shared) in poses.items()}
            ways = (found._moved(part, step, steps) for part in PARTS_OF_STEP)
            cost = found._cost()
            better = next((one for one in ways if one._cost() < cost), None)
            found = better or found
            if better is None or np.linalg.norm(by @ step) < LAST_STEP:
                break
        return found

    def _moved(self, part: float, step: NDArray, steps: Mapping[Key, NDArray]) -> "Problem":
        """The problem after a part of a step of shared unknowns and poses."""
        shared = self.shared.copy()
        shared[self.free] += part * step
        views = {
            key: replace(view, pose=view.pose + part * steps[key])
            for key, view in self.views.items()
        }
        return replace(self, shared=shared, views=views)

    def _cost(self) -> float:
        """Huber's loss of all residuals."""
        off = np.concatenate([self.linearised(key)[0] for key in self.views])
        bent = np.clip(off, -ROBUST_FROM, ROBUST_FROM)
        return float(bent @ (off - bent / 2))

    def information(self) -> NDArray:
        """Normal matrix of the free shared unknowns, whatever the poses are."""
        total = 0.0
        for key in self.views:
            _, shared, by_pose = self.linearised(key)
            left = shared - by_pose @ (np.linalg.pinv(by_pose) @ shared)
            total = total + left.T @ left
        return total

    def covariance(self) -> NDArray:
        """Covariance of the shared unknowns; 0 for terms that were dropped.

        That of an estimate with Huber's loss: P. J. Huber, Robust Statistics (1981), Section 7.6.
        Infinite for what the corners don't determine.
        """
        off = np.concatenate([self.linearised(key)[0] for key in self.views])
        spare = off.size - self.free.sum() - POSE * len(self.views)
        bent, inside = np.clip(off, -ROBUST_FROM, ROBUST_FROM), np.mean(np.abs(off) < ROBUST_FROM)
        variance = (bent @ bent) / spare / inside**2
        found = np.zeros((self.shared.size, self.shared.size))
        found[np.ix_(self.free, self.free)] = variance * inverse(self.information())
        return found

    def distances(self) -> dict[tuple[Key, int], NDArray]:
        """Of found and projected corners, by view and camera, (n,) [px]; NaN if not counted."""
        found = {}
        for key, view in self.views.items():
            for camera, corners in view.corners_px.items():
                lens, pose = self.lens(camera), self.pose(key, camera)
                optics = camera_matrix(lens), lens[OPTICS_END:]
                pixels, _ = cv2.projectPoints(self.points_m, pose[:3], pose[3:], *optics)
                found[key, camera] = np.hypot(*(pixels[:, 0] - corners).T)
        return found

    def scatter(self) -> tuple[float, ...]:
        """Standard deviation of a corner's coordinate by camera, but for outliers [px]."""
        far = {camera: [] for camera in range(len(self.sigma_px))}
        for (_, camera), distances in self.distances().items():
            far[camera].extend(distances[np.isfinite(distances)])
        coordinates = 2 * sum(map(len, far.values()))
        unknowns = self.free.sum() + POSE * len(self.views)
        spare = max(1 - unknowns / coordinates, LEAST_SPARE)
        medians = (np.median(own) / MEDIAN_DISTANCE / np.sqrt(spare) for own in far.values())
        return tuple(max(float(one), LEAST_SIGMA_PX) for one in medians)

    def without_outliers(self, whole: "Problem") -> "Problem":
        """The corners of another problem that are near where these unknowns project them.

        The standard deviation is what this one's corners scatter by.
        """
        sigma = self.scatter()
        views = {key: replace(self.views[key], corners_px=whole.views[key].corners_px)
                 for key in self.views}  # fmt: skip
        asked = replace(self, views=views, sigma_px=sigma)
        kept = {key: dict(view.corners_px) for key, view in views.items()}
        for (key, camera), far in asked.distances().items():
            seen = np.isfinite(far)
            good = seen & (far <= CORNER_FACTOR * sigma[camera])
            if good.sum() >= max(FEWEST_CORNERS, (1 - LARGEST_SHARE_LOST) * seen.sum()):
                kept[key][camera] = np.where(good[:, None], kept[key][camera], np.nan)
        views = {key: replace(view, corners_px=kept[key]) for key, view in views.items()}
        return replace(asked, views=views)

    def counts_as(self, other: "Problem") -> bool:
        """Whether the same corners count as in another problem."""
        return all(
            np.array_equal(np.isnan(corners), np.isnan(other.views[key].corners_px[camera]))
            for key, view in self.views.items()
            for camera, corners in view.corners_px.items()
        )


OPTICS_END = len(OPTICS)


def camera_matrix(lens: NDArray) -> NDArray:
    """Camera matrix (3, 3) of a camera's nine numbers."""
    return np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])


def composed(pose: NDArray, transform: NDArray) -> tuple[NDArray, tuple[NDArray, NDArray]]:
    """A pose after a transform, and its derivatives (6, 6) by the one and the other."""
    parts = [part.reshape(3, 1) for part in (pose[:3], pose[3:], transform[:3], transform[3:])]
    turn, shift, *by = cv2.composeRT(*parts)
    matrices = np.array(by).reshape(2, 4, 3, 3)  # turn and shift by each of the four parts
    by_pose = np.block([[part[0], part[1]] for part in matrices])
    by_transform = np.block([[part[2], part[3]] for part in matrices])
    return np.concatenate([turn, shift]).ravel(), (by_pose, by_transform)


def inverse(normal: NDArray) -> NDArray:
    """Inverse of a normal matrix; infinite variances where it has none."""
    scale = np.sqrt(np.diag(normal))
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    told = values > SMALLEST
    inner = (vectors[:, told] / values[told]) @ vectors[:, told].T
    lost = (np.abs(vectors[:, ~told]) > SHARE_LOST).any(axis=1)
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


def root_mean_square(values: NDArray) -> float:
    """Root mean square of distances that are numbers; 0 of none."""
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0
