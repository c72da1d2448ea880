"""Whether an object's template, its support and its points fit each other."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.capture.closed_surface import read_surface
from palpate.capture.findings import Findings
from palpate.units import CUBIC_CENTIMETRES, MILLIMETRES

# Points are declared to a few millimetres.
POINT_WITHIN_M = 0.005
# Presses run roughly along the surface's normal.
LARGEST_SLANT_DEG = 45.0


def examine_template(folder: Path, spec: Mapping) -> Findings:
    """Look into an object's template, or count its scans.

    Parameters
    ----------
    folder : Path
        ``raw/<object>``.
    spec : mapping
        object.yaml, right by its model.

    Returns
    -------
    Findings
    """
    if "scans" in spec["template"]:
        count = len(list((folder / spec["template"]["scans"]).glob("*.ply")))
        return Findings(found=(f"template: of {count} scans",))
    path, unit = folder / spec["template"]["file"], spec["template"]["unit"]
    try:
        mesh = read_surface(path, unit=unit)
    except ValueError as error:
        return Findings((str(error),))
    found = Findings(found=(_described(mesh),)) + _support(folder, spec["support"], mesh)
    return found + _points(folder, spec, mesh)


def _described(mesh: trimesh.Trimesh) -> str:
    size = " x ".join(f"{side * MILLIMETRES:.0f}" for side in mesh.extents)
    volume = f"{mesh.volume * CUBIC_CENTIMETRES:.3g} cm3"
    return f"template: closed, {len(mesh.vertices)} vertices, {size} mm, {volume}"


def _support(folder: Path, support: Mapping, mesh: trimesh.Trimesh) -> Findings:
    """Whether the template stands on its support."""
    place, within = f"{folder / 'object.yaml'}: support", support["tolerance_m"]
    normal = np.array(support["plane_normal"], float)
    normal /= np.linalg.norm(normal)
    height = (mesh.vertices - support["plane_point_m"]) @ normal
    lowest = float(height.min())
    if lowest < -max(within, POINT_WITHIN_M):
        below = f"{-lowest * MILLIMETRES:.1f} mm below it"
        return Findings((f"{place}: expected the template above the plane, found it {below}",))
    on_plane = np.abs(height) <= within
    held = float(mesh.area_faces[on_plane[mesh.faces].all(axis=1)].sum())
    if not on_plane.any():
        expected = f"surface within {within * MILLIMETRES:g} mm of the plane"
        return Findings((f"{place}: expected {expected}, found {lowest * MILLIMETRES:.1f} mm",))
    contact = support.get("contact", "bonded")
    return Findings(found=(f"support: {contact}, {held * 1e4:.3g} cm2 within tolerance",))


def _points(folder: Path, spec: Mapping, mesh: trimesh.Trimesh) -> Findings:
    """Whether the declared points lie on the template and can be pressed."""
    names = list(spec["points"])
    places = np.array([spec["points"][name]["position_m"] for name in names], dtype=float)
    _, away, triangles = trimesh.proximity.closest_point(mesh, places)
    normals = mesh.face_normals[triangles]
    wrong, doubts = [], []
    for name, off, outward in zip(names, away, normals, strict=True):
        field = f"{folder / 'object.yaml'}: points.{name}"
        slant = _slant_deg(spec["points"][name], spec["support"], outward)
        if off > POINT_WITHIN_M:
            expected = f"within {POINT_WITHIN_M * MILLIMETRES:g} mm of the template"
            found = f"{off * MILLIMETRES:.1f} mm off"
            wrong.append(f"{field}.position_m: expected {expected}, found {found}")
        elif slant > LARGEST_SLANT_DEG:
            expected = f"a press within {LARGEST_SLANT_DEG:g} degrees of the surface's normal"
            doubts.append(f"{field}.direction: expected {expected}, found {slant:.0f}")
    text = f"points: {', '.join(names)}; at most {away.max() * MILLIMETRES:.1f} mm off the template"
    return Findings(tuple(wrong), tuple(doubts), (text,))


def _slant_deg(point: Mapping, support: Mapping, outward: NDArray) -> float:
    """Angle between a press and the inward normal of the surface [degrees]."""
    against = -np.array(support["plane_normal"], dtype=float)
    direction = np.array(point.get("direction", against), dtype=float)
    cosine = -outward @ direction / max(np.linalg.norm(direction), 1e-12)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
