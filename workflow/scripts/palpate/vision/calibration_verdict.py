"""What a calibration's views tell, and what they leave open."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.board import FlatBoard
from palpate.vision.calibration import Calibration
from palpate.vision.pair_calibration import PairCalibration

# Standard errors up to which a thing is told. E takes up to three times the relative error of
# lengths, and a press is wanted to a percent or two.
FOCAL_SHARE, CENTRE_SHARE, BASELINE_SHARE = 0.005, 0.01, 0.005
# Cameras that are next to each other have no long baseline to be compared with [m].
SHIFT_M, TURN_RAD = 0.0005, np.deg2rad(0.1)
# Of the way from the principal point to the picture's farthest corner, that corners must reach.
REACH = 0.8
# Boards that all lean less than this have nearly one direction.
LEAST_TILT_RAD = np.deg2rad(10)
# Corners at the board's edge that are this many times as far off as those within it.
EDGE_FACTOR = 1.5


@dataclass(frozen=True)
class Verdict:
    """Whether the views tell each part of a calibration.

    Attributes
    ----------
    told : dict
        Part to whether it is told.
    lines : tuple of str
        A line for each part, then what is doubtful.
    """

    told: Mapping[str, bool]
    lines: tuple[str, ...]

    @property
    def all_told(self) -> bool:
        """Whether nothing is left open."""
        return all(self.told.values())


def camera_verdict(found: Calibration, board: FlatBoard) -> Verdict:
    """Whether one camera's views tell its focal length, principal point and distortion."""
    camera, errors = found.camera, found.standard_errors
    focal = max(errors["fx_px"] / camera.fx_px, errors["fy_px"] / camera.fy_px)
    centre = max(errors["cx_px"], errors["cy_px"])
    far = reach(found)
    kept = ", ".join(found.terms) or "none"
    return _verdict(
        {
            "focal length": (focal <= FOCAL_SHARE, f"to {PERCENT * focal:.2g} %"),
            "principal point": (centre <= CENTRE_SHARE * camera.fx_px, f"to {centre:.2g} px"),
            "distortion": (
                far >= REACH,
                f"({kept}) as far as {PERCENT * far:.0f} % of the way to all picture's corners",
            ),
        },
        [*_leaning(found), *_edges(found, board)],
    )


def pair_verdict(found: PairCalibration) -> Verdict:
    """Whether the pairs tell the transform between two cameras."""
    shift, turn = found.baseline_error_m, float(np.sqrt(np.trace(found.covariance[:3, :3])))
    far = np.sqrt(np.trace(found.covariance[3:, 3:]))
    enough = max(BASELINE_SHARE * found.baseline_m, SHIFT_M)
    return _verdict(
        {
            "baseline": (shift <= enough, f"to {shift * MILLIMETRES:.2g} mm"),
            "translation": (far <= 2 * enough, f"to {far * MILLIMETRES:.2g} mm"),
            "rotation": (turn <= TURN_RAD, f"to {np.rad2deg(turn):.2g} degrees"),
        },
        [],
    )


def _verdict(parts: Mapping[str, tuple[bool, str]], doubts: list[str]) -> Verdict:
    lines = [f"{part}: {'' if told else 'not '}told, {how}" for part, (told, how) in parts.items()]
    lines += [f"doubtful: {doubt}" for doubt in doubts]
    return Verdict({part: bool(told) for part, (told, _) in parts.items()}, tuple(lines))


def reach(found: Calibration) -> float:
    """Share of the way from centre to picture's corners that is seen, the least of the four."""
    camera = found.camera
    centre = np.array([camera.cx_px, camera.cy_px])
    ends = np.array([[x, y] for x in (0, camera.width_px) for y in (0, camera.height_px)])
    seen = np.concatenate(list(found.corners_px.values()))
    seen = seen[np.isfinite(seen).all(axis=1)]
    towards = ends - centre
    lengths = np.hypot(*towards.T)
    # A corner counts for the picture's corner that it lies nearest to the direction of.
    away = seen - centre
    nearest = (away @ (towards / lengths[:, None]).T).argmax(axis=1)
    shares = np.hypot(*away.T) / lengths[nearest]
    return float(min(shares[nearest == k].max(initial=0) for k in range(len(ends))))


def _leaning(found: Calibration) -> list[str]:
    """A line if no board leans."""
    normals = np.array([pose[:3, 2] for pose in found.camera_from_board.values()])
    most = float(np.arccos(np.clip(np.abs(normals[:, 2]), 0, 1)).max())
    if most >= LEAST_TILT_RAD:
        return []
    return [f"no board leans by more than {np.rad2deg(most):.0f} degrees: tilt it by 30"]


def _edges(found: Calibration, board: FlatBoard) -> list[str]:
    """A line if the corners at the board's edge are worse than those within it."""
    places = board.points_m[:, :2]
    inside = ((places > places.min(axis=0)) & (places < places.max(axis=0))).all(axis=1)
    off = np.array(
        [
            np.hypot(*(_projected(found, board, view) - corners).T)
            for view, corners in found.corners_px.items()
        ]
    )
    edge, middle = (float(np.nanmedian(off[:, part])) for part in (~inside, inside))
    if not edge > EDGE_FACTOR * middle:
        return []
    return [
        f"corners at the board's edge are off by {edge:.2f} px, those within it by {middle:.2f}:"
        " leave more white around it, and hold it flat"
    ]


def _projected(found: Calibration, board: FlatBoard, view: str) -> NDArray:
    pose = found.camera_from_board[view]
    return found.camera.project(board.points_m @ pose[:3, :3].T + pose[:3, 3])
