"""Clouds of the object at the chosen frames of a capture, or at all."""

import numpy as np
from palpate.capture.tables import read_frames, read_table
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import Reach, clouds_of, save_clouds
from palpate.vision.foreground import load_masks
from palpate.vision.options import Clouds
from palpate.vision.support_plane import read_plane
from palpate.workflow.capture_inputs import read_probe
from palpate.workflow.job import run
from palpate.workflow.object_inputs import read_object


def main(snakemake):
    """Write the clouds with normals, camera frame."""
    inputs, params = snakemake.input, snakemake.params
    sensor = sensor_with_optics(params.sensor, inputs.get("optics"))
    masks, poses = load_masks(inputs.mask) if inputs.mask else None, read_table(inputs.pose)
    require_frames(inputs, masks, poses, params.frames)
    clouds = clouds_of(
        inputs.capture,
        sensor,
        params.probe,
        masks,
        poses,
        reach_of(inputs, poses, snakemake.wildcards.capture),
        Clouds.read(params.options),
        params.frames,
    )
    save_clouds(snakemake.output.clouds, clouds)


def reach_of(inputs, poses, capture):
    """How far the object reaches from where the tip presses most."""
    spec, support, template = read_object(inputs)
    point = spec["points"][capture.partition("-")[0]]["position_m"]
    _, tips, forces = read_probe(inputs.pose, inputs.force, frames=len(poses))
    peak = np.argmax(np.linalg.norm(forces, axis=1))
    return Reach(
        tips[peak], *support.extent_m(template.vertices_m, point), read_plane(inputs.plane)
    )


def require_frames(inputs, masks, poses, chosen):
    """Refuse masks and poses of other frames, and chosen frames without foreground."""
    count = len(read_frames(inputs.capture))
    for path, field, found in ((inputs.mask, "mask", masks), (inputs.pose, "tip_x_m", poses)):
        if found is not None and len(found) != count:
            raise ValueError(f"{path}: {field}: expected {count} frames, found {len(found)}")
    if masks is None:
        return
    empty = [k for k in (range(count) if chosen is None else chosen) if not masks[k].any()]
    if empty:
        expected = f"frame {empty[0]}: mask: expected foreground"
        raise ValueError(f"{inputs.mask}: {expected}, found none ({len(empty)} such frames)")


run(main, snakemake)
