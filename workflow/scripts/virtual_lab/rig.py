"""A sensor in front of the lab's bench: from linear radiance to the images that it writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import trimesh
from numpy.typing import NDArray
from palpate.capture.images import mosaic_rggb, write_image
from palpate.capture.tables import image_streams, write_frames
from palpate.units import METRES
from palpate.vision.camera import camera_from_spec
from scipy.spatial.transform import Rotation

from virtual_lab.kinect import KinectDepth
from virtual_lab.paint import BlockPaint, SolidPaint, plain_table, table_texture
from virtual_lab.probe import bench_props
from virtual_lab.render import Layer, Light, PosedCamera, look_at, render
from virtual_lab.rig_errors import RIG, RigErrors, seed_of
from virtual_lab.scene import Bench, Scene
from virtual_lab.shapes import shape_of

STILL_SAMPLES = 3
GAMMA, FULL_SCALE = 2.2, 255.0
LUMA = (0.299, 0.587, 0.114)
# Whole micrometres: processors that round otherwise write the same files.
CLOUD_DECIMALS = 6


class Exposure:
    """A linear picture, ready to be taken many times: blur, gamma, mosaic, noise, eight bits.

    Parameters
    ----------
    radiance : (h, w, 3) array
        Linear radiance; 1 is full scale at unit exposure.
    encoding : str
        ``bayer_rggb8``, ``rgb8`` or ``mono8``.
    options : mapping
        ``camera_noise`` block of lab.yaml: the variance of a sample [grey levels^2] is
        ``read_variance + shot_variance * level``.
    """

    def __init__(self, radiance: NDArray, encoding: str, options: Mapping) -> None:
        self.options = options
        blurred = cv2.GaussianBlur(radiance.astype(np.float32), (0, 0), options["blur_px"])
        # Gamma first: a flicker of the light is then a factor.
        levels = np.maximum(blurred, 0) ** (1 / GAMMA) * FULL_SCALE
        if encoding == "bayer_rggb8":
            levels = mosaic_rggb(levels)
        elif encoding == "mono8":
            levels = levels @ np.array(LUMA, dtype=np.float32)
        self.levels = np.ascontiguousarray(levels, dtype=np.float32)

    def shot(self, rng: np.random.Generator) -> NDArray:
        """One image with its own flicker and noise, (h, w) or (h, w, 3) uint8."""
        options = self.options
        flicker = (1 + options["flicker"] * rng.standard_normal()) ** (1 / GAMMA)
        levels = np.clip(self.levels * np.float32(flicker), 0, FULL_SCALE)
        std = np.sqrt(options["read_variance"] + options["shot_variance"] * levels)
        noisy = levels + std * rng.standard_normal(levels.shape, dtype=np.float32)
        return np.clip(np.round(noisy), 0, FULL_SCALE).astype(np.uint8)


@dataclass(frozen=True)
class Rig:
    """A sensor in front of a bench.

    Attributes
    ----------
    common : mapping
        lab.yaml without its objects.
    errors : RigErrors
        The sensor as it is, and what it is used with.
    views : dict
        Colour stream to its camera, the reference camera's first.
    depth : KinectDepth or None
    light : Light
    bench : Bench
    """

    common: Mapping
    errors: RigErrors
    views: Mapping[str, PosedCamera]
    depth: KinectDepth | None
    light: Light
    bench: Bench

    @property
    def sensor(self) -> Mapping:
        """The sensor as it is, in the form of its file."""
        return self.errors.sensor

    @property
    def reference(self) -> PosedCamera:
        """The reference camera with its pose."""
        return next(iter(self.views.values()))

    def still(self, scene: Scene) -> dict[str, Layer]:
        """Noise-free pictures of all colour streams."""
        return {
            stream: render(view, scene, self.light, samples=STILL_SAMPLES)
            for stream, view in self.views.items()
        }

    def exposed(self, radiance: NDArray, encoding: str) -> Exposure:
        """A linear picture (h, w, 3) as the sensor's cameras take it."""
        return Exposure(radiance, encoding, self.common["camera_noise"])

    def write(
        self, folder: Path, layers: Mapping[str, Layer], scene: Scene, number: int, seed: list
    ) -> dict[str, str]:
        """Write one frame's images, a depth of the scene; returns the file of each stream.

        Of a sensor that makes clouds, the depth's points in its place and no other image.
        """
        rng = np.random.default_rng([*seed, number])
        shake = np.random.default_rng([*seed, number, 1])
        shift_px = self.errors.size("shake_px") * shake.standard_normal(2)
        files, cloud = {}, "cloud" in self.sensor
        for stream, spec in image_streams(self.sensor).items():
            if stream == "depth":
                image = self.depth.image(scene, rng)
            else:
                image = self.exposed(_shaken(layers[stream].colour, shift_px), spec["encoding"])
                image = image.shot(rng)
            if not cloud:
                files[stream] = f"{stream}/{number:06d}.png"
                (folder / stream).mkdir(exist_ok=True)
                write_image(folder / files[stream], image, spec["encoding"])
        if cloud:
            # The depth is the last stream: what was drawn before it is as of the camera's images.
            files["cloud"] = f"cloud/{number:06d}.ply"
            (folder / "cloud").mkdir(exist_ok=True)
            points = np.round(self.depth.points(image), CLOUD_DECIMALS)
            points /= METRES[self.sensor["cloud"]["unit"]]
            trimesh.PointCloud(points).export(folder / files["cloud"])
        return files

    def write_still(self, folder: Path, scene: Scene, *, frames: int, seed: list) -> None:
        """Record a scene in which nothing moves into a folder of the capture format."""
        layers = self.still(scene)
        rows = [
            {"frame": k, "time_s": k / self.sensor["frame_rate_hz"]}
            | self.write(folder, layers, scene, k, seed)
            for k in range(frames)
        ]
        write_frames(folder, pd.DataFrame(rows))


def make_rig(
    common: Mapping,
    errors: RigErrors,
    placement: Mapping,
    bench: Bench,
    *,
    bumped_deg: Sequence[float] = (0, 0, 0),
    jolted_m: Sequence[float] = (0, 0, 0),
) -> Rig:
    """Set up a sensor before a bench.

    Parameters
    ----------
    common : mapping
        lab.yaml without its objects.
    errors : RigErrors
    placement : mapping
        ``target_m``, ``distance_m`` and ``elevation_deg`` of its reference camera.
    bench : Bench
    bumped_deg : (3,) sequence, optional
        Turn of the camera about its own axes after it was placed.
    jolted_m : (3,) sequence, optional
        Shift of the camera along its own axes, then [m].
    """
    sensor = errors.sensor
    pose = look_at(
        placement["target_m"],
        distance_m=placement["distance_m"],
        elevation_deg=placement["elevation_deg"],
        bumped_deg=bumped_deg,
    )
    pose[:3, 3] += pose[:3, :3] @ jolted_m
    depth = None if sensor["kind"] == "stereo" else _depth_camera(common, errors, pose)
    options = common["light"]
    towards = np.array(options["towards"], dtype=float)
    towards /= np.linalg.norm(towards)
    light = Light(towards, options["key"], options["ambient"], options["spread_rad"])
    return Rig(common, errors, _views(sensor, pose), depth, light, bench)


def object_bench(common: Mapping, spec: Mapping, *, name: str) -> Bench:
    """Paint the table and an object of lab.yaml; a plain table is bare, but for the object.

    A block without ``paint`` is foam with marks and lines through its points.
    """
    rng = np.random.default_rng(seed_of(common, name))
    if spec.get("table") == "plain":
        return Bench(plain_table(), _paint(spec, rng))
    return Bench(table_texture(rng), _paint(spec, rng), bench_props())


def bare_bench(common: Mapping, *, name: str) -> Bench:
    """A table for an experiment that needs no object."""
    rng = np.random.default_rng(seed_of(common, name))
    return Bench(table_texture(rng), None, bench_props())


def _paint(spec: Mapping, rng: np.random.Generator) -> BlockPaint | SolidPaint:
    if spec["shape"]["kind"] == "block" and "paint" not in spec:
        points = [point["position_m"] for point in spec["object"]["points"].values()]
        return BlockPaint(np.array(spec["shape"]["size_m"]), np.array(points), rng)
    vertices, _ = shape_of(spec).surface()
    return SolidPaint(spec["paint"], vertices, rng)


def _views(sensor: Mapping, pose: NDArray) -> dict[str, PosedCamera]:
    camera = camera_from_spec(sensor["color"])
    if sensor["kind"] != "stereo":
        return {"color": PosedCamera(camera, pose)}
    shift = np.eye(4)
    shift[0, 3] = sensor["stereo"]["baseline_m"]
    shift[:3, :3] = Rotation.from_rotvec(sensor["right_turn_rad"]).as_matrix()
    right = PosedCamera(camera_from_spec(sensor["right"]), pose @ shift)
    return {"left": PosedCamera(camera, pose), "right": right}


def depth_view(sensor: Mapping, pose: NDArray) -> PosedCamera:
    """The infrared camera of a sensor whose colour camera has a pose."""
    spec = sensor["depth"]
    return PosedCamera(camera_from_spec(spec), pose @ np.array(spec["color_from_depth"]))


def _depth_camera(common: Mapping, errors: RigErrors, pose: NDArray) -> KinectDepth:
    sensor = errors.sensor
    of_rig = () if errors.rig == RIG else ("rig", errors.rig)
    rng = np.random.default_rng(seed_of(common, *of_rig, sensor["sensor"], "device"))
    view = depth_view(sensor, pose)
    return KinectDepth(view, sensor["depth"], sensor["range_m"], common["kinect"], rng)


def _shaken(radiance: NDArray, shift_px: NDArray) -> NDArray:
    """A picture (h, w, 3) moved by a part of a pixel along x and y, (2,) [px]."""
    if not shift_px.any():
        return radiance
    move = np.column_stack([np.eye(2), shift_px])
    size = radiance.shape[1::-1]
    how = {"flags": cv2.INTER_CUBIC, "borderMode": cv2.BORDER_REPLICATE}
    return cv2.warpAffine(radiance, move, size, **how)
