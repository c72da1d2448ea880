"""What a recording of the probe by itself shows: its tip, its payload or its compliance."""

from palpate.capture.files import write_json
from palpate.capture.tables import read_force
from palpate.vision.bending import find_bending
from palpate.vision.bending_json import bending_fields
from palpate.vision.camera import sensor_with_optics
from palpate.vision.clouds import table_of
from palpate.vision.filmed_pivot import filmed_pivot
from palpate.vision.follow import board_followed
from palpate.vision.load import find_load
from palpate.vision.load_json import load_fields
from palpate.vision.marker import board_of
from palpate.vision.options import Force, ProbePose, SupportPlane
from palpate.vision.pivot_json import pivot_fields
from palpate.vision.probe import marker_transforms
from palpate.vision.rests import film_rests
from palpate.vision.rigid_press import way_and_force
from palpate.workflow.job import naming, run


def main(snakemake):
    """Write tip.json, load.json or stiffness.json."""
    params, film = snakemake.params, snakemake.input.film
    probe = params.probe
    if probe is None:
        raise ValueError("experiments.probe: expected the recorded probe, found none")
    sensor = sensor_with_optics(params.sensor, snakemake.input.get("optics"))
    with naming(film):
        poses = board_followed(film, sensor, probe["marker"], ProbePose.read(params.options))
        fields = FOUND[params.part](film, sensor, probe, poses, params)
    write_json(snakemake.output.fields, fields)


def tip(film, sensor, probe, poses, params):
    """Where the ball is in the target's frame, from a handle that turned about its tip."""
    names = [f"frame {k}" for k in poses["frame"]]
    board = board_of(probe["marker"])
    found = filmed_pivot(marker_transforms(poses), names, board, sensor["color"])
    return pivot_fields(found, names, probe["probe"])


def load(film, sensor, probe, poses, params):
    """Payload of the force sensor and its axes, from a probe held still in the air."""
    plane = SupportPlane.read(params.more["support_plane"])
    up = table_of(f"{film}/background", sensor, plane, seed=params.more["seed"])[:3]
    rests = film_rests(poses, read_force(film), probe)
    found = find_load(rests.turns, rests.wrench, up, rests.noise, rests.names)
    return load_fields(found, rests.names, probe["probe"])


def stiffness(film, sensor, probe, poses, params):
    """Compliance between target and ball, from an indentation of something rigid."""
    found = find_bending(
        *way_and_force(poses, read_force(film), probe, Force.read(params.more["force"]))
    )
    return bending_fields(found, probe["probe"])


FOUND = {"tip": tip, "load": load, "stiffness": stiffness}
run(main, snakemake)
