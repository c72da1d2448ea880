"""One recording of the virtual lab: a capture in the users' format, and its truth apart."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import trimesh
import yaml
from numpy.typing import NDArray

from palpate.capture.images import write_image
from palpate.capture.tables import image_streams, write_force, write_frames
from palpate.lab.block import ContactLadder, box_surface
from palpate.lab.cameras import KinectDepth, color_image
from palpate.lab.motion import Hand, ProbeMotion
from palpate.lab.relaxation import relaxed_force
from palpate.lab.render import (
    Layer,
    Light,
    View,
    look_at,
    projected_box,
    render,
    render_change,
)
from palpate.lab.scene import OBJECT, PROBE_PARTS, Bench, Probe, Scene, make_bench, make_probe
from palpate.lab.wrench import gauge_record
from palpate.vision.camera import camera_from_spec

FACING = np.array([0.0, -1.0, 0.0])
STILL_SAMPLES, MOVING_SAMPLES = 3, 4
BOX_MARGIN_PX = 10
# The surface moves visibly within this distance of the point.
MOVED_RADIUS_M = 0.045


@dataclass(frozen=True)
class Rig:
    """A sensor in front of a bench.

    Attributes
    ----------
    sensor : mapping
        The sensor's file.
    views : dict
        Colour stream to View, the reference camera's first.
    depth : KinectDepth or None
    light : Light
    bench : Bench
    noise : mapping
        ``camera_noise`` block of lab.yaml.
    """

    sensor: Mapping
    views: Mapping[str, View]
    depth: KinectDepth | None
    light: Light
    bench: Bench
    noise: Mapping

    @property
    def reference(self) -> View:
        """View of the reference camera."""
        return next(iter(self.views.values()))

    def capture(
        self, folder: Path, layers: Mapping[str, Layer], scene: Scene, number: int, seed: list
    ) -> dict[str, str]:
        """Write one frame's images; returns the file of each stream."""
        rng = np.random.default_rng([*seed, number])
        files = {}
        for stream, spec in image_streams(self.sensor).items():
            files[stream] = f"{stream}/{number:06d}.png"
            if stream == "depth":
                image = self.depth.image(scene, rng)
            else:
                image = color_image(layers[stream].colour, spec["encoding"], self.noise, rng)
            (folder / stream).mkdir(exist_ok=True)
            write_image(folder / files[stream], image, spec["encoding"])
        return files


def make_rig(common: Mapping, spec: Mapping, sensor: Mapping, *, name: str) -> Rig:
    """Set up a sensor before an object's bench.

    Parameters
    ----------
    common : mapping
        lab.yaml without its objects.
    spec : mapping
        The object's block of lab.yaml.
    sensor : mapping
        The sensor's file.
    name : str
        The object's name.

    Raises
    ------
    ValueError
        If the target is outside the sensor's range.
    """
    camera = spec["cameras"][sensor["sensor"]]
    low, high = sensor["range_m"]
    if not low <= camera["distance_m"] <= high:
        found = camera["distance_m"]
        raise ValueError(f"distance_m: expected {low} to {high} m for its sensor, found {found}")
    pose = look_at(
        camera["target_m"], distance_m=camera["distance_m"], elevation_deg=camera["elevation_deg"]
    )
    points = np.array([point["position_m"] for point in spec["object"]["points"].values()])
    rng = np.random.default_rng(seed_of(common, name))
    bench = make_bench(np.array(spec["size_m"]), points, rng)
    towards = np.array(common["light"]["towards"], dtype=float)
    light = Light(
        towards / np.linalg.norm(towards),
        common["light"]["key"],
        common["light"]["ambient"],
        common["light"]["spread_rad"],
    )
    views = _views(sensor, pose)
    depth = None if sensor["kind"] == "stereo" else _depth_camera(common, sensor, pose)
    return Rig(sensor, views, depth, light, bench, common["camera_noise"])


def record_background(folder: Path, rig: Rig, *, frames: int, seed: list) -> None:
    """Film the bare table into a folder of the capture format."""
    scene = Scene()
    layers = _still_layers(rig, scene)
    rows = [
        {"frame": k, "time_s": k / rig.sensor["frame_rate_hz"]}
        | rig.capture(folder, layers, scene, k, seed)
        for k in range(frames)
    ]
    write_frames(folder, pd.DataFrame(rows))


def record_capture(
    folder: Path,
    rig: Rig,
    ladder: ContactLadder,
    common: Mapping,
    spec: Mapping,
    probe_spec: Mapping,
    *,
    seed: list,
) -> dict[str, NDArray]:
    """Press, film and weigh: write a capture's folder and return its truth.

    Parameters
    ----------
    folder : Path
        Empty folder to fill.
    rig : Rig
    ladder : ContactLadder
        Mechanics of the point.
    common, spec, probe_spec : mapping
        lab.yaml without its objects, the object's block of it, the probe's file.
    seed : list of int
        Seed of this recording.

    Returns
    -------
    dict
        Arrays of truth.npz; see docs/architecture.md.
    """
    motion, radius = spec["motion"], probe_spec["indenter"]["radius_m"]
    hand = Hand(
        motion,
        point_m=ladder.point_m,
        radius_m=radius,
        facing=FACING,
        rng=np.random.default_rng([*seed, 1]),
    )
    frame_time_s = np.arange(motion["frames"]) / motion["frame_rate_hz"]
    force_time_s, force_n = _record_force(folder, hand, ladder, common, spec, probe_spec, seed)
    path = hand.at(frame_time_s)
    surfaces = ladder.surface_at(path.depth_m)
    masks = _film(folder, rig, ladder, surfaces, path, make_probe(probe_spec), seed)
    transform = rig.reference.camera_from_object
    turn = transform[:3, :3]
    normal_force = np.interp(frame_time_s, force_time_s, force_n)
    return {
        "time_s": frame_time_s,
        "tip_m": path.tip_m @ turn.T + transform[:3, 3],
        "axis": path.object_from_force[:, :, 2] @ turn.T,
        "force_n": normal_force[:, None] * (turn @ [0.0, 0.0, -1.0]),
        "depth_m": path.depth_m,
        "camera_from_object": transform,
        "surface_rest_m": ladder.surface_rest_m,
        "surface_faces": ladder.surface_faces,
        "surface_m": surfaces.astype(np.float32),
        "mask": np.packbits(masks, axis=-1),
        "mask_shape": np.array(masks.shape),
    }


def write_object(object_file: Path, template_file: Path, spec: Mapping, *, name: str) -> None:
    """Write object.yaml and the template of an object of the lab."""
    template = spec["object"]["template"] | {"file": template_file.name, "unit": "m"}
    description = {"object": name, "provenance": "simulated"} | spec["object"]
    text = yaml.safe_dump(description | {"template": template}, sort_keys=False)
    object_file.write_text(text, encoding="utf-8")
    box_template(np.array(spec["size_m"]), spec["template_edge_m"]).export(template_file)


def box_template(size_m: NDArray, edge_m: float) -> trimesh.Trimesh:
    """Closed triangulated box on z = 0 with edges of about the given length."""
    low = np.array([-size_m[0] / 2, -size_m[1] / 2, 0.0])
    axes = [
        np.linspace(start, start + side, max(2, round(side / edge_m) + 1))
        for start, side in zip(low, size_m, strict=True)
    ]
    vertices, faces = box_surface(axes)
    return trimesh.Trimesh(vertices, faces, process=False)


def seed_of(common: Mapping, *names: str) -> list[int]:
    """Seed of a named thing of the lab, the same in whatever order things are made."""
    return [common["seed"], *(zlib.crc32(name.encode()) for name in names)]


def _views(sensor: Mapping, pose: NDArray) -> dict[str, View]:
    camera = camera_from_spec(sensor["color"])
    if sensor["kind"] != "stereo":
        return {"color": View(camera, pose)}
    shift = np.eye(4)
    shift[0, 3] = sensor["stereo"]["baseline_m"]
    return {"left": View(camera, pose), "right": View(camera, pose @ shift)}


def _depth_camera(common: Mapping, sensor: Mapping, pose: NDArray) -> KinectDepth:
    spec = sensor["depth"]
    view = View(camera_from_spec(spec), pose @ np.array(spec["color_from_depth"]))
    rng = np.random.default_rng(seed_of(common, sensor["sensor"], "device"))
    return KinectDepth(view, spec, sensor["range_m"], common["kinect"], rng)


def _still_layers(rig: Rig, scene: Scene) -> dict[str, Layer]:
    return {
        stream: render(view, scene, rig.bench, rig.light, samples=STILL_SAMPLES)
        for stream, view in rig.views.items()
    }


def _record_force(
    folder: Path,
    hand: Hand,
    ladder: ContactLadder,
    common: Mapping,
    spec: Mapping,
    probe_spec: Mapping,
    seed: list,
) -> tuple[NDArray, NDArray]:
    """Write force.csv; returns times [s] and true normal force [N] at the sensor's rate."""
    options, motion = common["force"], spec["motion"]
    lead = options["lead_s"]
    stop_s = motion["frames"] / motion["frame_rate_hz"] + lead
    time_s = np.arange(round((stop_s + lead) * options["rate_hz"])) / options["rate_hz"] - lead
    path = hand.at(time_s)
    force_n = relaxed_force(time_s, ladder.force_at(path.depth_m), **spec["material"]["relaxation"])
    rng = np.random.default_rng([*seed, 2])
    record = gauge_record(time_s, force_n, path.object_from_force, probe_spec, options, rng)
    write_force(folder, record)
    return time_s, force_n


def _film(
    folder: Path,
    rig: Rig,
    ladder: ContactLadder,
    surfaces: NDArray,
    path: ProbeMotion,
    probe: Probe,
    seed: list,
) -> NDArray:
    """Write the images and frames.csv; returns the true foreground of the reference camera."""
    body = {"rest_m": ladder.surface_rest_m, "faces": ladder.surface_faces}
    still = _still_layers(rig, Scene(surface_m=ladder.surface_rest_m, **body))
    rows, masks = [], []
    for k, surface in enumerate(surfaces):
        turn, tip = path.object_from_force[k], path.tip_m[k]
        scene = Scene(surface_m=surface, probe=probe, tip_m=tip, object_from_force=turn, **body)
        boxes = _touched(rig.light, probe, tip, turn, ladder)
        layers = {
            stream: render_change(
                view,
                scene,
                rig.bench,
                rig.light,
                still[stream],
                [projected_box(view, points, BOX_MARGIN_PX) for points in boxes],
                moved_m=(ladder.point_m, MOVED_RADIUS_M),
                samples=MOVING_SAMPLES,
            )
            for stream, view in rig.views.items()
        }
        files = rig.capture(folder, layers, scene, k, [*seed, 3])
        rows.append({"frame": k, "time_s": path.time_s[k]} | files)
        masks.append(np.isin(next(iter(layers.values())).kind, [OBJECT, *PROBE_PARTS]))
    write_frames(folder, pd.DataFrame(rows))
    return np.stack(masks)


def _touched(
    light: Light, probe: Probe, tip: NDArray, turn: NDArray, ladder: ContactLadder
) -> list[NDArray]:
    """Points around what a frame can change: probe, its shadows on table and object, dent."""
    outline = np.concatenate([vertices for vertices, _ in probe.parts.values()]) @ turn.T + tip
    heights = (0.0, ladder.point_m[2])
    shadows = [
        outline - light.towards * ((outline[:, 2:] - height) / light.towards[2])
        for height in heights
    ]
    corners = np.array([[i, j, 0] for i in (-1, 1) for j in (-1, 1)]) * MOVED_RADIUS_M
    return [outline, *shadows, ladder.point_m + corners]
