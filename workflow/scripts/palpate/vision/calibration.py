"""Optics of a camera, or of two and the transform between them, from a board (Section 4.1.4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from palpate.vision import outlying
from palpate.vision.board import FlatBoard
from palpate.vision.bundle import LENS, OPTICS, TERMS, Bundle, Sight
from palpate.vision.camera import PinholeCamera
from palpate.vision.first_guess import board_pose, first_lens, matrix_of
from palpate.vision.refine import covariance, fit

FEWEST_VIEWS = 6
PARAMETERS = (*OPTICS, *TERMS)
# Groups are dropped from the first on.
GROUPS = (("k3",), ("p1", "p2"), ("k2",), ("k1",))
START_TERMS = ("k1", "k2")
# Rounds of a fit and its outliers, and the change of the standard deviation that ends them.
MOST_ROUNDS, SETTLED, ABOUT_SETTLED = 20, 0.02, 0.2
# Of the focal length: what a calibration must know at least.
LARGEST_FOCAL_ERROR = 0.1


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
    sights : tuple of Sight
        The corners that count.
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
    sights: tuple[Sight, ...] = field(repr=False)

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
    views, rejected = outlying.usable_views(corners, board.points_m, size_px)
    _check_count(len(views), rejected, name)
    lens = first_lens(views, board, size_px)
    whole = Bundle(
        board.points_m,
        tuple(Sight(view, 0, False, found) for view, found in views.items()),
        (np.hypot(*size_px),),  # before a fit all corners count
        (START_TERMS,),
    )
    poses = {s.board: board_pose(s.corners_px, board, lens) for s in whole.sights}
    start = whole.pack((lens,), poses)
    whole, kept, x = _settled(whole, start, rejected, name)
    whole, kept, x = _settled(replace(whole, terms=(TERMS,)), x, rejected, name)
    terms = TERMS
    while (fewer := fewer_terms(kept, x)) != terms:
        terms = fewer
        fuller, kept = kept, replace(kept, terms=(terms,))
        x = fit(kept, kept.taken(fuller, x))
    whole, kept, x = _settled(replace(whole, terms=(terms,)), x, rejected, name)
    found = described(whole, kept, x, covariance(kept, x), 0, size_px, rejected)
    _check_focal(found, name)
    return found


def fewer_terms(bundle: Bundle, x: NDArray, camera: int = 0) -> tuple[str, ...]:
    """The terms of a camera without the last groups that the corners don't tell.

    By Schwarz's criterion (BIC) over all nested lenses, with the likelihood ratio of what is
    dropped from its covariance.
    """
    terms, best, dropped = bundle.terms[camera], 0.0, ()
    spread, worth = covariance(bundle, x), np.log(len(bundle.residuals(x)))
    out: tuple[str, ...] = ()
    for group in (g for g in GROUPS if set(g) <= set(terms)):
        out = (*out, *group)
        at = [LENS * camera + PARAMETERS.index(term) for term in out]
        part = spread[np.ix_(at, at)]
        ratio = x[at] @ np.linalg.solve(part, x[at]) if np.isfinite(part).all() else 0.0
        if ratio - len(out) * worth < best:
            best, dropped = ratio - len(out) * worth, out
    return tuple(term for term in terms if term not in dropped)


def described(
    whole: Bundle,
    kept: Bundle,
    x: NDArray,
    spread: NDArray,
    camera: int,
    size_px: tuple[int, int],
    rejected: Mapping[str, str],
) -> Calibration:
    """One camera of a fit.

    Parameters
    ----------
    whole, kept : Bundle
        With all corners, and with those that count.
    x : array
        The unknowns.
    spread : array
        Covariance of those before the poses.
    camera : int
    size_px : (width, height)
    rejected : mapping
        View to the reason.
    """
    lens, own = kept.lens(x, camera), slice(LENS * camera, LENS * (camera + 1))
    errors = np.sqrt(np.diag(spread)[own])
    told = (*OPTICS, *kept.terms[camera])
    far = {
        s.view: far[s.seen]
        for s, far in zip(kept.sights, outlying.distances(kept.off_px(x)), strict=True)
        if s.camera == camera
    }
    return Calibration(
        PinholeCamera(*size_px, *lens[:4].tolist(), tuple(lens[4:].tolist())),
        {n: float(e) for n, e in zip(PARAMETERS, errors, strict=True) if n in told},
        {s.view: matrix_of(kept.pose(x, s)) for s in kept.sights if s.camera == camera},
        {view: outlying.root_mean_square(values) for view, values in far.items()},
        dict(rejected),
        outlying.root_mean_square(np.concatenate(list(far.values()))),
        outlying.lost_corners(whole.sights, kept, camera),
        kept.sigma_px[camera],
        spread[own, own],
        tuple(s for s in kept.sights if s.camera == camera),
    )


def _settled(
    whole: Bundle, x: NDArray, rejected: dict[str, str], name: str
) -> tuple[Bundle, Bundle, NDArray]:
    """Fit one camera until its outliers stay the same; views that are go to `rejected`.

    Corners are judged once the scatter is known, views once their corners are.
    """
    kept, sigma, known = whole, whole.sigma_px[0], False
    for _ in range(MOST_ROUNDS):
        x = fit(kept, x)
        far = outlying.distances(whole.off_px(x))
        sigma, before = outlying.scatter(kept, far)[0], sigma
        settled = abs(sigma / before - 1) < (SETTLED if known else ABOUT_SETTLED)
        known = known or settled
        part = outlying.without_outliers(whole.sights, far, (sigma,)) if known else kept.sights
        if settled and outlying.same_corners(part, kept.sights):
            bad = outlying.bad_views(part, far, sigma)
            if not bad:
                break
            rejected.update(bad)
            fuller, whole = whole, whole.without(bad)
            _check_count(len(whole.sights), rejected, name)
            x, part = whole.taken(fuller, x), tuple(s for s in part if s.view not in bad)
        kept = replace(whole, sights=part, sigma_px=(sigma,))
    return replace(whole, sigma_px=kept.sigma_px), kept, x


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
    """Refuse views that leave the focal length open."""
    camera, errors = found.camera, found.standard_errors
    worst = max(("fx_px", "fy_px"), key=lambda name: errors[name] / getattr(camera, name))
    focal, error = getattr(camera, worst), errors[worst]
    if not (focal > 0 and error < LARGEST_FOCAL_ERROR * focal):
        raise ValueError(
            f"{name}: expected views that tell the focal length (boards tilted in different ways),"
            f" found {focal:.0f} +- {error:.0f} px"
        )
