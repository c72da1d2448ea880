"""Poses of the probe, or of a target, at a folder's frames, and whether both streams agree on them.

The target moves by some millimetres in a capture, and both streams show it: a depth image how far
away it is, the other image of a stereo head in which rows and columns. Where the two disagree and
would agree in another order, the images are not in theirs; where one is always farther away than
the other, the target's squares or the sensor's optics are not what their files say.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from palpate.capture.images import Stream, depth_of, grey, read_image
from palpate.capture.poses import LARGEST_GAP_S, POSES, read_poses
from palpate.capture.tables import FRAMES, image_streams, read_frames
from palpate.units import MILLIMETRES
from palpate.vision.camera import PinholeCamera, camera_from_spec
from palpate.vision.marker import board_of
from palpate.vision.options import ProbePose
from palpate.vision.probe import (
    marker_columns,
    marker_transforms,
    placed_poses,
    pose_table,
    recorded_poses,
    track_probe,
)
from palpate.yaml_files import mismatch

# With fewer frames chance could do it.
FEWEST_FRAMES = 8
# Parts of the board's motion (standard deviation): so far the streams must disagree, by their root
# mean square and in each of some frames, and so well agree when each is sorted by what it shows.
# Noise of the depth as large as the motion itself makes 0.41 when sorted.
DISAGREE, DISAGREE_EACH, AGREE_SORTED = 1.0, 0.5, 0.2
FEWEST_OFF = 3
# Less is noise [mm, px].
LEAST = 1.0
# A depth camera's error, its calibration's and the corners' are some per cent together; a stereo
# head's are those of its baseline and focal length.
LARGEST_SCALE = {"stereo": 1.02, "depth": 1.08, "structured_light": 1.08}
# Rows of a rectified pair are alike to parts of a pixel.
LARGEST_ROWS_PX = 1.5
# Of the outer squares, how much does not count as board; pixels with depth on it.
RIM, FEWEST_READINGS = 0.4, 20
INWARD = np.array([[1], [-1]])


def followed(
    folder: str | Path, sensor: Mapping, probe: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Poses of the probe at every frame of a folder: by its probe_poses.csv, else by the target.

    Parameters
    ----------
    folder : path
        Folder of a capture, or of a recording without force.
    sensor, probe : mapping
        Specifications.
    options : ProbePose

    Raises
    ------
    ValueError
        As `read_poses`, `placed_poses`, `track_probe` and `require_agreement` do.
    """
    time_s = read_frames(folder)["time_s"].to_numpy()
    if (Path(folder) / POSES).is_file():
        poses = placed_poses(read_poses(folder), time_s, sensor)
        sought = f"expected poses at most {LARGEST_GAP_S:g} s apart about the frames"
        return pose_table(poses, time_s, probe, options, sought=f"{Path(folder) / POSES}: {sought}")
    frames = Stream(folder, sensor, samples=True)
    table = track_probe(frames, time_s, sensor, probe, options)
    require_agreement(folder, sensor, probe["marker"], table)
    found, refined = table["detected"].sum(), table["refined"].sum()
    logging.info("marker found in %d of %d frames, refined in %d", found, len(table), refined)
    return table


def board_followed(
    folder: str | Path, sensor: Mapping, marker: Mapping, options: ProbePose
) -> pd.DataFrame:
    """Poses of a target in the frames of a folder that show it, as `track_probe` has them.

    Columns ``frame, time_s, detected`` and those of the target's pose.

    Parameters
    ----------
    folder : path
        Folder of a recording.
    sensor, marker : mapping
        The sensor's file, and the block of a probe's.
    options : ProbePose

    Raises
    ------
    ValueError
        If no frame shows the target, or as `require_agreement` does.
    """
    frames = Stream(folder, sensor, samples=True)
    found = recorded_poses(frames, sensor, marker, options)
    seen = [k for k, pose in enumerate(found) if pose]
    if not seen:
        within = f"its corners within {sensor['marker']['reprojection_threshold_px']:g} px"
        raise mismatch(f"{folder}: marker", within, f"in none of {len(found)} frames")
    times_s = read_frames(folder)["time_s"].to_numpy()[seen]
    poses = pd.DataFrame({"frame": seen, "time_s": times_s, "detected": 1})
    poses = poses.join(marker_columns(np.array([found[k].camera_from_marker for k in seen])))
    require_agreement(folder, sensor, marker, poses.set_index("frame").reindex(range(len(found))))
    return poses


def disagreement(first: ArrayLike, second: ArrayLike) -> tuple[float, float] | None:
    """Root mean square distances of two streams' motions, as given and when both are sorted.

    None unless it is the frames' order that is wrong, and nothing else. The motions (n,) are the
    same coordinate in each frame, but for a constant [mm or px].
    """
    one, other = (np.asarray(values, dtype=float) for values in (first, second))
    if len(one) < FEWEST_FRAMES:
        return None
    one, other = one - one.mean(), other - other.mean()
    moved, off = one.std(), other - one
    given, resorted = float(off.std()), float((np.sort(other) - np.sort(one)).std())
    each = np.sort(np.abs(off - np.median(off)))[-FEWEST_OFF]
    disagree = given >= max(LEAST, DISAGREE * moved) and each >= DISAGREE_EACH * moved
    return (given, resorted) if disagree and resorted <= AGREE_SORTED * moved else None


def require_agreement(
    folder: str | Path, sensor: Mapping, marker: Mapping, poses: pd.DataFrame
) -> None:
    """Reject a capture whose second stream shows the board elsewhere than its first.

    Parameters
    ----------
    folder : path
    sensor, marker : mapping
        The sensor's file, and the block of the probe's.
    poses : DataFrame
        Of `palpate.vision.probe.track_probe`, of the first stream.

    Raises
    ------
    ValueError
        If a pair is not rectified, the board is nearer or farther by its corners, or the order of
        the frames is another.
    """
    folder, (first, stream) = Path(folder), image_streams(sensor)
    names, place = read_frames(folder)[stream], f"{folder / FRAMES}: {stream}"
    seen, is_pair = np.flatnonzero(poses["detected"] == 1), sensor["kind"] == "stereo"
    paths, boards = [folder / names[k] for k in seen], marker_transforms(poses.iloc[seen])
    found = np.array([*(_in_pairs if is_pair else _in_depths)(paths, boards, sensor, marker)])
    if len(found) < FEWEST_FRAMES:
        text = "%s: the board is not compared with that of %s: in %d frames, of %d at least"
        logging.info(text, stream, first, len(found), FEWEST_FRAMES)
        return
    off_px = float(np.median(found[:, 1] - found[:, 0]))
    if is_pair and abs(off_px) > LARGEST_ROWS_PX:
        row = f"the board within {LARGEST_ROWS_PX:g} px of its row in the other picture"
        off = f"it {off_px:+.1f} px off (palpate calibrate camera says how to rectify)"
        raise mismatch(place, f"a rectified pair, with {row}", off)
    _require_scale(found[:, 2:], sensor, marker, stream)
    order = disagreement(*found[:, :2].T)
    if order is not None:
        unit = "px" if is_pair else "mm"
        off = f"it {order[0]:.1f} {unit} off, {order[1]:.1f} {unit} in another order"
        raise mismatch(place, f"the board where {first} shows it, frame by frame", off)


def _require_scale(distances_m: NDArray, sensor: Mapping, marker: Mapping, stream: str) -> None:
    """Compare the board's distance by its corners with that by the second stream, (n, 2) [m]."""
    by_corners, by_stream = np.median(distances_m, axis=0)
    scale, largest = by_corners / by_stream, LARGEST_SCALE[sensor["kind"]]
    if 1 / largest <= scale <= largest:
        return
    side, things = ("square_m", "squares") if "square_m" in marker else ("tag_m", "tags")
    color, side_m, field = sensor["color"], marker[side], f"marker.{side}"
    counts = "another count of depth than the sensor's encoding says"
    if unit_m := sensor.get("depth", {}).get("count_m"):
        field += " or depth.count_m"
        counts = f"depth.count_m of {unit_m * scale:.3g} for {unit_m:g}"
    raise ValueError(
        f"{field}: expected the board {by_stream:.3f} m away, where {stream} shows it,"
        f" found it at {by_corners:.3f} m by its corners ({things} of {side_m / scale:.3g} m"
        f" for {side_m:g}? images of another size than {color['width_px']} x {color['height_px']}"
        f" px with fx_px {color['fx_px']:g}? {counts}?)"
    )


def _in_pairs(
    paths: Sequence[Path], boards: NDArray, sensor: Mapping, marker: Mapping
) -> Iterator[tuple]:
    """Mean row of the board in both rectified images [px], and its distance by both [m]."""
    camera, printed = camera_from_spec(sensor["color"]), board_of(marker)
    for path, board in zip(paths, boards, strict=True):
        right = printed.find(grey(read_image(path, sensor["color"]["encoding"])))
        if right is None:
            continue
        seen = np.isfinite(right[:, 0])
        right, places_m = right[seen], printed.points_m[seen] @ board[:3, :3].T + board[:3, 3]
        left = camera.project(places_m)
        disparity = float((left - right)[:, 0].mean())
        away_m = camera.fx_px * sensor["stereo"]["baseline_m"] / max(disparity, 1e-3)
        yield left[:, 1].mean(), right[:, 1].mean(), places_m[:, 2].mean(), away_m


def _in_depths(
    paths: Sequence[Path], boards: NDArray, sensor: Mapping, marker: Mapping
) -> Iterator[tuple]:
    """Distance of the board by its corners and by the depth images [mm, mm, m, m]."""
    camera, spec = camera_from_spec(sensor["depth"]), sensor["depth"]
    boards = np.linalg.inv(np.array(spec["color_from_depth"])) @ boards
    # An image says the same here whichever corners it is compared with.
    places_px = _always_board(boards, camera, marker)
    if len(places_px) < FEWEST_READINGS:
        return
    rays, normals = camera.rays(places_px), boards[:, :3, 2]
    planes_m = np.einsum("fi,fi->f", normals, boards[:, :3, 3])[:, None] / (normals @ rays.T)
    usual_m, (nearest_m, farthest_m) = planes_m.mean(axis=0), sensor["range_m"]
    for path, plane_m in zip(paths, planes_m, strict=True):
        seen_m = depth_of(read_image(path, spec["encoding"]), spec)[tuple(places_px.T[::-1])]
        seen_m = np.where((seen_m >= nearest_m) & (seen_m <= farthest_m), seen_m, np.nan)
        if np.isfinite(seen_m).sum() >= FEWEST_READINGS:
            off = (plane_m - usual_m).mean(), np.nanmedian(seen_m - usual_m)
            yield *np.multiply(off, MILLIMETRES), plane_m.mean(), np.nanmedian(seen_m)


def _always_board(boards: NDArray, camera: PinholeCamera, marker: Mapping) -> NDArray:
    """Pixels of the depth image that show the board in all frames, (n, 2)."""
    printed = board_of(marker)
    (left, top), (right, bottom) = printed.outline_m + RIM * printed.unit_m * INWARD
    outer_m = np.array([[left, top, 0], [right, top, 0], [right, bottom, 0], [left, bottom, 0]])
    shown = np.ones((camera.height_px, camera.width_px), np.uint8)
    for board in boards:
        pixels = camera.project(outer_m @ board[:3, :3].T + board[:3, 3])
        shown &= cv2.fillConvexPoly(np.zeros_like(shown), np.rint(pixels).astype(np.int32), 1)
    return np.argwhere(shown)[:, ::-1]
