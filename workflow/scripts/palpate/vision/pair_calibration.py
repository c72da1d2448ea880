"""Two cameras and the transform between them in one refinement (Section 4.1.4, Eq. 4.11)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.calibration import (
    FEWEST_VIEWS,
    MOST_ROUNDS,
    WORST_SHARE,
    Calibration,
    calibrate_camera,
    described,
    fewer_terms,
)
from palpate.vision.calibration_problem import (
    POSE,
    Problem,
    View,
    camera_matrix,
    matrix_of,
    root_mean_square,
    vector_of,
)

# A pair of pictures disagrees beyond this many times what the corners of each camera scatter by.
PAIR_FACTOR = 3.0
# Of the angle by which views ordered alike may be apart, over that of the other order.
CLEARLY = 0.2
SETTLED = 0.02
NAMES = ("first camera", "second camera")


@dataclass(frozen=True)
class PairCalibration:
    """Two cameras and the transform between them.

    Attributes
    ----------
    cameras : (Calibration, Calibration)
        As the pairs tell them too.
    second_from_first : (4, 4) array
    shared_covariance : (24, 24) array
        Of both cameras' nine numbers, and of the transform.
    errors_px : dict
        View to the root mean square residuals in both cameras.
    rejected : dict
        View whose two pictures are of different moments, to the reason.
    rms_px : float
        Of the pairs' corners in both cameras.
    """

    cameras: tuple[Calibration, Calibration]
    second_from_first: NDArray
    shared_covariance: NDArray = field(repr=False)
    errors_px: Mapping[str, tuple[float, float]]
    rejected: Mapping[str, str]
    rms_px: float

    @property
    def covariance(self) -> NDArray:
        """Of the transform's rotation vector [rad] and translation [m], shape (6, 6)."""
        return self.shared_covariance[-POSE:, -POSE:]

    @property
    def standard_errors(self) -> dict[str, list[float]]:
        """Of the transform's rotation vector [rad] and translation [m]."""
        errors = np.sqrt(np.diag(self.covariance)).tolist()
        return {"rotation_rad": errors[:3], "translation_m": errors[3:]}

    @property
    def baseline_m(self) -> float:
        """Distance of the cameras."""
        return float(np.linalg.norm(self.second_from_first[:3, 3]))

    @property
    def baseline_error_m(self) -> float:
        """Standard error of the cameras' distance."""
        way = self.second_from_first[:3, 3] / self.baseline_m
        return float(np.sqrt(way @ self.covariance[3:, 3:] @ way))


def calibrate_pair(
    first: Mapping[str, NDArray],
    second: Mapping[str, NDArray],
    board: FlatBoard,
    sizes_px: tuple[tuple[int, int], tuple[int, int]],
    *,
    names: tuple[str, str] = NAMES,
) -> PairCalibration:
    """Optics of two cameras and the transform between them, all from one refinement.

    Views of one camera alone count for its optics. A view whose two pictures are of different
    moments counts for each camera and not for the transform. A board that looks the same after
    half a turn is ordered by the pose that both cameras agree on.

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
        If a camera's views don't tell its optics, too few views are seen by both, most pairs
        disagree, or the order of an ambiguous board can't be settled.
    """
    corners = [dict(first), dict(second)]
    alone = [
        calibrate_camera(seen, board, size, name=name)
        for seen, size, name in zip(corners, sizes_px, names, strict=True)
    ]
    shared = _shared(alone)
    if board.ambiguous:
        corners[1] |= _ordered_alike(corners, shared, board, alone)
        alone[1] = calibrate_camera(corners[1], board, sizes_px[1], name=names[1])
        shared = _shared(alone)
    transform = _most_common(alone, shared)
    lenses = np.concatenate([found.lens for found in alone])
    problem = Problem(
        board.points_m,
        {},
        np.r_[lenses, vector_of(transform)],
        tuple(found.terms for found in alone),
        tuple(found.sigma_px for found in alone),
    )
    rejected: dict[str, str] = {}
    pairs = shared
    while True:
        whole = replace(problem, views=_views(alone, corners, pairs))
        start = replace(problem, views=_views(alone, [found.corners_px for found in alone], pairs))
        kept = _settled(whole, start)
        bad = _disagreeing(kept)
        if not bad:
            break
        rejected |= bad
        _check_pairs(shared, rejected)
        pairs = [view for view in pairs if view not in rejected]
    spread = kept.covariance()
    cameras = tuple(
        described(whole, kept, spread, camera, sizes_px[camera], alone[camera].rejected)
        for camera in (0, 1)
    )
    paired = [far for (key, _), far in kept.distances().items() if _is_pair(kept, key)]
    return PairCalibration(
        cameras,
        matrix_of(kept.transform),
        spread,
        _pair_errors(kept),
        rejected,
        root_mean_square(np.concatenate(paired)),
    )


def _shared(alone: Sequence[Calibration]) -> list[str]:
    """Views that count in both cameras; enough of them, or a `ValueError`."""
    shared = [view for view in alone[0].camera_from_board if view in alone[1].camera_from_board]
    if len(shared) < FEWEST_VIEWS:
        raise ValueError(
            f"calibration: expected at least {FEWEST_VIEWS} views of the board that both cameras"
            f" see, found {len(shared)}"
        )
    return shared


def _views(
    alone: Sequence[Calibration], corners: Sequence[Mapping[str, NDArray]], pairs: Sequence[str]
) -> dict[tuple[str, int], View]:
    """Corners of the views that each camera kept, at its own poses; pairs have one pose."""
    first, second = (
        {view: vector_of(pose) for view, pose in found.camera_from_board.items()} for found in alone
    )
    views = {
        (name, 0): View(
            pose, {0: corners[0][name]} | ({1: corners[1][name]} if name in pairs else {})
        )
        for name, pose in first.items()
    }
    own = {name: pose for name, pose in second.items() if name not in pairs}
    return views | {(name, 1): View(pose, {1: corners[1][name]}) for name, pose in own.items()}


def _settled(whole: Problem, kept: Problem) -> Problem:
    """Fit both cameras until outliers and terms stay the same, or pairs disagree."""
    for _ in range(MOST_ROUNDS):
        kept = kept.fitted()
        if _disagreeing(kept):
            break
        terms = tuple(fewer_terms(kept, camera) for camera in (0, 1))
        part = kept.without_outliers(whole)
        same = part.counts_as(kept) and terms == kept.terms
        if same and np.allclose(part.sigma_px, kept.sigma_px, rtol=SETTLED):
            break
        kept = part.with_terms(*terms)
    return kept


def _most_common(alone: Sequence[Calibration], pairs: Sequence[str]) -> NDArray:
    """The transform that a single pair gives and to which most others are near, (4, 4)."""
    first, second = (found.camera_from_board for found in alone)
    found = [second[view] @ np.linalg.inv(first[view]) for view in pairs]
    far = float(np.median([first[view][2, 3] for view in pairs]))

    def spread(guess: NDArray) -> float:
        shifts = [np.linalg.norm(other[:3, 3] - guess[:3, 3]) / far for other in found]
        return float(np.median(np.add(shifts, [_apart(other, guess) for other in found])))

    return min(found, key=spread)


def _is_pair(problem: Problem, key: tuple[str, int]) -> bool:
    return len(problem.views[key].corners_px) > 1


def _disagreeing(problem: Problem) -> dict[str, str]:
    """The pairs that disagree most, with the reason; none where all agree."""
    limits = PAIR_FACTOR * np.sqrt(2) * np.array(problem.sigma_px)
    errors = _pair_errors(problem)
    times = {view: np.divide(pair, limits) for view, pair in errors.items()}
    limit = max(1.0, WORST_SHARE * max(map(np.max, times.values())))
    worse = {view: int(np.argmax(of)) for view, of in times.items() if of.max() > limit}
    return {
        view: f"residual {errors[view][camera]:.2f} px as a pair, expected at most"
        f" {limits[camera]:.2f}"
        for view, camera in worse.items()
    }


def _pair_errors(problem: Problem) -> dict[str, tuple[float, float]]:
    """Root mean square residuals of each pair in both cameras [px]."""
    of = {at: root_mean_square(far) for at, far in problem.distances().items()}
    pairs = [key for key in problem.views if _is_pair(problem, key)]
    return {key[0]: (of[key, 0], of[key, 1]) for key in pairs}


def _check_pairs(shared: Sequence[str], rejected: Mapping[str, str]) -> None:
    left = len(shared) - len(rejected)
    if left < max(FEWEST_VIEWS, len(shared) / 2):
        worst = next(iter(rejected.values()))
        raise ValueError(
            f"calibration: expected pairs taken at one moment, found {len(rejected)} or more of"
            f" {len(shared)} that disagree ({worst})"
        )


def _ordered_alike(
    corners: Sequence[Mapping[str, NDArray]],
    shared: Sequence[str],
    board: FlatBoard,
    alone: Sequence[Calibration],
) -> dict[str, NDArray]:
    """The second camera's corners of a board that looks the same after half a turn.

    Of both orders each view has the one with which all views give about one transform.
    """
    options = {}
    for view in shared:
        known = np.linalg.inv(_board_pose(corners[0][view], board, alone[0]))
        orders = corners[1][view], corners[1][view][::-1].copy()
        options[view] = [(seen, _board_pose(seen, board, alone[1]) @ known) for seen in orders]

    def picked(guess: NDArray) -> dict[str, int]:
        return {
            view: int(np.argmin([_apart(option[1], guess) for option in pair]))
            for view, pair in options.items()
        }

    def spread(guess: NDArray) -> float:
        of = [_apart(options[view][k][1], guess) for view, k in picked(guess).items()]
        return float(np.median(of))

    guess = min((option[1] for pair in options.values() for option in pair), key=spread)
    best = picked(guess)
    others = [_apart(options[view][1 - k][1], options[view][k][1]) for view, k in best.items()]
    if spread(guess) > CLEARLY * min(others):
        raise ValueError(
            "board: expected one odd and one even number of corners, or views that settle its"
            f" order, found {board.columns} x {board.rows}"
        )
    return {view: options[view][k][0] for view, k in best.items()}


def _board_pose(corners: NDArray, board: FlatBoard, camera: Calibration) -> NDArray:
    """Pose (4, 4) of a board of which some corners are seen."""
    seen = np.isfinite(corners).all(axis=1)
    lens = camera_matrix(camera.lens), np.array(camera.camera.distortion)
    _, turn, shift = cv2.solvePnP(board.points_m[seen], corners[seen], *lens)
    return matrix_of(np.concatenate([turn.ravel(), shift.ravel()]))


def _apart(a: NDArray, b: NDArray) -> float:
    """Angle between two transforms [rad]."""
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.arccos(np.clip(cosine, -1, 1)))
