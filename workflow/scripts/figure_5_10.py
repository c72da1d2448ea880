"""Figure 5.10: mismatch of tracked and computed deformation."""

import meshio
from job import run
from palpate.capture.files import whole_file
from palpate.solid.mesh import read_solid
from palpate.study import style, surface_figures
from palpate.surface.tracked import load_tracked


def main(snakemake):
    """Draw the figure."""
    paths = zip(snakemake.input.mismatches, snakemake.input.tracked, strict=True)
    views = [view_of(*pair) for pair in paths]
    with style.journal():
        figure = surface_figures.figure_5_10(snakemake.params.captures, views)
        with whole_file(snakemake.output.png) as png, whole_file(snakemake.output.svg) as svg:
            style.save(figure, png, svg)


def view_of(mismatch, tracked):
    """Read the mismatch of one capture."""
    solid = read_solid(mismatch)
    values = meshio.read(mismatch).point_data["mismatch_m"]
    contact = load_tracked(tracked).contact_point_m
    return surface_figures.Mismatch(solid.nodes_m, solid.surface_triangles(), values, contact)


run(main, snakemake)
