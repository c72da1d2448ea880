"""The solid of an object: a kept mesh that is its template's, or one made of the template."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palpate.solid.fill import tetrahedralise
from palpate.solid.mesh import SolidMesh, read_solid
from palpate.solid.quality import MeshQuality, mesh_quality
from palpate.solid.support import Support

# A kept mesh of another object is farther from the template than its own ever is, over its size.
LARGEST_GAP = 0.02


def object_solid(
    vertices_m: NDArray,
    faces: NDArray,
    declared: Mapping,
    support: Support,
    *,
    kept: str | Path | None = None,
) -> tuple[SolidMesh, MeshQuality]:
    """Read the kept mesh, or fill the template, and hold it to the template.

    Parameters
    ----------
    vertices_m, faces : (n, 3), (m, 3) arrays
        Template [m].
    declared : mapping
        The ``template`` block of object.yaml: ``vertices``, and ``solid_vertices`` of the solid.
    support : Support
    kept : path, optional
        VTU file; made anew without.

    Raises
    ------
    ValueError
        If the kept mesh, or what was made, lies farther from the template than its own ever does.
    """
    allowed = LARGEST_GAP * float(np.ptp(vertices_m, axis=0).max())
    if kept:
        solid = read_solid(kept)
    else:
        solid = tetrahedralise(
            vertices_m,
            faces,
            vertices=declared.get("solid_vertices", declared["vertices"]),
            largest_gap_m=allowed,
            support=support,
        )
    quality = mesh_quality(solid, vertices_m, faces)
    if quality.largest_gap_m > allowed:
        raise ValueError(
            f"{f'{kept}: ' if kept else ''}nodes: expected within {allowed:.2g} m of the template,"
            f" found {quality.largest_gap_m:.2g} m"
        )
    return solid, quality
