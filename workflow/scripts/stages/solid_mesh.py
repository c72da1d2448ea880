"""Take an object's kept solid mesh, or make one from its template."""

import logging
from dataclasses import asdict

from palpate.capture.files import whole_file, write_json
from palpate.solid.fill import object_solid
from palpate.solid.mesh import write_solid
from palpate.solid.quality import check_surface
from palpate.solid.support import support_nodes
from palpate.workflow.job import naming, run
from palpate.workflow.object_inputs import read_object


def main(snakemake):
    """Write the solid mesh, object frame, and its quality."""
    inputs, (spec, support, template) = snakemake.input, read_object(snakemake.input)
    surface = (template.vertices_m, template.faces)
    with naming(inputs.template):
        check_surface(*surface)
    if not inputs.kept:
        logging.info("made anew; keep it to make results repeatable")
    with naming(inputs.kept or inputs.template):
        solid, quality = object_solid(*surface, spec["template"], support, kept=inputs.kept)
    with naming(inputs.object):
        support_nodes(solid, support)
    values = asdict(quality)
    logging.info("; ".join(f"{name}: {value:.6g}" for name, value in values.items()))
    with whole_file(snakemake.output.solid) as part:
        write_solid(part, solid)
    write_json(snakemake.output.quality, values)


run(main, snakemake)
