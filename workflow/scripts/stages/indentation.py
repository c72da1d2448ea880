"""Indentation table of one point of an object."""

from palpate.capture.discover import declared_point
from palpate.solid.indentation_table import image_table, load_indentation, save_indentation
from palpate.solid.load_steps import point_table
from palpate.solid.mesh import read_solid
from palpate.solid.options import IndentationTable
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_object


def main(snakemake):
    """Write the table."""
    inputs, params = snakemake.input, snakemake.params
    spec, support, template = read_object(inputs)
    surface = template.vertices_m, template.faces
    if inputs.image:
        other = load_indentation(inputs.image)
        with naming(inputs.object, "mirrors"):
            model = image_table(other, support, surface, params.mirrors)
    else:
        mesh = read_solid(inputs.solid)
        with naming(inputs.object):
            model = point_table(
                mesh,
                support,
                surface,
                declared_point(spec, snakemake.wildcards.point),
                IndentationTable.read(params.options),
                radius_m=params.probe["indenter"]["radius_m"],
                deepest_m=spec.get("deepest_m"),
            )
    save_indentation(snakemake.output.model, model)


run(main, snakemake)
