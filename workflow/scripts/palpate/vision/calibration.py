"""Optics of a camera from a board: OpenCV's calibration, without outliers (Section 4.1.4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.calibration_problem import (
    FEWEST_CORNERS,
    LENS,
    OPTICS,
    PARAMETERS,
    TERMS,
    Problem,
    View,
    matrix_of,
    root_mean_square,
)
from palpate.vision.camera import PinholeCamera

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
TILTED = "expected views that tell the focal length (boards tilted in different ways)"


@dataclass(frozen=True)
class Calibration:
    """Optics of one camera and what they rest on.

    Attributes
    ----------
    camera : PinholeCamera
    standard_errors : mapping
        Of the parameters that the corners tell; what was dropped is not among them.
    camera_from_board : dict
        View to its board's pose (4, 4).
    errors_px : dict
        View to the root mean square residual of its corners that count.
    rejected : dict
        View to the reason.
    rms_px : float
        Of all corners that count.
    rejected_corners : dict
        View to the places of its outliers in the board's order.
    sigma_px : float
        Standard deviation of a corner's coordinate, whatever the outliers are.
    covariance : (9, 9) array
        Of fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3; 0 for what was dropped.
    corners_px : dict
        View to its corners (n, 2), NaN for those that don't count.
    """

    camera: PinholeCamera
    standard_errors: Mapping[str, float]
    camera_from_board: Mapping[str, NDArray]
    errors_px: Mapping[str, float]
    rejected: Mapping[str, str]
    rms_px: float
    rejected_corners: Mapping[str, list[int]]
    sigma_px: float
    covariance: NDArray = field(repr=False)
    corners_px: Mapping[str, NDArray] = field(repr=False)

    @property
    def terms(self) -> tuple[str, ...]:
        """Distortion terms that the corners tell."""
        return tuple(term for term in TERMS if term in self.standard_errors)

    @property
    def lens(self) -> NDArray:
        """The nine numbers of `PARAMETERS`."""
        optics = [getattr(self.camera, name) for name in OPTICS]
        return np.array([*optics, *self.camera.distortion])


def calibrate_camera(
    corners: Mapping[str, NDArray],
    board: FlatBoard,
    size_px: tuple[int, int],
    *,
    name: str = "calibration",
) -> Calibration:
    """Zhang's calibration of one camera, with as much distortion as the corners tell.

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
        If too few different views show the board, or they don't tell the focal length.
    """
    views, rejected = usable_views(corners, board.points_m, size_px)
    _check_count(len(views), rejected, name)
    whole = _started(views, board, size_px, name)
    whole, kept = _settled(whole, whole, rejected, name)
    whole, kept = _settled(whole, kept.with_terms(TERMS), rejected, name)
    while (fewer := fewer_terms(kept)) != kept.terms[0]:
        kept = kept.with_terms(fewer).fitted()
    whole, kept = _settled(whole, kept, rejected, name)
    found = described(whole, kept, kept.covariance(), 0, size_px, rejected)
    _check_focal(found, name)
    return found


def _started(
    views: Mapping[str, NDArray], board: FlatBoard, size_px: tuple[int, int], name: str
) -> Problem:
    """OpenCV's calibration with all corners."""
    seen = [np.isfinite(found).all(axis=1) for found in views.values()]
    points = [board.points_m[own].astype(np.float32) for own in seen]
    pixels = [
        found[own].astype(np.float32) for found, own in zip(views.values(), seen, strict=True)
    ]
    try:
        _, matrix, distortion, turns, shifts = cv2.calibrateCamera(
            points,
            pixels,
            size_px,
            None,
            None,
            flags=cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K3,
        )
    except cv2.error:
        raise ValueError(f"{name}: {TILTED}, found others") from None
    optics = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
    lens = np.r_[optics, distortion.ravel()[: len(TERMS)]]
    poses = np.hstack([np.reshape(turns, (-1, 3)), np.reshape(shifts, (-1, 3))])
    if not (np.isfinite(lens).all() and np.isfinite(poses).all()):
        raise ValueError(f"{name}: {TILTED}, found others")
    boards = {
        (view, 0): View(pose, {0: found})
        for (view, found), pose in zip(views.items(), poses, strict=True)
    }
    return Problem(board.points_m, boards, lens, (START_TERMS,), (1.0,))


def _settled(
    whole: Problem, kept: Problem, rejected: dict[str, str], name: str
) -> tuple[Problem, Problem]:
    """Fit one camera until its outliers stay the same; views that are go to `rejected`."""
    for _ in range(MOST_ROUNDS):
        kept = kept.fitted()
        part = kept.without_outliers(whole)
        if part.counts_as(kept):
            limit = VIEW_FACTOR * np.sqrt(2) * part.sigma_px[0]
            errors = {key[0]: root_mean_square(far) for (key, _), far in part.distances().items()}
            worst = WORST_SHARE * max(errors.values())
            bad = {
                view: f"residual {error:.2f} px, expected at most {limit:.2f}"
                for view, error in errors.items()
                if not error <= max(limit, worst)
            }
            if not bad:
                return whole, replace(kept, sigma_px=part.sigma_px)
            rejected.update(bad)
            whole, part = whole.without(bad), part.without(bad)
            _check_count(len(whole.views), rejected, name)
        kept = part
    return whole, kept


def fewer_terms(found: Problem, camera: int = 0) -> tuple[str, ...]:
    """The terms of a camera without the last groups that the corners don't tell.

    By Schwarz's criterion (BIC) over all nested lenses, with the likelihood ratio of what is
    dropped from its covariance.
    """
    terms, best, dropped = found.terms[camera], 0.0, ()
    spread = found.covariance()
    worth = np.log(sum(len(found.linearised(key)[0]) for key in found.views))
    out: tuple[str, ...] = ()
    for group in (g for g in GROUPS if set(g) <= set(terms)):
        out = (*out, *group)
        at = [LENS * camera + PARAMETERS.index(term) for term in out]
        part, x = spread[np.ix_(at, at)], found.shared[at]
        ratio = x @ np.linalg.solve(part, x) if np.isfinite(part).all() else 0.0
        if ratio - len(out) * worth < best:
            best, dropped = ratio - len(out) * worth, out
    return tuple(term for term in terms if term not in dropped)


def described(
    whole: Problem,
    kept: Problem,
    spread: NDArray,
    camera: int,
    size_px: tuple[int, int],
    rejected: Mapping[str, str],
) -> Calibration:
    """One camera of a fit.

    Parameters
    ----------
    whole, kept : Problem
        With all corners, and with those that count.
    spread : array
        Covariance of the shared unknowns.
    camera : int
    size_px : (width, height)
    rejected : mapping
        View to the reason.
    """
    lens, own = kept.lens(camera), slice(LENS * camera, LENS * (camera + 1))
    errors = np.sqrt(np.diag(spread)[own])
    told = (*OPTICS, *kept.terms[camera])
    far = {key: values for (key, of), values in kept.distances().items() if of == camera}
    corners = {key[0]: kept.views[key].corners_px[camera] for key in far}
    lost = {}
    for key in far:
        seen = np.isfinite(whole.views[key].corners_px[camera]).all(axis=1)
        if places := np.flatnonzero(seen & np.isnan(corners[key[0]][:, 0])).tolist():
            lost[key[0]] = places
    return Calibration(
        PinholeCamera(*size_px, *lens[:4].tolist(), tuple(lens[4:].tolist())),
        {n: float(e) for n, e in zip(PARAMETERS, errors, strict=True) if n in told},
        {key[0]: matrix_of(kept.pose(key, camera)) for key in far},
        {key[0]: root_mean_square(values) for key, values in far.items()},
        dict(rejected),
        root_mean_square(np.concatenate(list(far.values()))),
        lost,
        kept.sigma_px[camera],
        spread[own, own],
        corners,
    )


def _check_count(count: int, rejected: Mapping[str, str], name: str) -> None:
    if count < FEWEST_VIEWS:
        same = sum(reason.startswith("the same view") for reason in rejected.values())
        others = len(rejected) - same
        parts = [f"{same} that another is the same as"] * (same > 0)
        parts += [f"{others} rejected"] * (others > 0)
        more = f" ({', '.join(parts)})" if parts else ""
        different = "different " if same else ""
        raise ValueError(
            f"{name}: expected at least {FEWEST_VIEWS} {different}views of the board, found"
            f" {count}{more}"
        )


def _check_focal(found: Calibration, name: str) -> None:
    """Reject views that leave the focal length open."""
    camera, errors = found.camera, found.standard_errors
    worst = max(("fx_px", "fy_px"), key=lambda name: errors[name] / getattr(camera, name))
    focal, error = getattr(camera, worst), errors[worst]
    if not (focal > 0 and error < LARGEST_FOCAL_ERROR * focal):
        raise ValueError(f"{name}: {TILTED}, found {focal:.0f} +- {error:.0f} px")


def usable_views(
    corners: Mapping[str, NDArray], points_m: NDArray, size_px: tuple[int, int]
) -> tuple[dict[str, NDArray], dict[str, str]]:
    """Views with enough corners that are not the same as another; the rest's reason.

    Parameters
    ----------
    corners : mapping
        View to its corners (n, 2) [px].
    points_m : (n, 3) array
        The board's.
    size_px : (width, height)

    Raises
    ------
    ValueError
        If a view has another number of corners than the board.
    """
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
        elif other := _same(found, usable, same_px):
            rejected[view] = f"the same view as {other}"
        else:
            usable[view] = found
    return usable, rejected


def _same(found: NDArray, others: Mapping[str, NDArray], same_px: float) -> str | None:
    """A view whose corners are at the same places."""
    for name, other in others.items():
        moved = np.hypot(*(found - other).T)
        moved = moved[np.isfinite(moved)]
        if len(moved) >= FEWEST_CORNERS and moved.max() < same_px:
            return name
    return None
