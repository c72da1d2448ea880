"""What a calibration's views determine, what would determine the rest, and calibration.json."""

from collections.abc import Mapping
from dataclasses import asdict
from itertools import product
from typing import NamedTuple

import numpy as np

from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.calibration import Calibration
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
# What determines the rest.
MORE = ": more views, large in the picture and tilted by 30 degrees to all sides"
CORNERS = ": views in the picture's corners"


class Verdict(NamedTuple):
    """Whether the views determine each part of a calibration; a line for each, and warnings."""

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
    ahead, warnings = [abs(pose[2, 2]) for pose in found.camera_from_board.values()], []
    most = float(np.arccos(np.clip(min(ahead), 0, 1)))
    if most < LEAST_TILT_RAD:
        tilt = f"no target tilts by more than {np.rad2deg(most):.0f} degrees"
        warnings.append(f"{tilt}: tilt it by 30")
    places = found.fit.points_m[:, :2]
    inside = ((places > places.min(axis=0)) & (places < places.max(axis=0))).all(axis=1)
    off = found.fit.distances()[:, 0]
    edge, middle = (float(np.nanmedian(off[:, part])) for part in (~inside, inside))
    if edge > EDGE_FACTOR * middle:
        warnings.append(
            f"corners at the board's edge are off by {edge:.2f} px, those within it by"
            f" {middle:.2f}: leave more white around it, and hold it flat"
        )
    return _verdict(parts, *warnings)


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


def _verdict(parts: Mapping[str, tuple[bool, str]], *warnings: str) -> Verdict:
    lines = []
    for part, (yes, how) in parts.items():
        todo = "" if yes else CORNERS if part == "distortion" else MORE
        lines.append(f"{part}: {'' if yes else 'not '}determined, {how}{todo}")
    lines += [f"warning: {warning}" for warning in warnings]
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


def pair_fields(
    pair: PairCalibration, streams: tuple[str, str], missing: Mapping[str, Mapping[str, str]]
) -> dict:
    """Both cameras, the transform between them, and what their views determine.

    ``streams`` are the names of the first and the second camera; ``missing`` gives by stream and
    view why there are no corners.
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
        **_verdict_fields(pair_verdict(pair)),
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
        **_verdict_fields(camera_verdict(found)),
        "camera_from_board": {k: pose.tolist() for k, pose in found.camera_from_board.items()},
        "corners_px": {
            # null for those not seen.
            name: [point if np.isfinite(point).all() else None for point in own.round(4).tolist()]
            for name, own in zip(fit.names, fit.found_px[:, 0], strict=True)
        },
    }


def _verdict_fields(verdict: Verdict) -> dict:
    return {"told": verdict.determined, "verdict": verdict.lines}
