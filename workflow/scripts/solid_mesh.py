"""Take an object's kept solid mesh, or make one from its template."""

import json
import logging
from dataclasses import asdict

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.capture.schema import load_yaml
from palpate.solid.fill import tetrahedralise
from palpate.solid.mesh import read_solid, write_solid
from palpate.solid.quality import mesh_quality
from palpate.solid.sizing import Support
from palpate.surface.template import read_template

# A kept mesh of another object is farther from the template than its own ever is.
LARGEST_GAP = 0.02


def main(snakemake):
    """Write the solid mesh, object frame, and its quality."""
    found = load_yaml(snakemake.input.object)
    spec, support = found["template"], found["support"]
    template = read_template(snakemake.input.template, unit=spec["unit"])
    allowed = LARGEST_GAP * float(np.ptp(template.vertices_m, axis=0).max())
    solid = kept_or_made(snakemake.input.kept, template, spec, support, allowed)
    quality = mesh_quality(solid, template.vertices_m, template.faces)
    if quality.largest_gap_m > allowed:
        raise ValueError(
            f"{snakemake.input.kept}: nodes: expected within {allowed:.2g} m of the template,"
            f" found {quality.largest_gap_m:.2g} m"
        )
    report(quality)
    with whole_file(snakemake.output.solid) as part:
        write_solid(part, solid)
    with whole_file(snakemake.output.quality) as part:
        part.write_text(json.dumps(asdict(quality), indent=2) + "\n", encoding="utf-8")


def kept_or_made(kept, template, spec, support, largest_gap_m):
    """Read the kept mesh, or fill the template."""
    if kept:
        return read_solid(kept)
    logging.info("made anew; keep it to make results repeatable")
    return tetrahedralise(
        template.vertices_m,
        template.faces,
        vertices=spec.get("solid_vertices", spec["vertices"]),
        largest_gap_m=largest_gap_m,
        support=Support(
            np.array(support["plane_point_m"], dtype=float),
            np.array(support["plane_normal"], dtype=float),
            support["tolerance_m"],
        ),
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
