"""Take an object's kept solid mesh, or make one from its template."""

import json
import logging
from dataclasses import asdict

import numpy as np
from palpate.capture.files import whole_file
from palpate.run.declared import read_declared
from palpate.run.job import naming, run
from palpate.solid.boundary import support_nodes
from palpate.solid.fill import tetrahedralise
from palpate.solid.mesh import read_solid, write_solid
from palpate.solid.quality import mesh_quality
from palpate.solid.surface_check import check_surface
from palpate.surface.template import read_template

# A kept mesh of another object is farther from the template than its own ever is.
LARGEST_GAP = 0.02


def main(snakemake):
    """Write the solid mesh, object frame, and its quality."""
    inputs, (spec, support) = snakemake.input, read_declared(snakemake.input.object)
    template = read_template(inputs.template, unit=spec["template"]["unit"])
    with naming(inputs.template):
        check_surface(template.vertices_m, template.faces)
    allowed = LARGEST_GAP * float(np.ptp(template.vertices_m, axis=0).max())
    solid = kept_or_made(inputs, template, spec["template"], support, allowed)
    quality = mesh_quality(solid, template.vertices_m, template.faces)
    if quality.largest_gap_m > allowed:
        raise ValueError(
            f"{inputs.kept or inputs.template}: nodes: expected within {allowed:.2g} m of the"
            f" template, found {quality.largest_gap_m:.2g} m"
        )
    with naming(inputs.object):
        support_nodes(solid, support)
    report(quality)
    with whole_file(snakemake.output.solid) as part:
        write_solid(part, solid)
    with whole_file(snakemake.output.quality) as part:
        part.write_text(json.dumps(asdict(quality), indent=2) + "\n", encoding="utf-8")


def kept_or_made(inputs, template, counts, support, largest_gap_m):
    """Read the kept mesh, or fill the template."""
    if inputs.kept:
        return read_solid(inputs.kept)
    logging.info("made anew; keep it to make results repeatable")
    with naming(inputs.template):
        return tetrahedralise(
            template.vertices_m,
            template.faces,
            vertices=counts.get("solid_vertices", counts["vertices"]),
            largest_gap_m=largest_gap_m,
            support=support,
        )


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
