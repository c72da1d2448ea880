"""From depth images to clouds of the object with normals (Sections 4.1.2, 4.1.4)."""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from palpate.capture.depth import depth_of
from palpate.capture.streams import all_streams
from palpate.frames import Film, write_film
from palpate.open3d_core import o3d
from palpate.vision.camera import PinholeCamera, camera_from_spec, pixel_rays
from palpate.vision.depth import stereo_depth
from palpate.vision.marker import board_of
from palpate.vision.options import Clouds, SupportPlane
from palpate.vision.probe import AXIS, TIP, marker_transforms
from palpate.vision.support_plane import SAMPLES, fit_support_plane, height_above

# So far may the object lie beside where template and tip put it (an operator misses the declared
# point by 10 mm, an indentation from the side goes as deep), and above it (noise, and the
# table's) [m].
BESIDE_M, ABOVE_M = 0.020, 0.010
# A point is dropped whose mean distance to so many neighbours exceeds the mean by so many standard
# deviations.
OUTLIER_NEIGHBOURS, OUTLIER_RATIO = 20, 2.0
# The points nearest to the tip say which piece is the object: some 4 cm2.
AT_TIP = 100
# Of the object's base, what may lie beyond its reach: noise.
MOST_ACROSS = 0.03
# Of a frame's points, beside them.
COUNT = "count"


class Cloud(NamedTuple):
    """Points and their unit normals, camera frame, both (n, 3); points in metres."""

    points_m: NDArray
    normals: NDArray


class Reach(NamedTuple):
    """What the object's template and its pressed point say of how far it reaches.

    Attributes
    ----------
    tip_m : (3,) array
        Tip's centre when it presses most, camera frame [m].
    beside_m : float
        Of the template from the declared point, along the table [m].
    height_m : float
        Of the template above the table [m].
    """

    tip_m: NDArray
    beside_m: float
    height_m: float

    def holds(self, points_m: NDArray, plane: NDArray) -> NDArray:
        """Whether points may be the object's by their distance from table and tip, shape (n,)."""
        beside = np.linalg.norm(np.cross(points_m - self.tip_m, plane[:3]), axis=1)
        low = height_above(plane, points_m) < self.height_m + ABOVE_M
        return low & (beside < self.beside_m + BESIDE_M)


class ProbePlace(NamedTuple):
    """Tip's centre [m], pressing direction, the target's centre and its sheet's corners (4, 3) [m].

    All in the camera frame; the corners go around the sheet.
    """

    tip_m: NDArray
    axis: NDArray
    board_m: NDArray
    sheet_m: NDArray


def probe_places(poses: pd.DataFrame, probe: Mapping) -> list[ProbePlace]:
    """Where the probe is in each frame of probe_pose.csv."""
    outline_m = board_of(probe["marker"]).outline_m
    centre = np.append(outline_m.mean(axis=0), 0)
    # What is printed and an even margin, so wide that the corners lie on the exclusion radius:
    # |half + margin| = radius, a quadratic equation in the margin.
    half, radius = np.ptp(outline_m, axis=0) / 2, probe["exclusion"]["board_radius_m"]
    total, excess = half.sum(), half @ half - radius**2
    margin = (np.sqrt(max(total**2 - 2 * excess, 0.0)) - total) / 2
    x, y = half + max(margin, 0.0)
    corners = centre + np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    transforms = marker_transforms(poses)
    boards = transforms[:, :3, :3] @ centre + transforms[:, :3, 3]
    sheets = corners @ transforms[:, :3, :3].swapaxes(1, 2) + transforms[:, None, :3, 3]
    columns = (poses[TIP].to_numpy(float), poses[AXIS].to_numpy(float), boards, sheets)
    return [ProbePlace(*row) for row in zip(*columns, strict=True)]


def scene_points(
    images: Mapping[str, NDArray], sensor: Mapping, wanted: NDArray | None = None
) -> NDArray:
    """All points that one frame's images give, whatever they belong to.

    Parameters
    ----------
    images : mapping
        ``left`` and ``right``, or ``depth``, as `palpate.capture` reads them.
    sensor : mapping
        The sensor's file.
    wanted : (h, w) bool array, optional
        Pixels of the reference camera; a stereo pair is matched around these alone.

    Returns
    -------
    (n, 3) array
        Points in the frame of the reference camera [m], within the sensor's range.
    """
    stereo = sensor["kind"] == "stereo"
    if stereo:
        spec = sensor["color"]
        flat_m = stereo_depth(images["left"], images["right"], sensor, wanted).ravel()
    else:
        spec = sensor["depth"]
        flat_m = depth_of(images["depth"], spec).ravel()
    valid = (flat_m >= sensor["range_m"][0]) & (flat_m <= sensor["range_m"][1])
    points = pixel_rays(camera_from_spec(spec))[valid] * flat_m[valid, None]
    if stereo:
        return points
    color_from_depth = np.array(spec["color_from_depth"])
    return points @ color_from_depth[:3, :3].T + color_from_depth[:3, 3]


def table_of(folder: str | Path, sensor: Mapping, options: SupportPlane, *, seed: int) -> NDArray:
    """Plane of the table from all frames of a background, as `fit_support_plane` finds it, (4,)."""
    rng = np.random.default_rng(seed)
    each = (scene_points(images, sensor) for images in all_streams(folder, sensor))
    points = np.concatenate([rng.permutation(found)[:SAMPLES] for found in each])
    return fit_support_plane(points, inlier_distance_m=options.inlier_distance_m, rng=rng)


def clouds_of(
    folder: str | Path,
    sensor: Mapping,
    probe: Mapping,
    masks: Sequence[NDArray],
    poses: pd.DataFrame,
    plane: NDArray,
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
    masks : sequence of (h, w) bool arrays
        Of all frames.
    poses : DataFrame
        probe_pose.csv.
    plane : (4,) array
        The table.
    reach : Reach
    options : Clouds
    frames : sequence of int, optional
        All by default.

    Raises
    ------
    ValueError
        If a frame shows no points.
    """
    camera, places = camera_from_spec(sensor["color"]), probe_places(poses, probe)
    chosen = range(len(masks)) if frames is None else frames
    for k, images in zip(chosen, all_streams(folder, sensor, chosen), strict=True):
        mask = masks[k]
        points = scene_points(images, sensor, mask)
        if not len(points):
            nearest_m, farthest_m = sensor["range_m"]
            expected = f"points {nearest_m:g} to {farthest_m:g} m away"
            raise ValueError(f"frame {k}: depth: expected {expected}, found none")
        try:
            cloud = object_cloud(
                points, mask, camera, plane, places[k], probe["exclusion"], reach, options
            )
        except ValueError as error:
            raise ValueError(f"{folder}: frame {k}: {error}") from error
        logging.info("frame %d: %d points", k, len(cloud.points_m))
        yield cloud


def object_cloud(
    points_m: NDArray,
    mask: NDArray,
    camera: PinholeCamera,
    plane: NDArray,
    place: ProbePlace,
    exclusion: Mapping,
    reach: Reach,
    options: Clouds,
) -> Cloud:
    """Keep of a frame's points what belongs to the object, thinned and with normals (Eq. 4.4-4.6).

    Parameters
    ----------
    points_m : (n, 3) array
        Points of the scene, camera frame [m].
    mask : (h, w) bool array
        Foreground of the reference camera.
    camera : PinholeCamera
        The reference camera.
    plane : (4,) array
        The table (`fit_support_plane`).
    place : ProbePlace
        Where the probe is.
    exclusion : mapping
        ``exclusion`` block of the probe's file.
    reach : Reach
    options : Clouds

    Raises
    ------
    ValueError
        If nothing is left, or the object goes on where its template ends.
    """
    seen = points_m[height_above(plane, points_m) > options.lowest_m]
    seen = seen[in_mask(seen, mask, camera)]
    seen = seen[~belongs_to_probe(seen, place, exclusion)]
    kept = seen[reach.holds(seen, plane)]
    if len(kept) <= options.normal_neighbours:
        raise ValueError(f"cloud: expected points of the object, found {len(kept)}")
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(kept))
    cloud = cloud.voxel_down_sample(options.voxel_m)
    cloud, _ = cloud.remove_statistical_outlier(OUTLIER_NEIGHBOURS, OUTLIER_RATIO)
    cloud = cloud.select_by_index(_piece_at(reach.tip_m, cloud, options.cluster_gap_m))
    low = seen[height_above(plane, seen) < reach.height_m / 2]
    _check_end(np.asarray(cloud.points), low, plane, reach, options.cluster_gap_m)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(options.normal_neighbours))
    cloud.orient_normals_towards_camera_location(np.zeros(3))
    return Cloud(np.asarray(cloud.points), np.asarray(cloud.normals))


def in_mask(points_m: NDArray, mask: NDArray, camera: PinholeCamera) -> NDArray:
    """Whether points project into an image's foreground, shape (n,)."""
    pixels = np.round(camera.project(points_m)).astype(int)
    found = ((pixels >= 0) & (pixels < mask.shape[::-1])).all(axis=1)
    found[found] = mask[pixels[found, 1], pixels[found, 0]]
    return found


def belongs_to_probe(points_m: NDArray, place: ProbePlace, exclusion: Mapping) -> NDArray:
    """Whether points lie near the probe's axis above the tip, the tip or the target, shape (n,).

    Up to ``stem_m`` above the tip the probe is as thin as the tip, and then as wide as its handle.
    What is seen through the target's sheet is the target too, wherever its repeating pattern was
    matched: it is only found when nothing stands before it.
    """
    offset = points_m - place.tip_m
    along = offset @ place.axis
    across = np.linalg.norm(offset - along[:, None] * place.axis, axis=1)
    tip_radius_m = exclusion["tip_radius_m"]
    handle_from_m = max(tip_radius_m, exclusion.get("stem_m", 0.0))
    tip = np.linalg.norm(offset, axis=1) < tip_radius_m
    wide_m = np.where(along < -handle_from_m, exclusion["radius_m"], tip_radius_m)
    shaft = (along < -tip_radius_m) & (across < wide_m)
    board = np.linalg.norm(points_m - place.board_m, axis=1) < exclusion["board_radius_m"]
    sides = points_m @ np.cross(place.sheet_m, np.roll(place.sheet_m, -1, axis=0)).T
    return tip | shaft | board | (sides > 0).all(axis=1) | (sides < 0).all(axis=1)


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
    for name, array in (("points_m", points), ("normals", normals)):
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


def _check_end(
    piece_m: NDArray, low_m: NDArray, plane: NDArray, reach: Reach, gap_m: float
) -> None:
    """Reject an object that goes on, near the table, where its template ends: an arm is above."""
    if not len(low_m):
        return
    points, label = _pieces(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(low_m)), gap_m)
    joined = label[cKDTree(piece_m).query(points)[0] < gap_m]
    across = ~reach.holds(points, plane)[np.isin(label, joined)]
    if len(across) and across.mean() > MOST_ACROSS:
        raise ValueError(
            f"cloud: expected the object to end {reach.beside_m + BESIDE_M:.2f} m beside the tip,"
            f" as template and point say, found {across.mean():.0%} of its foot beyond (template,"
            " point, transforms of the probe?)"
        )
