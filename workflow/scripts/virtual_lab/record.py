"""One recording of the virtual lab: a capture in the users' format, and its truth apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.tables import write_force, write_frames

from virtual_lab.load_steps import LoadSteps
from virtual_lab.material import relaxed_force
from virtual_lab.motion import Operator, ProbeMotion
from virtual_lab.poses import record_poses
from virtual_lab.probe import OBJECT, PROBE_PARTS, Probe, make_probe
from virtual_lab.render import MOVING_SAMPLES, Layer, render_change
from virtual_lab.rig import Rig
from virtual_lab.scene import Scene
from virtual_lab.wrench import gauge_record, inertial_wrench

FACING = np.array([0.0, -1.0, 0.0])
# Rays a pixel of what moves, along each side, in each moment of an exposure.
EXPOSED_SAMPLES = 2


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
    steps: LoadSteps,
    spec: Mapping,
    probe_spec: Mapping,
    *,
    seed: list,
    jolted: Rig | None = None,
) -> dict[str, NDArray]:
    """Record an indentation: write a capture's folder and return its truth.

    Parameters
    ----------
    folder : Path
        Empty folder to fill.
    rig : Rig
    steps : LoadSteps
        Mechanics of the point.
    spec, probe_spec : mapping
        The object's block of lab.yaml, the probe's file.
    seed : list of int
        Seed of this recording.
    jolted : Rig, optional
        The rig as it stands after the first third of the recording.

    Returns
    -------
    dict
        Arrays of truth.npz; see docs/architecture.md.
    """
    errors, motion, probe_spec = rig.errors, spec["motion"], rig.errors.probe(probe_spec)
    operator = Operator(
        motion,
        point_m=steps.point_m,
        radius_m=probe_spec["indenter"]["radius_m"],
        direction=steps.direction,
        facing=FACING,
        rng=np.random.default_rng([*seed, 1]),
    )
    time_s, offset_s, clock = clocks(rig, operator.frames, motion["frame_rate_hz"], seed)
    kept = errors.kept(operator.frames, np.random.default_rng([*seed, 6]))
    time_s, moments_s = time_s[kept], errors.moments_s
    offset_s += errors.drawn("clock_offset_s", clock)

    stop_s = operator.frames / motion["frame_rate_hz"]
    lead_s, rate_hz = rig.common["force"]["lead_s"], rig.common["force"]["rate_hz"]
    rate_hz = rig.sensor.get("base", {}).get("force_rate_hz", rate_hz)
    samples_s = np.arange(round((stop_s + lead_s + lead_s) * rate_hz)) / rate_hz - lead_s
    sampled = operator.at(samples_s)
    force_n = _force(steps, spec["material"], sampled)
    write_record(folder, rig, sampled, force_n, probe_spec, seed, offset_s=offset_s)
    path = operator.at((time_s[:, None] + moments_s).ravel())
    surfaces = steps.surface_at(path.depth_m)
    probe = make_probe(probe_spec, motion.get("elbow_m"))
    body = Body(steps.surface_rest_m, steps.surface_faces, surfaces)
    how = {"seed": [*seed, 3], "numbers": kept, "jolted": jolted}
    masks = write_images(folder, rig, body, path, probe, **how)
    tracked = probe_spec.get("tracked", "")
    followed = record_poses(folder, rig, operator, probe, tracked=tracked, seed=seed)
    path, surfaces = operator.at(time_s), surfaces[:: len(moments_s)]
    to_camera = rig.reference.camera_from_object
    turn = to_camera[:3, :3]
    force = np.column_stack([np.interp(time_s, samples_s, part) for part in force_n.T])
    return followed | {
        "time_s": time_s,
        "tip_m": rig.reference.local(path.tip_m),
        "axis": path.object_from_force[:, :, 2] @ turn.T,
        "force_n": -force @ turn.T,
        "depth_m": path.depth_m,
        "clock_offset_s": np.array(offset_s),
        "camera_from_object": to_camera,
        "surface_rest_m": steps.surface_rest_m,
        "surface_faces": steps.surface_faces,
        "surface_m": surfaces.astype(np.float32),
        "mask": np.packbits(masks, axis=-1),
        "mask_shape": np.array(masks.shape),
    }


def _force(steps: LoadSteps, material: Mapping, path: ProbeMotion) -> NDArray:
    """Force of the object on the tip along a path (n, 3) [N], relaxed."""
    force = steps.force_vector_at(path.depth_m)
    series = material["relaxation"]
    return np.column_stack([relaxed_force(path.time_s, part, **series) for part in force.T])


def clocks(
    rig: Rig, count: int, rate_hz: float, seed: list
) -> tuple[NDArray, float, np.random.Generator]:
    """Times of a recording's frames with jitter (count,) [s], offset of its force's clock [s].

    Also what drew them, for further errors.
    """
    options, rng = rig.common["timing"], np.random.default_rng([*seed, 4])
    jitter = options["frame_jitter_s"] * rng.standard_normal(count)
    time_s = np.arange(count) / rate_hz + np.clip(jitter, -0.25 / rate_hz, 0.25 / rate_hz)
    return time_s, options["clock_offset_s"] * rng.uniform(-1, 1), rng


def write_images(
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

    Path and body are those of each frame's moments in turn (`RigErrors.moments_s`), one if no
    numbers of the frames are given.
    """
    numbers = np.arange(len(path.tip_m)) if numbers is None else numbers
    each, light = len(path.tip_m) // len(numbers), np.random.default_rng([*seed, 0, 2])
    brighter = rig.errors.drawn("light_change", light)
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
            _layers(rig, still, scene, body, moment)
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
    rig: Rig, still: Mapping, scene: Scene, body: Body | None, moment: int
) -> dict[str, Layer]:
    """Pictures of a moment by all colour streams."""
    moved = None
    if body is not None:
        moved = np.linalg.norm(body.surfaces_m[moment] - body.rest_m, axis=1)
    samples = EXPOSED_SAMPLES if rig.errors.size("exposure_s") else MOVING_SAMPLES
    how = {"moved_m": moved, "samples": samples}
    return {
        stream: render_change(view, scene, rig.light, still[stream], **how)
        for stream, view in rig.views.items()
    }


def _exposed(moments: Sequence[Layer], brightness: float) -> Layer:
    """Mean of a picture's moments; what is where is the first's."""
    colour = np.mean([layer.colour for layer in moments], axis=0) * np.float32(brightness)
    return replace(moments[0], colour=colour)


def write_record(
    folder: Path,
    rig: Rig,
    path: ProbeMotion,
    force_n: NDArray,
    probe_spec: Mapping,
    seed: list,
    *,
    offset_s: float,
) -> None:
    """Write force.csv of a path and the forces (n, 3) on its tip, object frame [N]."""
    errors, options = rig.errors, rig.errors.force(rig.common["force"])
    drift, time_s = np.random.default_rng([*seed, 5]), path.time_s

    def measured(wrench: NDArray) -> NDArray:
        swung = errors.size("inertia") * inertial_wrench(path, probe_spec, options)
        return errors.measured(time_s, wrench + swung, drift)

    rng, turns = np.random.default_rng([*seed, 2]), path.object_from_force
    record = gauge_record(time_s, force_n, turns, probe_spec, options, rng, measured=measured)
    record["time_s"] += offset_s + errors.clock_rate * time_s
    record["time_s"] = errors.stamped(record["time_s"].to_numpy())
    write_force(folder, record)


def with_motion(spec: Mapping, motion: Mapping) -> dict:
    """An object's block of lab.yaml with parts of its motion replaced."""
    return dict(spec) | {"motion": dict(spec["motion"]) | dict(motion)}
