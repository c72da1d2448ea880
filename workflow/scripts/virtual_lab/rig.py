"""A sensor in front of the lab's bench, and what it writes of each moment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import write_image
from palpate.capture.tables import image_streams, write_frames
from palpate.vision.camera import camera_from_spec
from scipy.spatial.transform import Rotation

from virtual_lab.cameras import Exposure, shaken
from virtual_lab.device import RIG, Device
from virtual_lab.kinect import KinectDepth
from virtual_lab.paint import BlockPaint, Paint, SolidPaint
from virtual_lab.props import bench_props
from virtual_lab.render import Layer, Light, View, look_at, render
from virtual_lab.scene import Bench, Scene
from virtual_lab.seeds import seed_of
from virtual_lab.shapes import shape_of
from virtual_lab.texture import plain_table, table_texture

STILL_SAMPLES = 3


@dataclass(frozen=True)
class Rig:
    """A sensor in front of a bench.

    Attributes
    ----------
    device : Device
        The sensor, and what it is used with.
    views : dict
        Colour stream to View, the reference camera's first.
    depth : KinectDepth or None
    light : Light
    bench : Bench
    noise : mapping
        ``camera_noise`` block of lab.yaml.
    """

    device: Device
    views: Mapping[str, View]
    depth: KinectDepth | None
    light: Light
    bench: Bench
    noise: Mapping

    @property
    def sensor(self) -> Mapping:
        """The sensor as it is, in the form of its file."""
        return self.device.sensor

    @property
    def reference(self) -> View:
        """View of the reference camera."""
        return next(iter(self.views.values()))

    def still(self, scene: Scene) -> dict[str, Layer]:
        """Noise-free pictures of all colour streams."""
        return {
            stream: render(view, scene, self.light, samples=STILL_SAMPLES)
            for stream, view in self.views.items()
        }

    def write(
        self, folder: Path, layers: Mapping[str, Layer], scene: Scene, number: int, seed: list
    ) -> dict[str, str]:
        """Write one frame's images, a depth of the scene; returns the file of each stream."""
        rng = np.random.default_rng([*seed, number])
        shake = np.random.default_rng([*seed, number, 1])
        shift_px = self.device.size("shake_px") * shake.standard_normal(2)
        files = {}
        for stream, spec in image_streams(self.sensor).items():
            files[stream] = f"{stream}/{number:06d}.png"
            if stream == "depth":
                image = self.depth.image(scene, rng)
            else:
                picture = shaken(layers[stream].colour, shift_px)
                image = Exposure(picture, spec["encoding"], self.noise).shot(rng)
            (folder / stream).mkdir(exist_ok=True)
            write_image(folder / files[stream], image, spec["encoding"])
        return files

    def write_still(self, folder: Path, scene: Scene, *, frames: int, seed: list) -> None:
        """Film a scene in which nothing moves into a folder of the capture format."""
        layers = self.still(scene)
        rows = [
            {"frame": k, "time_s": k / self.sensor["frame_rate_hz"]}
            | self.write(folder, layers, scene, k, seed)
            for k in range(frames)
        ]
        write_frames(folder, pd.DataFrame(rows))


def make_rig(
    common: Mapping,
    device: Device,
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
    device : Device
    placement : mapping
        ``target_m``, ``distance_m`` and ``elevation_deg`` of its reference camera.
    bench : Bench
    bumped_deg : (3,) sequence, optional
        Turn of the camera about its own axes, from where it is placed.
    jolted_m : (3,) sequence, optional
        Shift of the camera along its own axes, then [m].

    Raises
    ------
    ValueError
        If the target is outside the sensor's range.
    """
    sensor = device.sensor
    low, high = sensor["range_m"]
    found = placement["distance_m"]
    if not low <= found <= high:
        raise ValueError(f"distance_m: expected {low} to {high} m for its sensor, found {found}")
    pose = look_at(
        placement["target_m"],
        distance_m=found,
        elevation_deg=placement["elevation_deg"],
        bumped_deg=bumped_deg,
    )
    pose[:3, 3] += pose[:3, :3] @ jolted_m
    depth = None if sensor["kind"] == "stereo" else _depth_camera(common, device, pose)
    noise = common["camera_noise"]
    return Rig(device, _views(sensor, pose), depth, make_light(common["light"]), bench, noise)


def make_light(options: Mapping) -> Light:
    """Light of the lab from the ``light`` block of lab.yaml."""
    towards = np.array(options["towards"], dtype=float)
    towards /= np.linalg.norm(towards)
    return Light(towards, options["key"], options["ambient"], options["spread_rad"])


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


def _paint(spec: Mapping, rng: np.random.Generator) -> Paint:
    if spec["shape"]["kind"] == "block" and "paint" not in spec:
        points = [point["position_m"] for point in spec["object"]["points"].values()]
        return BlockPaint(np.array(spec["shape"]["size_m"]), np.array(points), rng)
    vertices, _ = shape_of(spec).surface()
    return SolidPaint(spec["paint"], vertices, rng)


def _views(sensor: Mapping, pose: NDArray) -> dict[str, View]:
    camera = camera_from_spec(sensor["color"])
    if sensor["kind"] != "stereo":
        return {"color": View(camera, pose)}
    shift = np.eye(4)
    shift[0, 3] = sensor["stereo"]["baseline_m"]
    shift[:3, :3] = Rotation.from_rotvec(sensor["right_turn_rad"]).as_matrix()
    right = View(camera_from_spec(sensor["right"]), pose @ shift)
    return {"left": View(camera, pose), "right": right}


def depth_view(sensor: Mapping, pose: NDArray) -> View:
    """View of the infrared camera of a sensor whose colour camera has a pose."""
    spec = sensor["depth"]
    return View(camera_from_spec(spec), pose @ np.array(spec["color_from_depth"]))


def _depth_camera(common: Mapping, device: Device, pose: NDArray) -> KinectDepth:
    sensor = device.sensor
    of_rig = () if device.rig == RIG else ("rig", device.rig)
    rng = np.random.default_rng(seed_of(common, *of_rig, sensor["sensor"], "device"))
    view = depth_view(sensor, pose)
    return KinectDepth(view, sensor["depth"], sensor["range_m"], common["kinect"], rng)


def frame_times(
    common: Mapping, count: int, rate_hz: float, rng: np.random.Generator
) -> Sequence[float]:
    """Times at which a camera takes its frames, with jitter, shape (count,) [s]."""
    jitter = common["timing"]["frame_jitter_s"] * rng.standard_normal(count)
    return np.arange(count) / rate_hz + np.clip(jitter, -0.25 / rate_hz, 0.25 / rate_hz)
