"""Figure 3.3: contact triangle and contact area on the meshes of the study's block."""

import json
from pathlib import Path

import numpy as np
from job import run
from palpate.capture.files import whole_file
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import read_solid
from palpate.solid.refine import refine_near
from palpate.study import contact_figure, style
from palpate.surface.distance import ClosestPoints
from palpate.surface.tracked import load_tracked


def main(snakemake):
    """Draw the template that is tracked and the solid that is loaded, at the contact."""
    inputs, params = snakemake.input, snakemake.params
    fit = json.loads(Path(inputs.fit).read_text(encoding="utf-8"))
    tracked = load_tracked(inputs.tracked)
    point, radius = tracked.contact_point_m, fit["radius_m"]
    _, nearest, _ = ClosestPoints(tracked.template_m, tracked.faces)(point[None])
    solid = refine_near(
        read_solid(inputs.solid),
        point,
        radius_m=params.solid["refine_radius_m"],
        edge_m=params.solid["refine_edge_m"],
    )
    loaded = contact_triangle(solid, point, largest_distance_m=radius)
    depth = fit["samples"]["depth_m"][fit["range"]["last_frame"]]
    views = [
        contact_figure.ContactView(
            "Template (tracking)", tracked.template_m, tracked.faces, tracked.faces[nearest[0]]
        ),
        contact_figure.ContactView(
            "Solid (estimate)", solid.nodes_m, solid.surface_triangles(), np.asarray(loaded)
        ),
    ]
    with style.journal():
        figure = contact_figure.figure_3_3(
            views,
            point,
            radius_m=radius,
            depth_m=depth,
            provenance=params.capture["provenance"],
        )
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


run(main, snakemake)
