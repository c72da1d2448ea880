"""One recording of the virtual lab: a capture in the users' format, and its truth apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.tables import write_force, write_frames

from virtual_lab.device import Device
from virtual_lab.ladder import ContactLadder
from virtual_lab.motion import Hand, ProbeMotion
from virtual_lab.part import OBJECT, PROBE_PARTS
from virtual_lab.probe import Probe, make_probe
from virtual_lab.relaxation import relaxed_force, softening
from virtual_lab.render import BOX_MARGIN_PX, Layer, Light, projected_box, render_change
from virtual_lab.rig import Rig, frame_times
from virtual_lab.scene import Scene
from virtual_lab.wrench import gauge_record, inertial_load

FACING = np.array([0.0, -1.0, 0.0])
# Rays a pixel of what moves, along each side: at once, or in each moment of an exposure.
MOVING_SAMPLES, EXPOSED_SAMPLES = 3, 2
# A frame is rendered again where the surface moved by more than this.
STILL_M = 2e-6


@dataclass(frozen=True)
class Body:
    """The object through a recording.

    Attributes
    ----------
    rest_m, faces : arrays
        Undeformed vertices (n, 3) [m] and triangles.
    surfaces_m : (k, n, 3) array
        The surface in each frame, or at each of its moments [m].
    """

    rest_m: NDArray
    faces: NDArray
    surfaces_m: NDArray


def record_capture(
    folder: Path,
    rig: Rig,
    ladder: ContactLadder,
    common: Mapping,
    spec: Mapping,
    probe_spec: Mapping,
    *,
    seed: list,
    jolted: Rig | None = None,
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
    jolted : Rig, optional
        The rig as it stands after the first third of the film.

    Returns
    -------
    dict
        Arrays of truth.npz; see docs/architecture.md.
    """
    motion, probe_spec = spec["motion"], rig.device.probe(probe_spec)
    hand = Hand(
        motion,
        point_m=ladder.point_m,
        radius_m=probe_spec["indenter"]["radius_m"],
        direction=ladder.direction,
        facing=FACING,
        rng=np.random.default_rng([*seed, 1]),
    )
    clock = np.random.default_rng([*seed, 4])
    time_s = frame_times(common, hand.frames, motion["frame_rate_hz"], clock)
    kept = rig.device.kept(hand.frames, np.random.default_rng([*seed, 6]))
    time_s, moments_s = time_s[kept], rig.device.moments_s
    offset_s = common["timing"]["clock_offset_s"] * clock.uniform(-1, 1)
    offset_s += rig.device.drawn("clock_offset_s", clock)
    force_time_s, force_n = _record_force(
        folder, rig.device, hand, ladder, common, spec, probe_spec, seed, offset_s=offset_s
    )
    path = hand.at((time_s[:, None] + moments_s).ravel())
    surfaces = ladder.surface_at(path.depth_m)
    probe = make_probe(probe_spec, motion.get("elbow_m"))
    body = Body(ladder.surface_rest_m, ladder.surface_faces, surfaces)
    masks = film(folder, rig, body, path, probe, seed=[*seed, 3], numbers=kept, jolted=jolted)
    path, surfaces = hand.at(time_s), surfaces[:: len(moments_s)]
    transform = rig.reference.camera_from_object
    turn = transform[:3, :3]
    force = np.column_stack([np.interp(time_s, force_time_s, part) for part in force_n.T])
    return {
        "time_s": time_s,
        "tip_m": path.tip_m @ turn.T + transform[:3, 3],
        "axis": path.object_from_force[:, :, 2] @ turn.T,
        "force_n": -force @ turn.T,
        "depth_m": path.depth_m,
        "clock_offset_s": np.array(offset_s),
        "camera_from_object": transform,
        "surface_rest_m": ladder.surface_rest_m,
        "surface_faces": ladder.surface_faces,
        "surface_m": surfaces.astype(np.float32),
        "mask": np.packbits(masks, axis=-1),
        "mask_shape": np.array(masks.shape),
    }


def film(
    folder: Path,
    rig: Rig,
    body: Body | None,
    path: ProbeMotion,
    probe: Probe,
    *,
    seed: list,
    numbers: NDArray | None = None,
    jolted: Rig | None = None,
) -> NDArray:
    """Write the images and frames.csv; returns the true foreground of the reference camera.

    Path and body are those of each frame's moments in turn (`Device.moments_s`), one if no
    numbers of the frames are given.
    """
    numbers = np.arange(len(path.tip_m)) if numbers is None else numbers
    each, light = len(path.tip_m) // len(numbers), np.random.default_rng([*seed, 0, 2])
    brighter = rig.device.drawn("light_change", light)
    empty = _scene(rig, body)
    still = rig.still(empty)
    rows, masks = [], []
    for row, number in enumerate(numbers):
        if jolted is not None and 3 * number >= numbers[-1] + 1:
            rig, jolted = jolted, None
            still = rig.still(empty)
        moments = range(row * each, (row + 1) * each)
        scenes = [_scene(rig, body, probe, path, moment) for moment in moments]
        taken = [
            _layers(rig, still, scene, probe, body, moment)
            for scene, moment in zip(scenes, moments[: max(each - 1, 1)], strict=False)
        ]
        share = 1 + brighter * row / max(len(numbers) - 1, 1)
        layers = {stream: _exposed([one[stream] for one in taken], share) for stream in rig.views}
        files = rig.write(folder, layers, scenes[-1], number, seed)
        rows.append({"frame": number, "time_s": path.time_s[row * each]} | files)
        masks.append(np.isin(next(iter(layers.values())).kind, [OBJECT, *PROBE_PARTS]))
    write_frames(folder, pd.DataFrame(rows))
    return np.stack(masks)


def _scene(
    rig: Rig,
    body: Body | None,
    probe: Probe | None = None,
    path: ProbeMotion | None = None,
    moment: int = 0,
) -> Scene:
    """The bench at a moment of a recording; without a path at rest."""
    parts: dict[str, Any] = {}
    if body is not None:
        surface = body.rest_m if path is None else body.surfaces_m[moment]
        parts |= {"surface_m": surface, "rest_m": body.rest_m, "faces": body.faces}
    if path is not None:
        parts |= {"probe": probe, "tip_m": path.tip_m[moment]}
        parts |= {"object_from_force": path.object_from_force[moment]}
    return Scene(rig.bench, **parts)


def _layers(
    rig: Rig, still: Mapping, scene: Scene, probe: Probe, body: Body | None, moment: int
) -> dict[str, Layer]:
    """Pictures of a moment by all colour streams."""
    boxes, moved = reached(rig.light, probe, scene.tip_m, scene.object_from_force), None
    if body is not None:
        moved = np.linalg.norm(body.surfaces_m[moment] - body.rest_m, axis=1)
        boxes += _moved_points(body, moved)
    return {
        stream: render_change(
            view,
            scene,
            rig.light,
            still[stream],
            [projected_box(view, points, BOX_MARGIN_PX) for points in boxes],
            moved_m=moved,
            still_m=STILL_M,
            samples=EXPOSED_SAMPLES if rig.device.size("exposure_s") else MOVING_SAMPLES,
        )
        for stream, view in rig.views.items()
    }


def _exposed(moments: Sequence[Layer], brightness: float) -> Layer:
    """Mean of a picture's moments; what is where is the first's."""
    colour = np.mean([layer.colour for layer in moments], axis=0) * np.float32(brightness)
    return replace(moments[0], colour=colour)


def _record_force(
    folder: Path,
    device: Device,
    hand: Hand,
    ladder: ContactLadder,
    common: Mapping,
    spec: Mapping,
    probe_spec: Mapping,
    seed: list,
    *,
    offset_s: float,
) -> tuple[NDArray, NDArray]:
    """Write force.csv; returns times [s] and true forces (n, 3) on the tip [N] at its rate."""
    options, motion = device.weighed(common["force"]), spec["motion"]
    lead = options["lead_s"]
    stop_s = hand.frames / motion["frame_rate_hz"] + lead
    time_s = np.arange(round((stop_s + lead) * options["rate_hz"])) / options["rate_hz"] - lead
    path = hand.at(time_s)
    elastic_n = ladder.force_vector_at(path.depth_m)
    material = spec["material"]
    if "mullins" in material:
        virgin_n = ladder.force_at(path.depth_m)
        elastic_n *= softening(path.depth_m, virgin_n, material["mullins"])[:, None]
    relaxation = material["relaxation"]
    force_n = np.column_stack([relaxed_force(time_s, part, **relaxation) for part in elastic_n.T])
    write_record(folder, device, path, force_n, probe_spec, options, seed, offset_s=offset_s)
    return time_s, force_n


def write_record(
    folder: Path,
    device: Device,
    path: ProbeMotion,
    force_n: NDArray,
    probe_spec: Mapping,
    options: Mapping,
    seed: list,
    *,
    offset_s: float,
) -> None:
    """Write force.csv of a path and the forces (n, 3) on its tip, object frame [N].

    ``options`` is the ``force`` block of lab.yaml with what really hangs on the sensor.
    """
    drift, time_s = np.random.default_rng([*seed, 5]), path.time_s

    def felt(load: NDArray) -> NDArray:
        swung = device.size("inertia") * inertial_load(path, probe_spec, options)
        return device.felt(time_s, load + swung, drift)

    record = gauge_record(
        time_s,
        force_n,
        path.object_from_force,
        probe_spec,
        options,
        np.random.default_rng([*seed, 2]),
        felt=felt,
    )
    record["time_s"] += offset_s + device.clock_rate * time_s
    record["time_s"] = device.stamped(record["time_s"].to_numpy())
    write_force(folder, record)


def reached(light: Light, probe: Probe, tip: NDArray, turn: NDArray) -> list[NDArray]:
    """Points around the probe and its shadows on table and object."""
    outline = probe.outline() @ turn.T + tip
    towards = light.towards
    # The shadow lies between the table and the height of the tip.
    heights = (0.0, max(tip[2], 0.0))
    return [outline] + [
        outline - towards * ((outline[:, 2:] - height) / towards[2]) for height in heights
    ]


def _moved_points(body: Body, moved: NDArray) -> list[NDArray]:
    chosen = moved > STILL_M
    return [body.rest_m[chosen]] if chosen.any() else []


def with_motion(spec: Mapping, motion: Mapping) -> dict:
    """An object's block of lab.yaml with parts of its motion replaced."""
    return dict(spec) | {"motion": dict(spec["motion"]) | dict(motion)}
