"""Optics of a camera from a board: OpenCV's calibration, without outliers (Section 4.1.4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import compress

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.calibration_problem import (
    FEWEST_CORNERS,
    LENS,
    PARAMETERS,
    TERMS,
    Problem,
    matrix_of,
    root_mean_square,
)
from palpate.vision.camera import OPTICS, PinholeCamera

FEWEST_VIEWS = 6
# Groups are dropped from the first on.
GROUPS = (("k3",), ("p1", "p2"), ("k2",), ("k1",))
START_TERMS = ("k1", "k2")
# Rounds of a fit and its outliers.
MOST_ROUNDS = 20
# A view is an outlier beyond this many times the root mean square of all; of such, those within a
# part of the worst's go first.
VIEW_FACTOR, WORST_SHARE = 3.0, 0.5
# Part of the picture's diagonal by which a corner of another view is elsewhere: a board that tilts
# in place moves its outer corners by a few pixels, a still one none by half a pixel.
SAME_VIEW_SHARE = 0.001
# Of the focal length: what a calibration must know at least.
LARGEST_FOCAL_ERROR = 0.1
TILTED = "expected views that determine the focal length (targets tilted in different ways)"


@dataclass(frozen=True)
class Calibration:
    """Optics of one camera and what they rest on."""

    fit: Problem = field(repr=False)  # of this camera alone
    # (9, 9), of fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3; 0 for what was dropped
    covariance: NDArray = field(repr=False)
    rejected: Mapping[str, str]  # view to the reason

    @property
    def camera(self) -> PinholeCamera:
        """The optics."""
        return self.fit.camera(0)

    @property
    def terms(self) -> tuple[str, ...]:
        """Distortion terms that the corners determine."""
        return self.fit.terms[0]

    @property
    def standard_errors(self) -> dict[str, float]:
        """Of the parameters that the corners determine; what was dropped is not among them."""
        errors = dict(zip(PARAMETERS, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))
        return {name: errors[name] for name in (*OPTICS, *self.terms)}

    @property
    def camera_from_board(self) -> dict[str, NDArray]:
        """View to its board's pose (4, 4)."""
        return dict(zip(self.fit.names, map(matrix_of, self.fit.poses), strict=True))

    @property
    def errors_px(self) -> dict[str, float]:
        """View to the root mean square residual of its corners that count."""
        return dict(zip(self.fit.names, self.fit.errors()[:, 0].tolist(), strict=True))

    @property
    def rms_px(self) -> float:
        """Root mean square residual of all corners that count."""
        return float(root_mean_square(self.fit.distances()))

    @property
    def rejected_corners(self) -> dict[str, list[int]]:
        """View to the places of its outliers in the board's order."""
        found, counting = self.fit.found_px[:, 0, :, 0], self.fit.corners_px[:, 0, :, 0]
        pairs = zip(self.fit.names, np.isfinite(found) & np.isnan(counting), strict=True)
        return {name: np.flatnonzero(own).tolist() for name, own in pairs if own.any()}


def calibrate_camera(
    corners: Mapping[str, NDArray],
    board: FlatBoard,
    size_px: tuple[int, int],
    *,
    name: str = "calibration",
) -> Calibration:
    """Zhang's calibration of one camera, with as much distortion as the corners determine.

    Corners far from where they are projected, and views with a residual far above the others',
    are left out and named; both are judged against what this camera's corners scatter by.

    Parameters
    ----------
    corners : mapping
        View to its corners (n, 2) [px] in the board's order; NaN for those not seen.
    board : FlatBoard
    size_px : (width, height)
    name : str
        What errors begin with.

    Raises
    ------
    ValueError
        If a view has another number of corners than the board, too few different views show the
        board, or they don't determine the focal length.
    """
    views, rejected = _usable(corners, board.points_m, size_px)
    _check_count(len(views), rejected, name)
    fit = _settled(_started(views, board, size_px, name), rejected, name)
    fit = _settled(fit.with_terms(TERMS), rejected, name)
    while (fewer := fewer_terms(fit)) != fit.terms[0]:
        fit = fit.with_terms(fewer).fitted()
    fit = _settled(fit, rejected, name)
    found = Calibration(fit, fit.covariance(), rejected)
    camera, errors = found.camera, found.standard_errors
    focals = [(getattr(camera, axis), errors[axis]) for axis in ("fx_px", "fy_px")]
    focal, error = max(focals, key=lambda one: one[1] / one[0])
    if not (focal > 0 and error < LARGEST_FOCAL_ERROR * focal):
        raise ValueError(f"{name}: {TILTED}, found {focal:.0f} +- {error:.0f} px")
    return found


def _usable(
    corners: Mapping[str, NDArray], points_m: NDArray, size_px: tuple[int, int]
) -> tuple[dict[str, NDArray], dict[str, str]]:
    """Views with enough corners that are not the same as another; the rest's reason."""
    usable, rejected, count = {}, {}, len(points_m)
    same_px = SAME_VIEW_SHARE * np.hypot(*size_px)
    for view, found in corners.items():
        if np.shape(found) != (count, 2):
            raise ValueError(f"{view}: corners: expected ({count}, 2), found {np.shape(found)}")
        seen = np.isfinite(found).all(axis=1)
        if seen.sum() < FEWEST_CORNERS:
            rejected[view] = f"{seen.sum()} corners seen, expected at least {FEWEST_CORNERS}"
        elif np.linalg.matrix_rank(points_m[seen] - points_m[seen][0]) < 2:
            rejected[view] = "corners of one line of the board seen, expected more"
        elif same := [name for name, other in usable.items() if _same(found, other, same_px)]:
            rejected[view] = f"the same view as {same[0]}"
        else:
            usable[view] = found
    return usable, rejected


def _same(found: NDArray, other: NDArray, same_px: float) -> bool:
    """Whether the corners of two views are at the same places."""
    moved = np.hypot(*(found - other).T)
    return np.isfinite(moved).sum() >= FEWEST_CORNERS and np.nanmax(moved) < same_px


def _check_count(count: int, rejected: Mapping[str, str], name: str) -> None:
    """Reject too few views, and say what became of the others."""
    if count >= FEWEST_VIEWS:
        return
    same = sum(reason.startswith("the same view") for reason in rejected.values())
    lost = {"that another is the same as": same, "rejected": len(rejected) - same}
    more = ", ".join(f"{number} {what}" for what, number in lost.items() if number)
    raise ValueError(
        f"{name}: expected at least {FEWEST_VIEWS} {'different ' * bool(same)}views of the board,"
        f" found {count}" + f" ({more})" * bool(more)
    )


def _started(
    views: Mapping[str, NDArray], board: FlatBoard, size_px: tuple[int, int], name: str
) -> Problem:
    """OpenCV's calibration with all corners."""
    seen = {view: np.isfinite(found).all(axis=1) for view, found in views.items()}
    points = [board.points_m[own].astype(np.float32) for own in seen.values()]
    pixels = [views[view][own].astype(np.float32) for view, own in seen.items()]
    flags = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3
    try:
        _, K, bent, *pose = cv2.calibrateCamera(points, pixels, size_px, None, None, flags=flags)
    except cv2.error:
        raise ValueError(f"{name}: {TILTED}, found others") from None
    lens = np.r_[K[0, 0], K[1, 1], K[:2, 2], bent.ravel()[: len(TERMS)]]
    poses = np.hstack([np.reshape(part, (-1, 3)) for part in pose])
    if not (np.isfinite(lens).all() and np.isfinite(poses).all()):
        raise ValueError(f"{name}: {TILTED}, found others")
    corners = np.array([*views.values()], dtype=float)[:, None]
    seen = tuple(views), poses, corners, corners
    return Problem(board.points_m, *seen, lens, (START_TERMS,), np.ones(1), (size_px,))


def _settled(fit: Problem, rejected: dict[str, str], name: str) -> Problem:
    """Fit one camera until its outliers stay the same; views that are go to `rejected`."""
    for _ in range(MOST_ROUNDS):
        fit = fit.fitted()
        part = fit.without_outliers()
        if part.counts_as(fit):
            errors, limit = part.errors()[:, 0], VIEW_FACTOR * np.sqrt(2) * part.sigma_px[0]
            good = errors <= max(limit, WORST_SHARE * errors.max())
            if good.all():
                return replace(fit, sigma_px=part.sigma_px)
            for view, error in zip(compress(part.names, ~good), errors[~good], strict=True):
                rejected[view] = f"residual {error:.2f} px, expected at most {limit:.2f}"
            part = part.of_views(good)
            _check_count(len(part.names), rejected, name)
        fit = part
    return fit


def fewer_terms(fit: Problem, camera: int = 0) -> tuple[str, ...]:
    """The terms of a camera without the last groups that the corners don't determine.

    By Schwarz's criterion (BIC) over all nested lenses, with the likelihood ratio of what is
    dropped from its covariance.
    """
    terms, best, dropped = fit.terms[camera], 0.0, ()
    spread, worth = fit.covariance(), np.log(len(fit.residuals()))
    out: tuple[str, ...] = ()
    for group in (g for g in GROUPS if set(g) <= set(terms)):
        out = (*out, *group)
        at = [LENS * camera + PARAMETERS.index(term) for term in out]
        part, x = spread[np.ix_(at, at)], fit.shared[at]
        ratio = x @ np.linalg.solve(part, x) if np.isfinite(part).all() else 0.0
        if ratio - len(out) * worth < best:
            best, dropped = ratio - len(out) * worth, out
    return tuple(term for term in terms if term not in dropped)
