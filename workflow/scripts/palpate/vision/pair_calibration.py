"""Two cameras and the transform between them in one refinement (Section 4.1.4, Eq. 4.11)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from palpate.vision import outlying
from palpate.vision.board import FlatBoard
from palpate.vision.board_order import apart, ordered_alike
from palpate.vision.bundle import POSE, Bundle, Sight
from palpate.vision.calibration import (
    FEWEST_VIEWS,
    SETTLED,
    Calibration,
    calibrate_camera,
    described,
    fewer_terms,
)
from palpate.vision.first_guess import matrix_of, vector_of
from palpate.vision.refine import covariance, fit

# A pair of pictures disagrees beyond this many times what the corners of each camera scatter by.
PAIR_FACTOR = 3.0
# Of the pairs that disagree in a fit, those within this part of the worst's residual are parted.
WORST_SHARE = 0.5
MOST_ROUNDS = 40
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
    shared = [view for view in alone[0].camera_from_board if view in alone[1].camera_from_board]
    if len(shared) < FEWEST_VIEWS:
        raise ValueError(
            f"calibration: expected at least {FEWEST_VIEWS} views of the board that both cameras"
            f" see, found {len(shared)}"
        )
    if board.ambiguous:
        corners[1] |= _turned_alike(corners, shared, board, alone)
        alone[1] = calibrate_camera(corners[1], board, sizes_px[1], name=names[1])
    whole = _as_bundle(corners, board, alone, shared)
    whole, kept, x, rejected = _settled(whole, alone, shared)
    return _described(whole, kept, x, sizes_px, alone, rejected)


def _turned_alike(
    corners: list[dict], shared: list[str], board: FlatBoard, alone: list[Calibration]
) -> dict[str, NDArray]:
    seen = [{view: own[view] for view in shared} for own in corners]
    return ordered_alike(*seen, board, (alone[0].lens, alone[1].lens))


def _as_bundle(
    corners: list[dict], board: FlatBoard, alone: list[Calibration], shared: list[str]
) -> Bundle:
    """All corners of the views that each camera kept."""
    sights = [
        Sight(view, camera, view in shared, corners[camera][view])
        for camera, found in enumerate(alone)
        for view in found.camera_from_board
    ]
    sigma, terms = zip(*((found.sigma_px, found.terms) for found in alone), strict=True)
    return Bundle(board.points_m, tuple(sights), sigma, terms)


def _settled(
    whole: Bundle, alone: list[Calibration], shared: list[str]
) -> tuple[Bundle, Bundle, NDArray, dict[str, str]]:
    """Fit both cameras until the pairs that disagree are parted and outliers stay the same."""
    rejected: dict[str, str] = {}
    kept, x = _started(whole, alone)
    for _ in range(MOST_ROUNDS):
        x = fit(kept, x)
        if bad := _disagreeing(kept, x):
            rejected |= bad
            _check_pairs(shared, rejected)
            whole = replace(whole, sights=_parted(whole.sights, rejected))
            kept, x = _started(whole, alone)
            continue
        far = outlying.distances(whole.off_px(x))
        sigma = outlying.scatter(kept, far)
        part = outlying.without_outliers(whole.sights, far, sigma)
        terms = tuple(fewer_terms(kept, x, camera) for camera in (0, 1))
        same = outlying.same_corners(part, kept.sights) and terms == kept.terms
        if same and np.allclose(sigma, kept.sigma_px, rtol=SETTLED):
            break
        fuller, kept = kept, replace(kept, sights=part, sigma_px=sigma, terms=terms)
        x = kept.taken(fuller, x)
    return whole, kept, x, rejected


def _started(whole: Bundle, alone: list[Calibration]) -> tuple[Bundle, NDArray]:
    """Each camera's own optics, poses and corners that count, and most pairs' transform."""
    own = {(s.view, camera): s for camera, found in enumerate(alone) for s in found.sights}
    sights = [
        replace(sight, corners_px=own[sight.view, sight.camera].corners_px)
        for sight in whole.sights
    ]
    poses = [
        {view: vector_of(pose) for view, pose in found.camera_from_board.items()} for found in alone
    ]
    pairs = [s.view for s in whole.sights if s.through]
    kept = replace(whole, sights=tuple(sights))
    of_board = {(view, camera): poses[camera][view] for view, camera in whole.boards}
    lenses = tuple(found.lens for found in alone)
    return kept, kept.pack(lenses, of_board, vector_of(_most_common(alone, pairs)))


def _most_common(alone: list[Calibration], pairs: list[str]) -> NDArray:
    """The transform that a single pair gives and to which most others are near, (4, 4)."""
    first, second = (found.camera_from_board for found in alone)
    found = [second[view] @ np.linalg.inv(first[view]) for view in pairs]
    far = float(np.median([first[view][2, 3] for view in pairs]))

    def spread(guess: NDArray) -> float:
        shifts = [np.linalg.norm(other[:3, 3] - guess[:3, 3]) / far for other in found]
        turns = [apart(other, guess) for other in found]
        return float(np.median(np.add(shifts, turns)))

    return min(found, key=spread)


def _disagreeing(bundle: Bundle, x: NDArray) -> dict[str, str]:
    """The pairs that disagree most, with the reason; none where all agree."""
    limits = PAIR_FACTOR * np.sqrt(2) * np.array(bundle.sigma_px)
    errors = pair_errors(bundle, x)
    times = {view: np.divide(pair, limits) for view, pair in errors.items()}
    limit = max(1.0, WORST_SHARE * max(map(np.max, times.values())))
    worse = {view: int(np.argmax(of)) for view, of in times.items() if of.max() > limit}
    return {
        view: f"residual {errors[view][camera]:.2f} px as a pair, expected at most"
        f" {limits[camera]:.2f}"
        for view, camera in worse.items()
    }


def pair_errors(bundle: Bundle, x: NDArray) -> dict[str, tuple[float, float]]:
    """Root mean square residuals of each pair in both cameras [px]."""
    far = zip(bundle.sights, outlying.distances(bundle.off_px(x)), strict=True)
    of = {(s.view, s.camera): outlying.root_mean_square(d[s.seen]) for s, d in far if s.paired}
    return {view: (error, of[view, 1]) for (view, camera), error in of.items() if camera == 0}


def _check_pairs(shared: list[str], rejected: Mapping[str, str]) -> None:
    left = len(shared) - len(rejected)
    if left < max(FEWEST_VIEWS, len(shared) / 2):
        worst = next(iter(rejected.values()))
        raise ValueError(
            f"calibration: expected pairs taken at one moment, found {len(rejected)} or more of"
            f" {len(shared)} that disagree ({worst})"
        )


def _parted(sights: tuple[Sight, ...], views: Mapping[str, str]) -> tuple[Sight, ...]:
    return tuple(replace(s, paired=s.paired and s.view not in views) for s in sights)


def _described(
    whole: Bundle,
    kept: Bundle,
    x: NDArray,
    sizes_px: tuple[tuple[int, int], tuple[int, int]],
    alone: list[Calibration],
    rejected: Mapping[str, str],
) -> PairCalibration:
    spread = covariance(kept, x)
    cameras = tuple(
        described(whole, kept, x, spread, camera, sizes_px[camera], alone[camera].rejected)
        for camera in (0, 1)
    )
    errors = pair_errors(kept, x)
    far = zip(kept.sights, outlying.distances(kept.off_px(x)), strict=True)
    paired = np.concatenate([d[s.seen] for s, d in far if s.paired])
    return PairCalibration(
        cameras,
        matrix_of(kept.transform(x)),
        spread,
        errors,
        rejected,
        outlying.root_mean_square(paired),
    )
