"""What a recording of the probe by itself shows: its tip, its payload or its compliance."""

from palpate.capture.files import write_json
from palpate.capture.tables import read_force
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import table_of
from palpate.vision.compliance import find_compliance, recorded_press
from palpate.vision.follow import board_followed
from palpate.vision.marker import board_of
from palpate.vision.options import Force, ProbePose, SupportPlane
from palpate.vision.payload import find_payload
from palpate.vision.pivot import find_pivot
from palpate.vision.probe import marker_transforms
from palpate.vision.probe_recordings import BASE_UP, static_poses, tracked_table
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write tip.json, load.json or stiffness.json; by tracked poses no sensor counts."""
    params, film = snakemake.params, snakemake.input.film
    probe = params.probe
    if probe is None:
        raise ValueError("experiments.probe: expected the recorded probe, found none")
    sensor = sensor_with_optics(params.sensor, snakemake.input.get("optics"))
    with naming(film):
        poses = tracked_table(film, probe)
        if poses is not None:
            sensor = None
        else:
            poses = board_followed(film, sensor, probe["marker"], ProbePose.read(params.options))
        fields = FOUND[params.part](film, sensor, probe, poses, params)
    write_json(snakemake.output.fields, fields)


def tip(film, sensor, probe, poses, params):
    """Where the ball is in the target's frame, from a handle that turned about its tip."""
    names = [f"frame {k}" for k in poses["frame"]]
    if sensor is None:
        found = find_pivot(marker_transforms(poses), names, by_camera=False)
    else:
        board = board_of(probe["marker"])
        found = find_pivot(marker_transforms(poses), names, board, sensor["color"])
    return found.fields(names, probe["probe"])


def load(film, sensor, probe, poses, params):
    """Payload of the force sensor and its axes, from a probe held still in the air."""
    plane, up = SupportPlane.read(params.more["support_plane"]), BASE_UP
    if sensor is not None:
        up = table_of(f"{film}/background", sensor, plane, seed=params.more["seed"])[:3]
    held = static_poses(poses, read_force(film), probe)
    return find_payload(held, up).fields(held.names, probe["probe"])


def stiffness(film, sensor, probe, poses, params):
    """Compliance between target and ball, from an indentation of something rigid."""
    options = Force.read(params.more["force"])
    found = find_compliance(*recorded_press(poses, read_force(film), probe, options))
    return found.fields(probe["probe"])


FOUND = {"tip": tip, "load": load, "stiffness": stiffness}
run(main, snakemake)
