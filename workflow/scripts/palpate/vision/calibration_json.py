"""A calibration as calibration.json holds it."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from palpate.vision.board import FlatBoard
from palpate.vision.calibration import Calibration
from palpate.vision.calibration_problem import OPTICS
from palpate.vision.calibration_verdict import Verdict, camera_verdict, pair_verdict
from palpate.vision.next_view import next_view
from palpate.vision.pair_calibration import PairCalibration


def pair_fields(
    pair: PairCalibration,
    board: FlatBoard,
    streams: tuple[str, str],
    corners: Mapping[str, Mapping[str, NDArray]],
    missing: Mapping[str, Mapping[str, str]],
) -> dict:
    """Both cameras, the transform between them, and what their views tell.

    Parameters
    ----------
    pair : PairCalibration
    board : FlatBoard
    streams : two of str
        What the first and the second camera are called.
    corners : mapping
        Stream and view to the corners found (n, 2) [px].
    missing : mapping
        Stream and view to why there are none.
    """
    first, second = streams
    return {
        "cameras": {
            name: _camera_fields(found, board, corners[name], missing[name])
            for name, found in zip(streams, pair.cameras, strict=True)
        },
        f"{second}_from_{first}": pair.second_from_first.tolist(),
        "transform_standard_errors": pair.standard_errors,
        "transform_covariance": pair.covariance.tolist(),
        "baseline_m": pair.baseline_m,
        "baseline_standard_error_m": pair.baseline_error_m,
        "pair_rms_px": pair.rms_px,
        "pair_errors_px": {name: list(errors) for name, errors in pair.errors_px.items()},
        "pair_rejected": dict(pair.rejected),
        **_told(pair_verdict(pair)),
        "next_view": next_view(pair, board),
    }


def _camera_fields(
    found: Calibration,
    board: FlatBoard,
    corners: Mapping[str, NDArray],
    missing: Mapping[str, str],
) -> dict:
    camera = found.camera
    return {
        "width_px": camera.width_px,
        "height_px": camera.height_px,
        **{name: getattr(camera, name) for name in OPTICS},
        "distortion": list(camera.distortion),
        "standard_errors": dict(found.standard_errors),
        "covariance": found.covariance.tolist(),
        "rms_px": found.rms_px,
        "errors_px": dict(found.errors_px),
        "rejected": dict(missing) | dict(found.rejected),
        "rejected_corners": dict(found.rejected_corners),
        **_told(camera_verdict(found, board)),
        "next_view": next_view(found, board),
        "camera_from_board": {
            name: pose.tolist() for name, pose in found.camera_from_board.items()
        },
        "corners_px": {name: _listed(corners[name]) for name in found.camera_from_board},
    }


def _told(verdict: Verdict) -> dict:
    return {"told": dict(verdict.told), "verdict": list(verdict.lines)}


def _listed(corners: NDArray) -> list:
    """Corners as JSON holds them, null for those not seen."""
    return [point if np.isfinite(point).all() else None for point in corners.round(4).tolist()]
