"""A template's file: a closed triangle mesh of one piece, as scanners and modellers write it."""

from pathlib import Path

import numpy as np
import trimesh
from trimesh.graph import connected_component_labels

from palpate.capture.discover import MESHES
from palpate.open3d_core import o3d
from palpate.units import METRES
from palpate.yaml_files import mismatch

# Objects that one depth camera and a hand-held probe can measure [m].
PLAUSIBLE_SIZE_M = (0.01, 3.0)
# Readers' options: the shape alone, and nothing else that a file may name, like a picture.
SHAPE_ALONE = {
    ".ply": {"skip_materials": True, "fix_texture": False},
    ".obj": {"skip_materials": True},
}


def read_surface(path: str | Path, *, unit: str) -> trimesh.Trimesh:
    """Read a closed surface in metres; ``unit`` is that of the file's coordinates, m or mm.

    The file's name ends with one of `MESHES`. Vertices that a texture or normals part are
    one where the surface is open otherwise, and triangles are turned outward.

    Raises
    ------
    ValueError
        If it is no closed surface of one piece, or its size says that the unit is wrong.
    """
    mesh = _loaded(Path(path))
    if not len(mesh.faces):
        raise ValueError(f"{path}: template: expected a triangle mesh, found no faces")
    if not mesh.is_watertight:
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
    try:
        mesh = turned_outward(mesh)
    except ValueError as error:
        raise ValueError(f"{path}: template: {error}") from None
    pieces = connected_component_labels(mesh.face_adjacency, node_count=len(mesh.faces))
    if pieces.max() > 0:
        raise ValueError(f"{path}: template: expected one piece, found {pieces.max() + 1}")
    size, (low, high) = float(mesh.extents.max()), PLAUSIBLE_SIZE_M
    if not low <= size * METRES[unit] <= high:
        others = [name for name, scale in METRES.items() if low <= size * scale <= high]
        hint = f" (is its unit {others[0]}?)" if others else ""
        found = f"{size * METRES[unit]:g} m{hint}"
        raise mismatch(f"{path}: template.unit", f"an object of {low:g} to {high:g} m", found)
    mesh.vertices = np.asarray(mesh.vertices) * METRES[unit]
    return mesh


def turned_outward(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A closed surface with all triangles turned outward.

    Raises
    ------
    ValueError
        Without the name of its file, if it is open, branches, or has one side only.
    """
    if not mesh.is_watertight:
        _, counts = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
        found = f"{(counts == 1).sum()} open edges"
        if not (counts == 1).any():
            found = f"edges with more than two faces, {(counts > 2).sum()} (doubled triangles?)"
        raise ValueError(f"expected a closed surface, found {found}")
    if not mesh.is_winding_consistent:
        legacy = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(mesh.vertices), o3d.utility.Vector3iVector(mesh.faces)
        )
        if not legacy.orient_triangles():
            raise ValueError("expected an inside and an outside, found one side only")
        mesh = trimesh.Trimesh(mesh.vertices, np.asarray(legacy.triangles), process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def _loaded(path: Path) -> trimesh.Trimesh:
    kind = path.suffix.lower()
    if kind not in MESHES:
        raise mismatch(f"{path}: template", f"a file of {', '.join(MESHES)}", kind or "another")
    try:
        with path.open("rb") as stream:
            options = SHAPE_ALONE.get(kind, {})
            mesh = trimesh.load_mesh(stream, file_type=kind[1:], process=True, **options)
        whole = isinstance(mesh, trimesh.Trimesh) and np.isfinite(mesh.vertices).all()
        size = len(mesh.vertices) if whole else 0
        whole = whole and (not mesh.faces.size or 0 <= mesh.faces.min() <= mesh.faces.max() < size)
    except (OSError, MemoryError):
        raise
    except Exception as error:  # its readers raise whatever a damaged file leads to
        reason = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise ValueError(f"{path}: template: expected a mesh, found none ({reason})") from None
    if not whole:
        raise mismatch(f"{path}: template", "finite vertices and faces of them", "others")
    return mesh
