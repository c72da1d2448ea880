"""From depth images, or clouds, to clouds of the object with normals (Sections 4.1.2, 4.1.4)."""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.capture.discover import BACKGROUND
from palpate.capture.images import Cloud, all_streams, depth_of
from palpate.npz import Film, write_film
from palpate.open3d_core import o3d
from palpate.vision.camera import PinholeCamera, camera_from_spec, pixel_rays
from palpate.vision.depth import stereo_depth
from palpate.vision.marker import board_of
from palpate.vision.options import Clouds, SupportPlane
from palpate.vision.probe import AXIS, TIP, marker_transforms
from palpate.vision.support_plane import SAMPLES, fit_support_plane, height_above
from palpate.yaml_files import mismatch

# How far the object may lie beside where template and tip put it (an operator misses the point by
# 10 mm, an indentation from the side goes as deep), and above it (noise, the table's too) [m].
BESIDE_M, ABOVE_M = 0.020, 0.010
# A point goes whose mean distance to so many neighbours is so many deviations above the mean.
OUTLIER_NEIGHBOURS, OUTLIER_RATIO = 20, 2.0
# The points nearest to the tip say which piece is the object: some 4 cm2.
AT_TIP = 100
# Of the object's base, what may lie beyond its reach: noise.
MOST_ACROSS = 0.03
# Of a frame's points, beside them.
COUNT = "count"
AT_ORIGIN = np.zeros(3)


class Reach(NamedTuple):
    """What the object's template and its pressed point say of how far it reaches."""

    tip_m: NDArray  # (3,), tip's centre when it presses most, camera frame [m]
    beside_m: float  # of the template from the declared point, along the table [m]
    height_m: float  # of the template above the table [m]
    plane: NDArray  # (4,), the table as `fit_support_plane` finds it, camera frame

    def holds(self, points_m: NDArray) -> NDArray:
        """Whether points may be the object's by their distance from table and tip, shape (n,)."""
        beside = np.linalg.norm(np.cross(points_m - self.tip_m, self.plane[:3]), axis=1)
        low = height_above(self.plane, points_m) < self.height_m + ABOVE_M
        return low & (beside < self.beside_m + BESIDE_M)


class ProbePlace(NamedTuple):
    """Where the probe is in a frame, and what of the scene is taken for it."""

    # (3,), tip's centre [m] and pressing direction, camera frame
    tip_m: NDArray
    axis: NDArray
    # (3,) and (4, 3), centre of the target and the corners around its sheet, camera frame [m]
    board_m: NDArray | None
    sheet_m: NDArray | None
    exclusion: Mapping  # the block of the probe's file
    eye_m: NDArray = AT_ORIGIN  # (3,), where the camera is [m]

    def holds(self, points_m: NDArray) -> NDArray:
        """Whether points lie near the axis above the tip, the tip or the target, shape (n,).

        Up to ``stem_m`` above the tip the probe is as thin as the tip, then as wide as its handle.
        """
        offset = points_m - self.tip_m
        along = offset @ self.axis
        across = np.linalg.norm(offset - along[:, None] * self.axis, axis=1)
        thin_m = self.exclusion["tip_radius_m"]
        handle_from_m = max(thin_m, self.exclusion.get("stem_m", 0.0))
        wide_m = np.where(along < -handle_from_m, self.exclusion["radius_m"], thin_m)
        found = np.linalg.norm(offset, axis=1) < thin_m
        found |= (along < -thin_m) & (across < wide_m)
        if self.board_m is None:
            return found
        away = np.linalg.norm(points_m - self.board_m, axis=1)
        found |= away < self.exclusion["board_radius_m"]
        # What is seen through the target's sheet is the target too, wherever its repeating pattern
        # was matched: it is only found when nothing stands before it.
        sheet, sight = self.sheet_m - self.eye_m, points_m - self.eye_m
        sides = sight @ np.cross(sheet, np.roll(sheet, -1, axis=0)).T
        return found | (sides > 0).all(axis=1) | (sides < 0).all(axis=1)


def viewpoint_of(sensor: Mapping) -> NDArray:
    """Where the camera is in the frame of its points, (3,) [m]: of clouds elsewhere than 0."""
    return np.array(sensor.get("cloud", {}).get("viewpoint_m", AT_ORIGIN), dtype=float)


def probe_places(
    poses: pd.DataFrame, probe: Mapping, eye_m: NDArray = AT_ORIGIN
) -> list[ProbePlace]:
    """Where the probe is in each frame of probe_pose.csv, seen by a camera there [m]."""
    exclusion, path = probe["exclusion"], (poses[TIP].to_numpy(float), poses[AXIS].to_numpy(float))
    if "marker" not in probe:
        return [ProbePlace(*row, None, None, exclusion, eye_m) for row in zip(*path, strict=True)]
    outline_m = board_of(probe["marker"]).outline_m
    centre = np.append(outline_m.mean(axis=0), 0)
    # What is printed and an even margin, so wide that the corners lie on the exclusion radius:
    # |half + margin| = radius, a quadratic equation in the margin.
    half = np.ptp(outline_m, axis=0) / 2
    total, excess = half.sum(), half @ half - exclusion["board_radius_m"] ** 2
    margin = (np.sqrt(max(total**2 - 2 * excess, 0.0)) - total) / 2
    x, y = half + max(margin, 0.0)
    corners = centre + np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    transforms = marker_transforms(poses)
    boards = transforms[:, :3, :3] @ centre + transforms[:, :3, 3]
    sheets = corners @ transforms[:, :3, :3].swapaxes(1, 2) + transforms[:, None, :3, 3]
    rows = zip(*path, boards, sheets, strict=True)
    return [ProbePlace(*row, exclusion, eye_m) for row in rows]


def scene_cloud(images: Mapping, sensor: Mapping, wanted: NDArray | None = None) -> Cloud:
    """All points that one frame's images give, whatever they belong to.

    Parameters
    ----------
    images : mapping
        ``left`` and ``right``, ``depth`` or ``cloud``, as `palpate.capture` reads them.
    sensor : mapping
        The sensor's file.
    wanted : (h, w) bool array, optional
        Pixels of the reference camera; a stereo pair is matched around these alone.

    Returns
    -------
    Cloud
        In the frame of the reference camera [m], within the sensor's range; with normals where the
        file of a cloud has them.

    Raises
    ------
    ValueError
        If all points of a cloud are nearer or farther than the sensor's range.
    """
    nearest_m, farthest_m = sensor["range_m"]
    if sensor["kind"] == "cloud":
        away_m = np.linalg.norm(images["cloud"].points_m - viewpoint_of(sensor), axis=1)
        found = images["cloud"].at((away_m >= nearest_m) & (away_m <= farthest_m))
        if len(found.points_m):
            return found
        expected = f"points {nearest_m:g} to {farthest_m:g} m from the camera (range_m)"
        hint = f"(is their unit {sensor['cloud']['unit']}?)"
        raise mismatch("cloud", expected, f"them {np.median(away_m):.3g} m away {hint}")
    if sensor["kind"] == "stereo":
        spec, color_from_camera = sensor["color"], np.eye(4)
        depth_m = stereo_depth(images["left"], images["right"], sensor, wanted).ravel()
    else:
        spec, color_from_camera = sensor["depth"], np.array(sensor["depth"]["color_from_depth"])
        depth_m = depth_of(images["depth"], spec).ravel()
    valid = (depth_m >= nearest_m) & (depth_m <= farthest_m)
    points = pixel_rays(camera_from_spec(spec))[valid] * depth_m[valid, None]
    return Cloud(points @ color_from_camera[:3, :3].T + color_from_camera[:3, 3])


def table_of(folder: str | Path, sensor: Mapping, options: SupportPlane, *, seed: int) -> NDArray:
    """Plane (4,) of the table as `fit_support_plane` finds it, and with its errors.

    From all frames of a background; of clouds without one from the first frame of a capture.
    """
    rng, eye_m, turn = np.random.default_rng(seed), viewpoint_of(sensor), np.eye(3)
    empty = sensor["kind"] != "cloud" or Path(folder).name == BACKGROUND
    images = all_streams(folder, sensor, None if empty else [0])
    each = (scene_cloud(one, sensor).points_m for one in images)
    points = np.concatenate([rng.permutation(found)[:SAMPLES] for found in each]) - eye_m
    if eye_m.any():
        # In axes of a camera there: z ahead, and y as far down as can be.
        axes = [[0, 0, 1.0], [0, -1.0, 0]], [points.mean(axis=0), [0, 0, 1.0]]
        turn = Rotation.align_vectors(*axes, weights=[np.inf, 1])[0].as_matrix()
    plane = fit_support_plane(points @ turn.T, **dict(options), rng=rng, empty=empty)
    normal = plane[:3] @ turn
    return np.append(normal, plane[3] - normal @ eye_m)


def _background(folder: Path, sensor: Mapping, reach: Reach, options: Clouds) -> NDArray:
    """What a background's clouds hold above the table, thinned, (n, 3) [m]; none without one."""
    frames = all_streams(folder, sensor) if folder.is_dir() else ()
    each = (scene_cloud(images, sensor).points_m for images in frames)
    high = [points[height_above(reach.plane, points) > options.lowest_m] for points in each]
    every = o3d.utility.Vector3dVector(np.concatenate([np.zeros((0, 3)), *high]))
    return np.asarray(o3d.geometry.PointCloud(every).voxel_down_sample(options.voxel_m).points)


def clouds_of(
    folder: str | Path,
    sensor: Mapping,
    probe: Mapping,
    masks: Sequence[NDArray] | None,
    poses: pd.DataFrame,
    reach: Reach,
    options: Clouds,
    frames: Sequence[int] | None = None,
) -> Iterator[Cloud]:
    """Clouds of the object, with normals, camera frame, one after the other.

    Parameters
    ----------
    folder : path
        Of a capture.
    sensor, probe : mapping
        Specifications.
    masks : sequence of (h, w) bool arrays or None
        Of all frames; None of a sensor of clouds, of whose points those near the points of the
        background beside the capture, where there is one, are not the object's.
    poses : DataFrame
        probe_pose.csv.
    reach, options : Reach and Clouds
    frames : sequence of int, optional
        All by default.

    Raises
    ------
    ValueError
        If a frame shows no points.
    """
    places = probe_places(poses, probe, viewpoint_of(sensor))
    if masks is None:
        known = cKDTree(_background(Path(folder).parent / BACKGROUND, sensor, reach, options))
    chosen = range(len(poses)) if frames is None else frames
    for k, images in zip(chosen, all_streams(folder, sensor, chosen), strict=True):
        mask = None if masks is None else masks[k]
        try:
            scene = scene_cloud(images, sensor, mask)
            if not len(scene.points_m):
                away = "{:g} to {:g} m away".format(*sensor["range_m"])
                raise ValueError(f"depth: expected points {away}, found none")
            if mask is None:
                near_m, _ = known.query(scene.points_m, distance_upper_bound=options.lowest_m)
                new = np.isinf(near_m)
            else:
                new = in_mask(scene.points_m, mask, camera_from_spec(sensor["color"]))
            cloud = object_cloud(scene.at(new), places[k], reach, options)
        except ValueError as error:
            raise ValueError(f"{folder}: frame {k}: {error}") from error
        logging.info("frame %d: %d points", k, len(cloud.points_m))
        yield cloud


def object_cloud(scene: Cloud, place: ProbePlace, reach: Reach, options: Clouds) -> Cloud:
    """Keep of a frame's points the object's, thinned and with normals (Eq. 4.4-4.6).

    Parameters
    ----------
    scene : Cloud
        Points that are not the background's.
    place : ProbePlace
    reach : Reach
    options : Clouds

    Raises
    ------
    ValueError
        If nothing is left, or the object goes on where its template ends.
    """
    scene = scene.at(height_above(reach.plane, scene.points_m) > options.lowest_m)
    scene = scene.at(~place.holds(scene.points_m))
    seen, kept = scene.points_m, scene.at(reach.holds(scene.points_m))
    if len(kept.points_m) <= options.normal_neighbours:
        raise ValueError(f"cloud: expected points of the object, found {len(kept.points_m)}")
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(kept.points_m))
    if kept.normals is not None:
        cloud.normals = o3d.utility.Vector3dVector(kept.normals)
        cloud.orient_normals_towards_camera_location(place.eye_m)
    cloud = cloud.voxel_down_sample(options.voxel_m)
    cloud, _ = cloud.remove_statistical_outlier(OUTLIER_NEIGHBOURS, OUTLIER_RATIO)
    cloud = cloud.select_by_index(_piece_at(reach.tip_m, cloud, options.cluster_gap_m))
    low = seen[height_above(reach.plane, seen) < reach.height_m / 2]
    _check_end(np.asarray(cloud.points), low, reach, options.cluster_gap_m)
    if cloud.has_normals():
        cloud.normalize_normals()
    else:
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(options.normal_neighbours))
    cloud.orient_normals_towards_camera_location(place.eye_m)
    return Cloud(np.asarray(cloud.points), np.asarray(cloud.normals))


def in_mask(points_m: NDArray, mask: NDArray, camera: PinholeCamera) -> NDArray:
    """Whether points project into an image's foreground, shape (n,)."""
    pixels = np.round(camera.project(points_m)).astype(int)
    inside = ((pixels >= 0) & (pixels < mask.shape[::-1])).all(axis=1)
    found = np.zeros_like(inside)
    found[inside] = mask[pixels[inside, 1], pixels[inside, 0]]
    return found


def save_clouds(path: str | Path, clouds: Iterable[Cloud]) -> None:
    """Write clouds in single precision as NPZ, as they come."""
    each = (
        {name: np.asarray(array, np.float32) for name, array in cloud._asdict().items()}
        | {COUNT: np.array(len(cloud.points_m))}
        for cloud in clouds
    )
    write_film(path, each)


def read_clouds(path: str | Path) -> Film:
    """Read clouds.npz or rest_cloud.npz, each cloud when it is asked for.

    Raises
    ------
    ValueError
        If the file is damaged, or its arrays do not belong together.
    """
    return Film(path, (*Cloud._fields, COUNT), _checked)


def _checked(points: NDArray, normals: NDArray, count: ArrayLike) -> Cloud:
    for name, array in zip(Cloud._fields, (points, normals), strict=True):
        if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind != "f":
            found = f"{array.dtype} of shape {array.shape}"
            raise ValueError(f"{name}: expected numbers of shape (n, 3), found {found}")
        if [len(array)] != (written := np.ravel(count).tolist()):
            raise ValueError(f"{name}: expected as many as {COUNT}, {written}, found {len(array)}")
    return Cloud(points.astype(float), normals.astype(float))


def _pieces(cloud: "o3d.geometry.PointCloud", gap_m: float) -> tuple[NDArray, NDArray]:
    """Voxels of half a gap, an eighth of the time for all points, and which piece each is of."""
    coarse = cloud.voxel_down_sample(gap_m / 2)
    return np.asarray(coarse.points), np.asarray(coarse.cluster_dbscan(gap_m, min_points=1))


def _piece_at(place_m: NDArray, cloud: "o3d.geometry.PointCloud", gap_m: float) -> NDArray:
    """Indices of the piece that has most of the points nearest to a place."""
    coarse, piece = _pieces(cloud, gap_m)
    points = np.asarray(cloud.points)
    piece = piece[cKDTree(coarse).query(points)[1]]
    nearest = np.argsort(np.linalg.norm(points - place_m, axis=1), kind="stable")[:AT_TIP]
    return np.flatnonzero(piece == np.bincount(piece[nearest]).argmax())


def _check_end(piece_m: NDArray, low_m: NDArray, reach: Reach, gap_m: float) -> None:
    """Reject an object that goes on, near the table, where its template ends: an arm is above."""
    if not len(low_m):
        return
    points, label = _pieces(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(low_m)), gap_m)
    joined = label[cKDTree(piece_m).query(points)[0] < gap_m]
    across = ~reach.holds(points)[np.isin(label, joined)]
    if len(across) and across.mean() > MOST_ACROSS:
        expected = f"the object to end {reach.beside_m + BESIDE_M:.2f} m beside the tip"
        beyond = f"{across.mean():.0%} of its foot beyond"
        hint = "(template, point, transforms of the probe?)"
        raise mismatch("cloud", f"{expected}, as template and point say", f"{beyond} {hint}")
