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
    report(quality)
    with whole_file(snakemake.output.solid) as part:
        write_solid(part, solid)
    write_json(snakemake.output.quality, asdict(quality))


def report(quality):
    """Say what the mesh is like in the log."""
    values = asdict(quality) | {"gap_mm": 1000 * quality.largest_gap_m}
    logging.info("%(nodes)d nodes, %(elements)d tetrahedra, %(volume_m3).4g m3", values)
    least = "radius ratio %(least_radius_ratio).3f at least, %(mean_radius_ratio).3f on average"
    logging.info(least, values)
    logging.info(
        "dihedral angles %(least_dihedral_deg).1f to %(greatest_dihedral_deg).1f deg", values
    )
    logging.info("surface within %(gap_mm).2g mm of the template's", values)


run(main, snakemake)
