"""What the scripts of the error minimisation share: the inverse problem of one capture."""

from declared import read_declared
from job import naming
from palpate.capture.tables import read_table
from palpate.estimate.problem import pose_problem
from palpate.solid.mesh import read_solid
from palpate.surface.checks import columns_of
from palpate.vision.force import FORCE

LOAD = ("force_rule", "turn_force", "leave_out_radii", "strain")


def read_problem(snakemake, fit, *, tracked, options, solid):
    """Read the inverse problem of the deepest frame of the Hertz fit, for a tracked surface."""
    inputs, frame = snakemake.input, fit["range"]["last_frame"]
    mesh = read_solid(inputs.solid)
    with naming(inputs.force):
        force = columns_of(read_table(inputs.force), FORCE)[frame]
    with naming(inputs.object, "support", "contact"):
        return pose_problem(
            mesh,
            tracked,
            force,
            frame,
            fit["samples"]["depth_m"][frame],
            read_declared(inputs.object)[1],
            indenter_radius_m=snakemake.params.probe["indenter"]["radius_m"],
            **{name: options[name] for name in LOAD},
            **solid,
        )
