"""Pictures of a target in folders, as people keep them: one folder for each camera."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.images import Stream, grey
from palpate.capture.poses import PoseRecord, read_poses
from palpate.capture.tables import read_frames
from palpate.config.sensor import said_of_base
from palpate.vision.board import FlatBoard
from palpate.vision.camera import camera_from_spec
from palpate.vision.marker import CornerFollower
from palpate.vision.pose import candidate_poses, settle
from palpate.yaml_files import mismatch, one_line

ENDINGS = (".png", ".tif", ".tiff", ".jpg", ".jpeg")
# Of pictures of 16 bits, the share that may be brighter than white: glints.
GLINTS_PERCENT = 99.5
# Frames show one pose if it changes by less, and none in a gap of the record of poses.
SAME_M, SAME_RAD, LARGEST_GAP_S = 0.001, 0.003, 0.5
# Half the time of a speed; how far off their pose corners are at most, if the file does not say.
SPEED_S, THRESHOLD_PX = 0.1, 0.5


@dataclass(frozen=True)
class BoardPictures:
    """What was found in a folder's pictures."""

    folder: str | Path
    corners: dict[str, NDArray]  # view to its corners (n, 2) [px]
    missing: dict[str, str]  # view to why there are none
    size_px: tuple[int, int]  # (width, height)
    coloured: bool  # whether the pictures have colours


def read_pictures(folders: Sequence[Path], board: FlatBoard) -> list[BoardPictures]:
    """Find a target in the pictures of one or two folders.

    Pictures of two folders are pairs by equal names, or else in the order of their names.

    Raises
    ------
    ValueError
        If a folder has no pictures, one can't be read or is of another size, none shows the
        target, or two folders without equal names have different numbers of pictures.
    """
    files = [_pictures(folder) for folder in folders]
    if len(files) > 1 and not set(files[0]) & set(files[1]):
        if len(files[0]) != len(files[1]):
            expected = f"{len(files[0])} as in {folders[0]}, or equal names"
            raise mismatch(f"{folders[1]}: pictures", expected, len(files[1]))
        files[1] = dict(zip(files[0], files[1].values(), strict=True))
    return [_found(*of_folder, board) for of_folder in zip(folders, files, strict=True)]


def _pictures(folder: Path) -> dict[str, Path]:
    """Pictures of a folder by name, in the order of their names."""
    paths = sorted(p for p in folder.iterdir() if p.suffix.lower() in ENDINGS and p.is_file())
    if not paths:
        raise ValueError(f"{folder}: pictures: expected PNG, TIFF or JPEG files, found none")
    found: dict[str, Path] = {}
    for path in paths:
        if path.stem in found:
            raise mismatch(f"{folder}: names", "one picture of a name", f"{path.stem} twice")
        found[path.stem] = path
    return found


def _found(folder: Path, files: Mapping[str, Path], board: FlatBoard) -> BoardPictures:
    images, coloured = {}, False
    for name, path in files.items():
        images[name], has_colours = _grey(path)
        coloured |= has_colours
        (height, width), (h, w) = next(iter(images.values())).shape, images[name].shape
        if (height, width) != (h, w):
            expected = f"{width} x {height} pixels as the first"
            raise mismatch(f"{path}: picture", expected, f"{w} x {h}")
    return board_in(folder, images, board, coloured=coloured)


def board_in(
    source: str | Path, images: Mapping[str, NDArray], board: FlatBoard, *, coloured: bool = False
) -> BoardPictures:
    """Find a target in grey pictures (h, w) of one size, by view.

    Raises
    ------
    ValueError
        If none shows the target.
    """
    each = {view: board.find(image) for view, image in images.items()}
    corners = {view: found for view, found in each.items() if found is not None}
    missing = {view: "the target was not found" for view in each if view not in corners}
    if not corners:
        raise mismatch(f"{source}: pictures", board.described, f"none in {len(images)} pictures")
    height, width = next(iter(images.values())).shape
    return BoardPictures(source, corners, missing, (width, height), coloured)


def _grey(path: Path) -> tuple[NDArray, bool]:
    """Eight bits of grey, and whether the file has colours."""
    content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_UNCHANGED) if len(content) else None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        raise ValueError(
            one_line(f"{path}: picture: expected PNG, TIFF or JPEG, found one that can't be read")
        )
    coloured = image.ndim == 3
    if coloured:
        image = cv2.cvtColor(image[..., :3], cv2.COLOR_BGR2GRAY)
    if image.dtype != np.uint8:
        white = max(float(np.percentile(image, GLINTS_PERCENT)), 1.0)
        image = np.clip(image * (255 / white), 0, 255).astype(np.uint8)
    return image, coloured


@dataclass(frozen=True)
class Views:
    """Poses in which a camera saw the target, in the order of time."""

    names: NDArray  # (n,) array of str
    corners_px: NDArray  # (n, k, 2), of the target, NaN where one is not seen [px]
    # (n, 4, 4), by the corners of each view, and by the record of poses
    camera_from_target: NDArray
    base_from_tracked: NDArray
    # (n, 6), deviations of `base_from_tracked` and its changes in a second: a rotation vector
    # applied in the base frame, and the shift [rad, m]
    std: NDArray
    speed: NDArray

    def some(self, kept: NDArray) -> "Views":
        """Those of a mask."""
        return Views(*(getattr(self, field.name)[kept] for field in fields(self)))


def tracked_views(folder: str | Path, sensor: Mapping, board: FlatBoard) -> Views:
    """Find a target on a tracked frame in the reference camera's images of a recording.

    Of frames in which the tracked frame stays, corners and poses are averaged.

    Parameters
    ----------
    folder : path
        With frames.csv, images and probe_poses.csv.
    sensor : mapping
        The sensor's file, whose block ``base`` may say how well poses are known.
    board : FlatBoard

    Raises
    ------
    ValueError
        If no frame with a pose shows the target.
    """
    camera, follow = camera_from_spec(sensor["color"]), CornerFollower(board)
    noise_m, noise_rad = (said_of_base(sensor, name) for name in ("pose_std_m", "pose_std_rad"))
    record = read_poses(folder).filled(noise_m)
    none = np.full((len(board.points_m), 2), np.nan)
    found = [follow(grey(image)) for image in Stream(folder, sensor)]
    follow.require_right()
    corners = np.array([none if one is None else one for one in found])
    time_s = read_frames(folder)["time_s"].to_numpy(float)
    inside = np.clip(time_s, *record.time_s[[0, -1]])
    poses, std_m = record.at(inside, largest_gap_s=LARGEST_GAP_S)
    usable = np.isfinite(corners).any(axis=(1, 2)) & np.isfinite(poses).all(axis=(1, 2))
    rests = _rests(poses, np.flatnonzero(usable & (inside == time_s)))
    means = [_mean(corners[rest]) for rest in rests]
    limit_px = sensor.get("marker", {}).get("reprojection_threshold_px", THRESHOLD_PX)
    placed = settle([candidate_poses(one, camera, board, threshold_px=limit_px) for one in means])
    kept = [k for k, pose in enumerate(placed) if pose]
    if not kept:
        found = f"none of {len(time_s)}"
        raise mismatch(f"{folder}: marker", "the target in frames with a pose", found)
    seen, rests = np.array([placed[k].camera_from_marker for k in kept]), [rests[k] for k in kept]
    means = np.array([means[k] for k in kept])
    for pose, one in zip(seen, means, strict=True):
        off_px = camera.project(board.points_m @ pose[:3, :3].T + pose[:3, 3]) - one
        one[np.linalg.norm(off_px, axis=1) > limit_px] = np.nan
    tracked = np.array([poses[rest].mean(axis=0) for rest in rests])
    tracked[:, :3, :3] = Rotation.from_matrix(tracked[:, :3, :3]).as_matrix()
    std = np.array([[noise_rad] * 3 + [std_m[rest].max()] * 3 for rest in rests])
    names = [f"frames {rest[0]} to {rest[-1]}" for rest in rests]
    speed = _speeds(record, np.array([time_s[rest].mean() for rest in rests]))
    return Views(np.array(names), means, seen, tracked, std, speed)


def _rests(poses: NDArray, usable: NDArray) -> list[NDArray]:
    """Numbers of neighbouring frames, of those usable, in which the tracked frame stays."""
    parts, first = [], None
    for k in usable:
        if first is not None:
            step = np.linalg.inv(poses[first]) @ poses[k]
            turn_rad = Rotation.from_matrix(step[:3, :3]).magnitude()
            if np.linalg.norm(step[:3, 3]) <= SAME_M and turn_rad <= SAME_RAD:
                parts[-1].append(k)
                continue
        parts.append([first := k])
    return [np.array(part) for part in parts]


def _mean(corners: NDArray) -> NDArray:
    """Mean corners of frames (f, n, 2), NaN for those that half of the frames do not show."""
    shown = np.isfinite(corners[..., 0]).sum(axis=0)[:, None]
    mean = np.nansum(corners, axis=0) / np.maximum(shown, 1)
    return np.where(2 * shown >= len(corners), mean, np.nan)


def _speeds(record: PoseRecord, time_s: NDArray) -> NDArray:
    """Turn and shift in a second (n, 6), base frame; 0 where poses stand alone."""
    ends = [np.clip(time_s + step, *record.time_s[[0, -1]]) for step in (-SPEED_S, SPEED_S)]
    before, after = (record.at(end, largest_gap_s=LARGEST_GAP_S)[0] for end in ends)
    speed = np.zeros((len(time_s), 6))
    known = np.isfinite(before + after).all(axis=(1, 2))
    turns = after[known, :3, :3] @ before[known, :3, :3].transpose(0, 2, 1)
    speed[known, :3] = Rotation.from_matrix(turns).as_rotvec()
    speed[known, 3:] = (after - before)[known, :3, 3]
    return speed / np.maximum(ends[1] - ends[0], SPEED_S)[:, None]
