"""Whether the images of a capture's two streams are of the same moments.

The probe's board moves by some millimetres in a capture, and both streams show it: a depth image
how far away it is, the other image of a stereo head in which rows. Where the two disagree, and
would agree in another order, the images are not in theirs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from palpate.capture.depth import depth_of
from palpate.capture.findings import Findings
from palpate.capture.images import read_image
from palpate.capture.tables import FRAMES, image_streams, read_frames
from palpate.units import MILLIMETRES

DETECTION = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
# With fewer frames chance could do it.
FEWEST_FRAMES = 8
# Parts of the board's motion (standard deviation): so far the streams must disagree, by their root
# mean square and in each of some frames, and so well agree when each is sorted by what it shows.
# Noise of the depth as large as the motion itself makes 0.41 when sorted.
DISAGREE, DISAGREE_EACH, AGREE_SORTED = 1.0, 0.5, 0.2
FEWEST_OFF = 3
# Less is noise [mm, px].
LEAST = 1.0
# Refinement of corners, and what of them a pose may leave [px].
WINDOW_PX, WORST_FIT_PX = 5, 1.0
STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-3)
# Of the squares around the inner corners, how much counts as board; pixels with depth on it.
BORDER, FEWEST_READINGS = 0.6, 20


@dataclass(frozen=True)
class Disagreement:
    """Root mean square of how far two streams are apart, as given and when both are sorted."""

    given: float
    resorted: float


def disagreement(first: ArrayLike, second: ArrayLike) -> Disagreement | None:
    """Compare one motion as two streams show it.

    Parameters
    ----------
    first, second : (n,) array
        The same coordinate in each frame, but for a constant [mm or px].

    Returns
    -------
    Disagreement or None
        None unless it is the frames' order that is wrong, and nothing else.
    """
    one, other = (np.asarray(values, dtype=float) for values in (first, second))
    if len(one) < FEWEST_FRAMES:
        return None
    one, other = one - one.mean(), other - other.mean()
    moved = one.std()
    off = other - one
    found = Disagreement(float(off.std()), float((np.sort(other) - np.sort(one)).std()))
    each = np.sort(np.abs(off - np.median(off)))[-FEWEST_OFF]
    disagree = found.given >= max(LEAST, DISAGREE * moved) and each >= DISAGREE_EACH * moved
    return found if disagree and found.resorted <= AGREE_SORTED * moved else None


def examine_order(
    folder: Path,
    frames: pd.DataFrame,
    corners_px: Sequence[NDArray | None],
    sensor: Mapping,
    marker: Mapping,
) -> Findings:
    """Hold the order of a capture's second stream to that of its first.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``.
    frames : DataFrame
        Its frames.csv, whose images are right by their size and kind.
    corners_px : sequence of (n, 2) array or None
        The board's corners in each frame of the first stream.
    sensor : mapping
        The sensor's specification.
    marker : mapping
        Of the probe's specification.

    Returns
    -------
    Findings
    """
    first, stream = image_streams(sensor)
    seen, unit = (_rows, "px") if sensor["kind"] == "stereo" else (_distances, "mm")
    both = [
        (name, at) for name, at in zip(frames[stream], corners_px, strict=True) if at is not None
    ]
    if len(both) < FEWEST_FRAMES:
        return Findings()
    paths, corners = [folder / name for name, _ in both], [at for _, at in both]
    found = disagreement(*seen(paths, corners, sensor, marker))
    if found is None:
        return Findings()
    expected = f"the board where {first} shows it, frame by frame"
    line = f"found it {found.given:.1f} {unit} off, {found.resorted:.1f} {unit} in another order"
    return Findings((f"{folder / FRAMES}: {stream}: expected {expected}, {line}",))


def wrong_order(folder: str | Path, sensor: Mapping, marker: Mapping) -> str | None:
    """Say that a capture's second stream is in another order than its first; None when it is not.

    See `examine_order` for the parameters.
    """
    folder, first = Path(folder), next(iter(image_streams(sensor)))
    frames = read_frames(folder)
    corners = [board_corners(grey_frame(folder / name, sensor), marker) for name in frames[first]]
    return next(iter(examine_order(folder, frames, corners, sensor, marker).wrong), None)


def grey_frame(path: Path, sensor: Mapping) -> NDArray:
    """Read a frame of a colour or grey camera as grey levels, (h, w) uint8."""
    image = read_image(path, sensor["color"]["encoding"])
    return cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image


def board_corners(grey: NDArray, marker: Mapping) -> NDArray | None:
    """Inner corners of the probe's board in an (h, w) image, (n, 2) [px]; None if any is hidden."""
    found, corners = cv2.findChessboardCorners(
        grey, tuple(marker["inner_corners"]), flags=DETECTION
    )
    if not found:
        return None
    start = np.ascontiguousarray(corners.reshape(-1, 1, 2).astype(np.float32))
    window = (WINDOW_PX, WINDOW_PX)
    return cv2.cornerSubPix(grey, start, window, (-1, -1), STOP).reshape(-1, 2).astype(float)


def _rows(
    paths: Sequence[Path], corners_px: Sequence[NDArray], sensor: Mapping, marker: Mapping
) -> tuple[NDArray, NDArray]:
    """Mean row of the board in both rectified images of each frame, two (n,) [px]."""
    pairs = []
    for path, corners in zip(paths, corners_px, strict=True):
        others = board_corners(grey_frame(path, sensor), marker)
        if others is not None:
            pairs.append((corners[:, 1].mean(), others[:, 1].mean()))
    return tuple(np.array(pairs).reshape(-1, 2).T)


def _distances(
    paths: Sequence[Path], corners_px: Sequence[NDArray], sensor: Mapping, marker: Mapping
) -> tuple[NDArray, NDArray]:
    """Depth of the board by its corners and by the depth images, two (n,) [mm].

    Both are taken where the board is in all depth images, as the corners say, so that an image
    says the same whichever corners it is held to.
    """
    poses = [_pose(corners, sensor, marker) for corners in corners_px]
    fitting = [(path, pose) for path, pose in zip(paths, poses, strict=True) if pose is not None]
    paths, poses = [path for path, _ in fitting], [pose for _, pose in fitting]
    places_px = _always_board(poses, sensor["depth"], marker)
    if len(places_px) < FEWEST_READINGS:
        return np.zeros(0), np.zeros(0)
    rays = cv2.undistortPoints(places_px[:, None].astype(float), *_lens(sensor["depth"]))
    rays = np.column_stack([rays.reshape(-1, 2), np.ones(len(places_px))])
    planes_m = np.array([(pose[:3, 2] @ pose[:3, 3]) / (rays @ pose[:3, 2]) for pose in poses])
    usual_m, pairs = planes_m.mean(axis=0), []
    for path, plane_m in zip(paths, planes_m, strict=True):
        seen_m = depth_of(read_image(path, sensor["depth"]["encoding"]), sensor["depth"])
        off_m = seen_m[tuple(places_px.T[::-1])] - usual_m
        if np.isfinite(off_m).sum() >= FEWEST_READINGS:
            pairs.append(((plane_m - usual_m).mean(), np.nanmedian(off_m)))
    return tuple(MILLIMETRES * np.array(pairs).reshape(-1, 2).T)


def _pose(corners_px: NDArray, sensor: Mapping, marker: Mapping) -> NDArray | None:
    """Pose of the board in the depth camera's frame, (4, 4) [m]; None where none fits."""
    board_m, lens = _board_m(marker), _lens(sensor["color"])
    found, turn, shift = cv2.solvePnP(board_m, corners_px, *lens, flags=cv2.SOLVEPNP_IPPE)
    if not found:
        return None
    left_px = cv2.projectPoints(board_m, turn, shift, *lens)[0].reshape(-1, 2) - corners_px
    if np.sqrt((left_px**2).sum(axis=1).mean()) > WORST_FIT_PX:
        return None
    color_from_board = np.eye(4)
    color_from_board[:3] = np.column_stack([cv2.Rodrigues(turn)[0], shift])
    return np.linalg.inv(np.array(sensor["depth"]["color_from_depth"])) @ color_from_board


def _always_board(poses: Sequence[NDArray], depth: Mapping, marker: Mapping) -> NDArray:
    """Pixels of the depth image that show the board in all frames, (n, 2)."""
    columns, rows = marker["inner_corners"]
    ends = np.array([[0, 0], [columns - 1, 0], [columns - 1, rows - 1], [0, rows - 1]])
    outer = ends + BORDER * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    outer_m = marker["square_m"] * np.column_stack([outer, np.zeros(4)])
    shown = np.ones((depth["height_px"], depth["width_px"]), np.uint8)
    for pose in poses:
        corners_m = outer_m @ pose[:3, :3].T + pose[:3, 3]
        zero = np.zeros(3)
        pixels = cv2.projectPoints(corners_m, zero, zero, *_lens(depth))[0].reshape(-1, 2)
        this = cv2.fillConvexPoly(np.zeros_like(shown), np.rint(pixels).astype(np.int32), 1)
        shown &= this
    return np.argwhere(shown)[:, ::-1]


def _board_m(marker: Mapping) -> NDArray:
    """Inner corners of the board in its own frame, row by row, (n, 3) [m]."""
    columns, rows = marker["inner_corners"]
    y, x = np.mgrid[:rows, :columns]
    return marker["square_m"] * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def _lens(spec: Mapping) -> tuple[NDArray, NDArray]:
    """Camera matrix and distortion of a block of the sensor's file."""
    matrix = [[spec["fx_px"], 0, spec["cx_px"]], [0, spec["fy_px"], spec["cy_px"]], [0, 0, 1]]
    return np.array(matrix, dtype=float), np.array(spec["distortion"], dtype=float)
