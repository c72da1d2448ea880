"""What a calibration's views determine, where to hold the board next, and calibration.json."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.calibration import Calibration
from palpate.vision.calibration_problem import (
    FEWEST_CORNERS,
    POSE,
    Problem,
    composed,
    inverse,
    matrix_of,
)
from palpate.vision.camera import PinholeCamera
from palpate.vision.pair_calibration import PairCalibration

# Standard errors up to which a thing is determined. E takes up to three times the relative error of
# lengths, and a press is wanted to a percent or two.
FOCAL_SHARE, CENTRE_SHARE, BASELINE_SHARE = 0.005, 0.01, 0.005
# Cameras that are next to each other have no long baseline to be compared with [m].
SHIFT_M, TURN_RAD = 0.0005, np.deg2rad(0.1)
# Of the way from the principal point to the picture's farthest corner, that corners must reach.
REACH = 0.8
# Boards that are all tilted by less than this have nearly one direction.
LEAST_TILT_RAD = np.deg2rad(10)
# Corners at the board's edge that are this many times as far off as those within it.
EDGE_FACTOR = 1.5
# How much of the picture a board fills, and how it is tilted.
SHARES = (0.35, 0.65)
# Left free at the picture's edge, and what is no overhang.
MARGIN_PX, LITTLE_PX = 20, 10
MOST_MOVES = 4
TILT_RAD = np.deg2rad(30)
TILTS = {
    "facing the camera": (0, 0, 0),
    "its right side 30 degrees nearer": (0, TILT_RAD, 0),
    "its left side 30 degrees nearer": (0, -TILT_RAD, 0),
    "its upper edge 30 degrees nearer": (TILT_RAD, 0, 0),
    "its lower edge 30 degrees nearer": (-TILT_RAD, 0, 0),
}
PLACES = {
    "in the picture's middle": (0, 0),
    "in the upper left corner": (-1, -1),
    "in the upper right corner": (1, -1),
    "in the lower left corner": (-1, 1),
    "in the lower right corner": (1, 1),
}


class Verdict(NamedTuple):
    """Whether the views determine each part of a calibration, and a line for each and in doubt."""

    determined: dict[str, bool]
    lines: list[str]


def camera_verdict(found: Calibration) -> Verdict:
    """Whether one camera's views determine its focal length, principal point and distortion."""
    camera, errors = found.camera, found.standard_errors
    focal = max(errors["fx_px"] / camera.fx_px, errors["fy_px"] / camera.fy_px)
    centre = max(errors["cx_px"], errors["cy_px"])
    far, kept = _reach(found), ", ".join(found.terms) or "none"
    way = f"({kept}) as far as {PERCENT * far:.0f} % of the way to all picture's corners"
    parts = {
        "focal length": (focal <= FOCAL_SHARE, f"to {PERCENT * focal:.2g} %"),
        "principal point": (centre <= CENTRE_SHARE * camera.fx_px, f"to {centre:.2g} px"),
        "distortion": (far >= REACH, way),
    }
    return _verdict(parts, *_tilt(found), *_edges(found))


def pair_verdict(found: PairCalibration) -> Verdict:
    """Whether the pairs determine the transform between two cameras."""
    spread = found.transform_covariance
    turn, far = (float(np.sqrt(np.trace(part))) for part in (spread[:3, :3], spread[3:, 3:]))
    shift, enough = found.baseline_error_m, max(BASELINE_SHARE * found.baseline_m, SHIFT_M)
    return _verdict(
        {
            "baseline": (shift <= enough, f"to {shift * MILLIMETRES:.2g} mm"),
            "translation": (far <= 2 * enough, f"to {far * MILLIMETRES:.2g} mm"),
            "rotation": (turn <= TURN_RAD, f"to {np.rad2deg(turn):.2g} degrees"),
        }
    )


def _verdict(parts: Mapping[str, tuple[bool, str]], *doubts: str) -> Verdict:
    lines = [
        f"{part}: {'' if yes else 'not '}determined, {how}" for part, (yes, how) in parts.items()
    ]
    lines += [f"warning: {doubt}" for doubt in doubts]
    return Verdict({part: bool(yes) for part, (yes, _) in parts.items()}, lines)


def _reach(found: Calibration) -> float:
    """Share of the way from centre to picture's corners that is seen, the least of the four."""
    camera, seen = found.camera, found.fit.corners_px.reshape(-1, 2)
    centre = np.array([camera.cx_px, camera.cy_px])
    away = seen[np.isfinite(seen).all(axis=1)] - centre
    towards = [*product((0, camera.width_px), (0, camera.height_px))] - centre
    lengths = np.hypot(*towards.T)
    # A corner counts for the picture's corner that it lies nearest to the direction of.
    nearest = (away @ (towards / lengths[:, None]).T).argmax(axis=1)
    shares = np.hypot(*away.T) / lengths[nearest]
    return float(min(shares[nearest == k].max(initial=0) for k in range(len(towards))))


def _tilt(found: Calibration) -> list[str]:
    """A line if no board is tilted."""
    ahead = [abs(pose[2, 2]) for pose in found.camera_from_board.values()]
    most = float(np.arccos(np.clip(min(ahead), 0, 1)))
    if most >= LEAST_TILT_RAD:
        return []
    return [f"no target tilts by more than {np.rad2deg(most):.0f} degrees: tilt it by 30"]


def _edges(found: Calibration) -> list[str]:
    """A line if the corners at the board's edge are worse than those within it."""
    places = found.fit.points_m[:, :2]
    inside = ((places > places.min(axis=0)) & (places < places.max(axis=0))).all(axis=1)
    off = found.fit.distances()[:, 0]
    edge, middle = (float(np.nanmedian(off[:, part])) for part in (~inside, inside))
    if not edge > EDGE_FACTOR * middle:
        return []
    return [
        f"corners at the board's edge are off by {edge:.2f} px, those within it by {middle:.2f}:"
        " leave more white around it, and hold it flat"
    ]


def next_view(found: Calibration | PairCalibration) -> str:
    """Where to hold the board next, in words.

    Of a grid of poses before the (first) camera it is the one with which the focal lengths'
    variance, or for two cameras the translation's, becomes least. Where a camera's boards were
    never near the picture's corners, it is one of those.
    """
    fit, paired = found.fit, isinstance(found, PairCalibration)
    spread = found.covariance[np.ix_(fit.free, fit.free)]
    known = inverse(spread)
    # Translation or focal lengths, which are never dropped.
    wanted = slice(-POSE // 2, None) if paired else slice(0, 2)
    outer = not paired and _reach(found) < REACH
    variances = {
        words: np.trace(inverse(known + _information(fit, pose))[wanted, wanted])
        for words, pose in _candidates(fit, outer=outer)
    }
    if not variances:
        return "hold the board farther away: it does not fit into the picture"
    words = min(variances, key=variances.get)
    what, unit, scale = "focal length", "px", 1 / np.sqrt(2)
    if paired:
        what, unit, scale = "translation", "mm", MILLIMETRES
    now, then = scale * np.sqrt([np.trace(spread[wanted, wanted]), variances[words]])
    return f"hold the board {words} (the {what}'s standard error: {now:.2g} to {then:.2g} {unit})"


def _candidates(fit: Problem, *, outer: bool) -> Iterator[tuple[str, NDArray]]:
    """Poses, turn and shift, at which the whole board is in the picture, or in its corners."""
    camera, middle = fit.camera(0), fit.points_m.mean(axis=0)
    centre, focal = (camera.cx_px, camera.cy_px), (camera.fx_px, camera.fy_px)
    size = np.array([camera.width_px, camera.height_px])
    for (place, side), (tilt, turn), share in product(PLACES.items(), TILTS.items(), SHARES):
        if outer and not any(side):
            continue
        distance = float(np.max(camera.fx_px * 2 * middle[:2] / (share * size)))
        # Aimed at the picture's corner itself it hangs out of it: as far as that it is moved in.
        aim = (size - 1) * (1 + np.array(side)) / 2
        for _ in range(MOST_MOVES + 1):
            pose = np.array([*turn, *((aim - centre) / focal * distance), distance])
            pose[3:] -= matrix_of(pose)[:3, :3] @ middle
            over = _overhang(camera, _pixels(camera, fit.points_m, pose))
            if not over.any():
                yield f"{place}, {distance:.2g} m away, {tilt}", pose
                break
            aim = aim + over


def _overhang(camera: PinholeCamera, pixels: NDArray) -> NDArray:
    """By how much a board must be moved to be in the picture with a margin, (2,) [px]."""
    least, most = MARGIN_PX, np.array([camera.width_px, camera.height_px]) - 1 - MARGIN_PX
    over = np.maximum(least - pixels.min(axis=0), 0) + np.minimum(most - pixels.max(axis=0), 0)
    return np.where(np.abs(over) > LITTLE_PX, over, 0.0)


def _pixels(camera: PinholeCamera, points_m: NDArray, pose: NDArray) -> NDArray:
    """Where a board's corners are in the picture, (n, 2) [px]; NaN for those not before it."""
    points = points_m @ matrix_of(pose)[:3, :3].T + pose[3:]
    return np.where(points[:, 2:] > 0, camera.project(points), np.nan)


def _information(fit: Problem, pose: NDArray) -> NDArray | float:
    """What a board at a pose of the first camera would determine of the shared unknowns."""
    poses = [pose] if len(fit.terms) == 1 else [pose, composed(pose, fit.transform)[0]]
    corners = np.full((1, len(poses), len(fit.points_m), 2), np.nan)
    for k, own in enumerate(poses):
        pixels = _pixels(fit.camera(k), fit.points_m, own)
        inside = ((pixels >= 0) & (pixels < fit.sizes_px[k])).all(axis=1)
        if inside.sum() >= FEWEST_CORNERS:
            corners[0, k, inside] = pixels[inside]
    seen = np.isfinite(corners[0, ..., 0]).any(axis=1)
    if not seen.any():
        return 0.0
    first = np.array([poses[seen.argmax()]])
    view = {"names": ("next",), "poses": first, "found_px": corners, "corners_px": corners}
    return replace(fit, **view).information()


def pair_fields(
    pair: PairCalibration, streams: tuple[str, str], missing: Mapping[str, Mapping[str, str]]
) -> dict:
    """Both cameras, the transform between them, and what their views determine.

    Parameters
    ----------
    pair : PairCalibration
    streams : two of str
        What the first and the second camera are called.
    missing : mapping
        Stream and view to why there are no corners.
    """
    first, second = streams
    return {
        "cameras": {
            name: _camera_fields(found, missing[name])
            for name, found in zip(streams, pair.cameras, strict=True)
        },
        f"{second}_from_{first}": pair.second_from_first.tolist(),
        "transform_standard_errors": pair.standard_errors,
        "transform_covariance": pair.transform_covariance.tolist(),
        "baseline_m": pair.baseline_m,
        "baseline_standard_error_m": pair.baseline_error_m,
        "pair_rms_px": pair.rms_px,
        "pair_errors_px": pair.errors_px,
        "pair_rejected": dict(pair.rejected),
        **_verdict_fields(pair_verdict(pair), pair),
    }


def _camera_fields(found: Calibration, missing: Mapping[str, str]) -> dict:
    """One camera, and what its views determine; `missing` has why views have no corners."""
    fit = found.fit
    return {
        **asdict(found.camera),
        "standard_errors": found.standard_errors,
        "covariance": found.covariance.tolist(),
        "rms_px": found.rms_px,
        "errors_px": found.errors_px,
        "rejected": dict(missing) | dict(found.rejected),
        "rejected_corners": found.rejected_corners,
        **_verdict_fields(camera_verdict(found), found),
        "camera_from_board": {k: pose.tolist() for k, pose in found.camera_from_board.items()},
        "corners_px": {
            # null for those not seen.
            name: [point if np.isfinite(point).all() else None for point in own.round(4).tolist()]
            for name, own in zip(fit.names, fit.found_px[:, 0], strict=True)
        },
    }


def _verdict_fields(verdict: Verdict, found: Calibration | PairCalibration) -> dict:
    fields = {"told": verdict.determined, "verdict": verdict.lines}
    return fields | {"next_view": next_view(found)}
