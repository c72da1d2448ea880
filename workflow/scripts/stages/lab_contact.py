"""Indent an object of the lab with the rigid sphere, over load steps."""

from palpate.workflow.job import run
from virtual_lab.indentation import indent_object
from virtual_lab.load_steps import write_load_steps
from virtual_lab.obstacle import DOWN
from virtual_lab.rig_errors import sphere_radius_m


def main(snakemake):
    """Solve the contact problem of one point."""
    spec = snakemake.params.spec
    place = spec["points"][snakemake.wildcards.point]
    radius_m = sphere_radius_m(spec, spec, snakemake.params.probe)
    direction = place.get("direction", DOWN)
    steps = indent_object(spec, place["position_m"], radius_m, direction=direction)
    write_load_steps(snakemake.output.load_steps, steps)


run(main, snakemake)
