"""What the scripts of the mismatch figures read."""

import meshio
from palpate.solid.mesh import read_solid
from palpate.study.surface_figures import Mismatch
from palpate.surface.tracked import load_tracked


def mismatch_of(mismatch: str, tracked: str) -> Mismatch:
    """Read the mismatch of one capture."""
    solid = read_solid(mismatch)
    values = meshio.read(mismatch).point_data["mismatch_m"]
    contact = load_tracked(tracked).contact_point_m
    return Mismatch(solid.nodes_m, solid.surface_triangles(), values, contact)
