"""Surfaces that thinning folded over, smoothed until they don't cut themselves."""

import numpy as np
import trimesh

from palpate.solid.quality import cutting_triangles

UNFOLDING_ROUNDS = 20


def unfolded(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Smooth a closed surface where its triangles cut each other, and nowhere else.

    Parameters
    ----------
    mesh : trimesh.Trimesh

    Returns
    -------
    trimesh.Trimesh
        With the same triangles; the same surface if none of them cut.

    Raises
    ------
    ValueError
        If the surface still cuts itself when smoothing has had its rounds.
    """
    mesh = mesh.copy()
    for _ in range(UNFOLDING_ROUNDS):
        cutting = cutting_triangles(mesh.vertices, mesh.faces)
        if not len(cutting):
            return mesh
        moved = np.unique(mesh.faces[np.unique(cutting)])
        vertices = mesh.vertices.copy()
        vertices[moved] = [mesh.vertices[mesh.vertex_neighbors[k]].mean(axis=0) for k in moved]
        mesh.vertices = vertices
    first, second = cutting[0]
    raise ValueError(
        "scans: expected a surface that does not cut itself,"
        f" found triangles {first} and {second} that do"
    )
