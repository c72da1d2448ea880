"""Two cameras and the transform between them in one refinement (Section 4.1.4, Eq. 4.11)."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.calibration import (
    FEWEST_VIEWS,
    MOST_ROUNDS,
    WORST_SHARE,
    Calibration,
    calibrate_camera,
    fewer_terms,
)
from palpate.vision.calibration_problem import (
    POSE,
    Problem,
    matrix_of,
    numbers_of,
    root_mean_square,
    vector_of,
)
from palpate.yaml_files import mismatch

# A pair of pictures disagrees beyond this many times what the corners of each camera scatter by.
PAIR_FACTOR = 3.0
SETTLED = 0.02


@dataclass(frozen=True)
class PairCalibration:
    """Two cameras and the transform between them."""

    fit: Problem = field(repr=False)  # of both
    # (24, 24), of both cameras' nine numbers, and of the transform
    covariance: NDArray = field(repr=False)
    cameras: tuple[Calibration, Calibration]  # as the pairs determine them too
    rejected: Mapping[str, str]  # view whose two pictures are of different moments, to the reason

    @property
    def second_from_first(self) -> NDArray:
        """The transform, (4, 4)."""
        return matrix_of(self.fit.transform)

    @property
    def transform_covariance(self) -> NDArray:
        """Of the transform's rotation vector [rad] and translation [m], shape (6, 6)."""
        return self.covariance[-POSE:, -POSE:]

    @property
    def standard_errors(self) -> dict[str, list[float]]:
        """Of the transform's rotation vector [rad] and translation [m]."""
        errors = np.sqrt(np.diag(self.transform_covariance)).tolist()
        return {"rotation_rad": errors[:3], "translation_m": errors[3:]}

    @property
    def baseline_m(self) -> float:
        """Distance of the cameras."""
        return float(np.linalg.norm(self.second_from_first[:3, 3]))

    @property
    def baseline_error_m(self) -> float:
        """Standard error of the cameras' distance."""
        way = self.second_from_first[:3, 3] / self.baseline_m
        return float(np.sqrt(way @ self.transform_covariance[3:, 3:] @ way))

    @property
    def errors_px(self) -> dict[str, list[float]]:
        """View to the root mean square residuals in both cameras."""
        pairs = _pairs(self.fit)
        return dict(zip(pairs.names, pairs.errors().tolist(), strict=True))

    @property
    def rms_px(self) -> float:
        """Root mean square residual of the pairs' corners in both cameras."""
        return float(root_mean_square(_pairs(self.fit).distances()))


def calibrate_pair(
    first: Mapping[str, NDArray],
    second: Mapping[str, NDArray],
    board: FlatBoard,
    sizes_px: tuple[tuple[int, int], tuple[int, int]],
    *,
    names: tuple[str, str] = ("first camera", "second camera"),
) -> PairCalibration:
    """Optics of two cameras and the transform between them, all from one refinement.

    Views of one camera alone count for its optics. A view whose two pictures are of different
    moments counts for each camera and not for the transform; nor does one of a board that looks the
    same after half a turn whose pictures were ordered from opposite ends.

    Parameters
    ----------
    first, second : mapping
        View to its corners in each camera (n, 2) [px] in the board's order; NaN for those not
        seen.
    board : FlatBoard
    sizes_px : two of (width, height)
    names : two of str
        What errors call the cameras.

    Raises
    ------
    ValueError
        If a camera's views don't determine its optics, too few views are seen by both, or most
        pairs disagree.
    """
    alone = [
        calibrate_camera(seen, board, size, name=name)
        for seen, size, name in zip((first, second), sizes_px, names, strict=True)
    ]
    shared = [view for view in alone[0].fit.names if view in alone[1].fit.names]
    if len(shared) < FEWEST_VIEWS:
        expected = f"at least {FEWEST_VIEWS} views of the board that both cameras see"
        raise mismatch("calibration", expected, len(shared))
    # The one that a single pair gives and to which most others are near.
    poses, other = (np.array([one.camera_from_board[v] for v in shared]) for one in alone)
    single = other @ np.linalg.inv(poses)
    shifts, turns = single[:, :3, 3] / np.median(poses[:, 2, 3]), single[:, :3, :3]
    cosines = (np.tensordot(turns, turns, ((1, 2), (1, 2))) - 1) / 2
    apart = np.linalg.norm(shifts[:, None] - shifts, axis=2) + np.arccos(np.clip(cosines, -1, 1))
    transform = vector_of(single[np.median(apart, axis=1).argmin()])
    rejected: dict[str, str] = {}
    while True:
        pairs = [view for view in shared if view not in rejected]
        fit = _settled(_joined(*(found.fit for found in alone), transform, pairs))
        bad = _disagreeing(fit)
        if not bad:
            break
        rejected |= bad
        if len(shared) - len(rejected) < max(FEWEST_VIEWS, len(shared) / 2):
            order = "of a board that has one order (one odd and one even number of corners), "
            raise ValueError(
                f"calibration: expected pairs taken at one moment, {order * board.ambiguous}"
                f"found {len(rejected)} or more of {len(shared)} that disagree"
                f" ({next(iter(rejected.values()))})"
            )
    spread = fit.covariance()
    cameras = tuple(
        Calibration(fit.of_camera(k), spread[numbers_of(k), numbers_of(k)], alone[k].rejected)
        for k in (0, 1)
    )
    return PairCalibration(fit, spread, cameras, rejected)


def _joined(a: Problem, b: Problem, transform: NDArray, pairs: Collection[str]) -> Problem:
    """The views that each camera kept, at its own poses; pairs have one pose."""
    count = len(a.names)
    names = (*a.names, *(view for view in b.names if view not in pairs))
    rows = [names.index(view, 0 if view in pairs else count) for view in b.names]
    poses = np.zeros((len(names), POSE))
    poses[rows], poses[:count] = b.poses, a.poses
    # Found and those that count, of view and camera.
    corners = np.full((2, len(names), 2, len(a.points_m), 2), np.nan)
    corners[:, :count, 0] = a.found_px[:, 0], a.corners_px[:, 0]
    corners[:, rows, 1] = b.found_px[:, 0], b.corners_px[:, 0]
    sigma_px, shared = np.r_[a.sigma_px, b.sigma_px], np.r_[a.shared, b.shared, transform]
    rest = shared, a.terms + b.terms, sigma_px, a.sizes_px + b.sizes_px
    return Problem(a.points_m, names, poses, *corners, *rest)


def _pairs(fit: Problem) -> Problem:
    """The views that both cameras see."""
    return fit.of_views(fit.seen.all(axis=1))


def _settled(fit: Problem) -> Problem:
    """Fit both cameras until outliers and terms stay the same, or pairs disagree."""
    for _ in range(MOST_ROUNDS):
        fit = fit.fitted()
        if _disagreeing(fit):
            break
        terms = tuple(fewer_terms(fit, camera) for camera in (0, 1))
        part = fit.without_outliers()
        same = part.counts_as(fit) and terms == fit.terms
        if same and np.allclose(part.sigma_px, fit.sigma_px, rtol=SETTLED):
            break
        fit = part.with_terms(*terms)
    return fit


def _disagreeing(fit: Problem) -> dict[str, str]:
    """The pairs that disagree most, with the reason; none where all agree."""
    pairs, limits = _pairs(fit), PAIR_FACTOR * np.sqrt(2) * fit.sigma_px
    errors = pairs.errors()
    times = errors / limits
    worse = times.max(axis=1) > max(1.0, WORST_SHARE * times.max())
    return {
        view: f"residual {own[k]:.2f} px as a pair, expected at most {limits[k]:.2f}"
        for view, own, k, bad in zip(pairs.names, errors, times.argmax(axis=1), worse, strict=True)
        if bad
    }
