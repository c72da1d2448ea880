"""Table 3.1: the sets of nodes, and how many the block's solid has of each at one point."""

import numpy as np
from declared import read_declared
from job import run
from palpate.capture.files import whole_file
from palpate.solid.boundary import node_sets
from palpate.solid.load import contact_triangle
from palpate.solid.mesh import read_solid
from palpate.solid.refine import refine_near
from palpate.study import simulation_tables, tables


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params = snakemake.params
    (spec, support), capture = read_declared(snakemake.input.object), params.capture
    point = np.array(spec["points"][capture["point"]]["position_m"], dtype=float)
    mesh = refine_near(
        read_solid(snakemake.input.solid),
        point,
        radius_m=params.solid["refine_radius_m"],
        edge_m=params.solid["refine_edge_m"],
    )
    radius = params.probe["indenter"]["radius_m"]
    triangle = contact_triangle(mesh, point, largest_distance_m=radius)
    sets = node_sets(mesh, support, contact_nodes=triangle)
    table = simulation_tables.table_3_1(sets, provenance=capture["provenance"])
    title = f"Table 3.1: sets of nodes; counts of {capture['object']} at point {capture['point']}"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        tables.write(table, csv, md, title=title)


run(main, snakemake)
