"""Optics, transform and board poses as one least-squares problem (Section 4.1.4)."""

from collections.abc import Container, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from palpate.vision.camera import PinholeCamera

OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")
TERMS = ("k1", "k2", "p1", "p2", "k3")
LENS, POSE = len(OPTICS) + len(TERMS), 6
# projectPoints' derivatives: turn, shift, focal lengths, centre, distortion.
POSE_COLUMNS, LENS_COLUMNS = slice(0, POSE), slice(POSE, POSE + LENS)


@dataclass(frozen=True)
class Sight:
    """A board in one camera's picture.

    Attributes
    ----------
    view : str
    camera : int
        0 or 1.
    paired : bool
        Whether the pose is the one that both cameras share.
    corners_px : (n, 2) array
        In the board's order; NaN for those that don't count.
    """

    view: str
    camera: int
    paired: bool
    corners_px: NDArray

    @property
    def board(self) -> tuple[str, int]:
        """Which pose it is: a paired one is in the first camera's frame."""
        return self.view, 0 if self.paired else self.camera

    @property
    def through(self) -> bool:
        """Whether the transform between the cameras is part of the way."""
        return self.paired and self.camera == 1

    @cached_property
    def seen(self) -> NDArray:
        """Whether a corner counts, shape (n,)."""
        return np.isfinite(self.corners_px).all(axis=1)


@dataclass(frozen=True)
class Bundle:
    """All sights of a board by one or two cameras.

    The unknowns are nine numbers of each camera, of two cameras the second's transform from the
    first (turn as a rotation vector [rad], shift [m]), and each board's pose alike.

    Attributes
    ----------
    points_m : (n, 3) array
        The board's corners.
    sights : tuple of Sight
    sigma_px : tuple of float
        Standard deviation of a coordinate of a corner, by camera.
    terms : tuple
        Names of the distortion's free terms, by camera.
    """

    points_m: NDArray
    sights: tuple[Sight, ...]
    sigma_px: tuple[float, ...]
    terms: tuple[tuple[str, ...], ...]

    @property
    def shared(self) -> int:
        """Number of unknowns before the poses'."""
        cameras = len(self.sigma_px)
        return LENS * cameras + POSE * (cameras - 1)

    @cached_property
    def boards(self) -> dict[tuple[str, int], slice]:
        """Where each pose stands among the unknowns."""
        keys = dict.fromkeys(sight.board for sight in self.sights)
        return {
            key: slice(self.shared + POSE * k, self.shared + POSE * (k + 1))
            for k, key in enumerate(keys)
        }

    @cached_property
    def free(self) -> NDArray:
        """Places of the unknowns that are fitted."""
        fitted = np.ones(self.shared + POSE * len(self.boards), dtype=bool)
        for camera, kept in enumerate(self.terms):
            lens = fitted[LENS * camera : LENS * (camera + 1)]
            lens[len(OPTICS) :] = [term in kept for term in TERMS]
        return np.flatnonzero(fitted)

    def pack(
        self,
        lenses: tuple[NDArray, ...],
        poses: Mapping[tuple[str, int], NDArray],
        transform: NDArray | None = None,
    ) -> NDArray:
        """Unknowns from their parts; dropped terms become 0."""
        x = np.zeros(self.shared + POSE * len(self.boards))
        for camera, lens in enumerate(lenses):
            x[LENS * camera : LENS * (camera + 1)] = lens
        if transform is not None:
            x[self.shared - POSE : self.shared] = transform
        for key, place in self.boards.items():
            x[place] = poses[key]
        packed = np.zeros_like(x)
        packed[self.free] = x[self.free]
        return packed

    def without(self, views: Container[str]) -> "Bundle":
        """The bundle without some views."""
        return replace(self, sights=tuple(s for s in self.sights if s.view not in views))

    def taken(self, other: "Bundle", x: NDArray) -> NDArray:
        """Another bundle's unknowns as this one's, which has fewer boards or terms."""
        part = np.zeros(self.shared + POSE * len(self.boards))
        part[: self.shared] = x[: self.shared]
        for key, place in self.boards.items():
            part[place] = x[other.boards[key]]
        return part * np.isin(np.arange(part.size), self.free)

    def pose(self, x: NDArray, sight: Sight) -> NDArray:
        """A board's pose in the camera of a sight: turn and shift, shape (6,)."""
        pose = x[self.boards[sight.board]]
        return composed(pose, self.transform(x))[0] if sight.through else pose

    def lens(self, x: NDArray, camera: int) -> NDArray:
        """The nine numbers of a camera."""
        return x[LENS * camera : LENS * (camera + 1)]

    def transform(self, x: NDArray) -> NDArray:
        """Second camera from the first: turn and shift, shape (6,)."""
        return x[self.shared - POSE : self.shared]

    def off_px(self, x: NDArray) -> list[NDArray]:
        """Residuals of each sight's corners (n, 2) [px]; NaN for those that don't count."""
        return [self._project(x, sight)[0] - sight.corners_px for sight in self.sights]

    def residuals(self, x: NDArray) -> NDArray:
        """Residuals of all corners that count, in standard deviations."""
        return np.concatenate(
            [
                (off[sight.seen] / self.sigma_px[sight.camera]).ravel()
                for off, sight in zip(self.off_px(x), self.sights, strict=True)
            ]
        )

    def jacobian(self, x: NDArray) -> csr_array:
        """Derivatives of the residuals by the free unknowns."""
        entries, columns = zip(*(self.block(x, sight) for sight in self.sights), strict=True)
        ends = np.cumsum([len(block) for block in entries])
        rows = [
            np.repeat(np.arange(end - len(block), end), block.shape[1])
            for end, block in zip(ends, entries, strict=True)
        ]
        places = [np.tile(at, len(block)) for at, block in zip(columns, entries, strict=True)]
        values = np.concatenate([block.ravel() for block in entries])
        where = np.concatenate(rows), np.concatenate(places)
        return coo_array((values, where), shape=(ends[-1], x.size)).tocsr()[:, self.free]

    def block(self, x: NDArray, sight: Sight) -> tuple[NDArray, NDArray]:
        """Derivatives of one sight's residuals (2 m, k), and the places of their unknowns (k,)."""
        _, by, chain = self._project(x, sight, derivatives=True)
        by = by.reshape(-1, 2, by.shape[1])[sight.seen].reshape(-1, by.shape[1])
        by = by / self.sigma_px[sight.camera]
        lens = np.arange(LENS * sight.camera, LENS * (sight.camera + 1))
        pose = np.arange(len(x))[self.boards[sight.board]]
        if chain is None:
            return np.hstack([by[:, LENS_COLUMNS], by[:, POSE_COLUMNS]]), np.r_[lens, pose]
        of_pose, of_transform = chain
        parts = [by[:, LENS_COLUMNS], by[:, POSE_COLUMNS] @ of_transform, by[:, :POSE] @ of_pose]
        place = np.arange(self.shared - POSE, self.shared)
        return np.hstack(parts), np.r_[lens, place, pose]

    def _project(self, x: NDArray, sight: Sight, *, derivatives: bool = False) -> tuple:
        """Pixels of all corners; their derivatives by pose and lens, and the pose's own."""
        pose, chain = x[self.boards[sight.board]], None
        if sight.through:
            pose, chain = composed(pose, self.transform(x))
        lens = self.lens(x, sight.camera)
        camera = PinholeCamera(0, 0, *lens[:4], distortion=tuple(lens[4:]))
        pixels, by = cv2.projectPoints(
            self.points_m, pose[:3], pose[3:], camera.matrix, np.array(camera.distortion)
        )
        return (pixels.reshape(-1, 2), by, chain) if derivatives else (pixels.reshape(-1, 2),)


def composed(pose: NDArray, transform: NDArray) -> tuple[NDArray, tuple[NDArray, NDArray]]:
    """A pose after a transform, and its derivatives (6, 6) by the one and the other."""
    parts = [part.reshape(3, 1) for part in (pose[:3], pose[3:], transform[:3], transform[3:])]
    turn, shift, *by = cv2.composeRT(*parts)
    matrices = np.array(by).reshape(2, 4, 3, 3)  # turn and shift by each of the four parts
    by_pose = np.block([[part[0], part[1]] for part in matrices])
    by_transform = np.block([[part[2], part[3]] for part in matrices])
    return np.concatenate([turn, shift]).ravel(), (by_pose, by_transform)
