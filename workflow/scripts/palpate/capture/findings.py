"""What a look into an object's folder finds: its template, and the force of its captures."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from palpate.capture.closed_surface import read_surface
from palpate.capture.tables import FORCE
from palpate.units import CUBIC_CENTIMETRES, MILLIMETRES

# Points are declared to a few millimetres.
POINT_WITHIN_M = 0.005
# Indentations run roughly along the surface's normal.
LARGEST_SLANT_DEG = 45.0
SLOWEST_HZ = 100.0
# Drift or noise of the rest over the indentation's peak.
LARGEST_REST_SHARE = 0.1
# Frames before the indentation, and frames in it.
FEWEST_AT_REST, FEWEST_PRESSED = 2, 5
PRESSED_SHARE = 0.05


@dataclass(frozen=True)
class Findings:
    """Lines on a folder, or on several."""

    wrong: tuple[str, ...] = ()  # what must be mended
    warnings: tuple[str, ...] = ()  # what may be as it should, but seldom is
    found: tuple[str, ...] = ()  # what is there

    def __add__(self, other: "Findings") -> "Findings":
        """Both together, in their order."""
        return Findings(
            self.wrong + other.wrong, self.warnings + other.warnings, self.found + other.found
        )


def examine_template(folder: Path, spec: Mapping) -> Findings:
    """Look into an object's template, or count its scans; object.yaml is right by its model."""
    if "scans" in spec["template"]:
        count = len(list((folder / spec["template"]["scans"]).glob("*.ply")))
        return Findings(found=(f"template: of {count} scans",))
    path, unit = folder / spec["template"]["file"], spec["template"]["unit"]
    try:
        mesh = read_surface(path, unit=unit)
    except ValueError as error:
        return Findings((str(error),))
    size = " x ".join(f"{side * MILLIMETRES:.0f}" for side in mesh.extents)
    volume = f"{mesh.volume * CUBIC_CENTIMETRES:.3g} cm3"
    text = f"template: closed, {len(mesh.vertices)} vertices, {size} mm, {volume}"
    source = folder / "object.yaml"
    return (
        Findings(found=(text,))
        + _examine_support(source, spec["support"], mesh)
        + _examine_points(source, spec, mesh)
    )


def _examine_support(source: Path, support: Mapping, mesh: trimesh.Trimesh) -> Findings:
    """Whether the template stands on its support."""
    within = support["tolerance_m"]
    normal = np.array(support["plane_normal"], float)
    height = (mesh.vertices - support["plane_point_m"]) @ (normal / np.linalg.norm(normal))
    lowest_mm, on_plane = float(height.min()) * MILLIMETRES, np.abs(height) <= within
    if height.min() < -max(within, POINT_WITHIN_M):
        line = f"expected the template above the plane, found it {-lowest_mm:.1f} mm below it"
    elif not on_plane.any():
        expected = f"expected surface within {within * MILLIMETRES:g} mm of the plane"
        line = f"{expected}, found {lowest_mm:.1f} mm"
    else:
        held_cm2 = 1e4 * float(mesh.area_faces[on_plane[mesh.faces].all(axis=1)].sum())
        contact = support.get("contact", "bonded")
        return Findings(found=(f"support: {contact}, {held_cm2:.3g} cm2 within tolerance",))
    return Findings((f"{source}: support: {line}",))


def _examine_points(source: Path, spec: Mapping, mesh: trimesh.Trimesh) -> Findings:
    """Whether the declared points lie on the template and can be indented."""
    points, against = spec["points"], -np.array(spec["support"]["plane_normal"], dtype=float)
    places = np.array([point["position_m"] for point in points.values()], dtype=float)
    _, away, triangles = trimesh.proximity.closest_point(mesh, places)
    wrong, warnings = [], []
    for (name, point), off, triangle in zip(points.items(), away, triangles, strict=True):
        direction = np.array(point.get("direction", against), dtype=float)
        cosine = -mesh.face_normals[triangle] @ direction / max(np.linalg.norm(direction), 1e-12)
        slant = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
        field = f"{source}: points.{name}"
        if off > POINT_WITHIN_M:
            expected = f"within {POINT_WITHIN_M * MILLIMETRES:g} mm of the template"
            found = f"{off * MILLIMETRES:.1f} mm off"
            wrong.append(f"{field}.position_m: expected {expected}, found {found}")
        elif slant > LARGEST_SLANT_DEG:
            expected = f"a press within {LARGEST_SLANT_DEG:g} degrees of the surface's normal"
            warnings.append(f"{field}.direction: expected {expected}, found {slant:.0f}")
    off = f"at most {away.max() * MILLIMETRES:.1f} mm off the template"
    return Findings(tuple(wrong), tuple(warnings), (f"points: {', '.join(points)}; {off}",))


def examine_force(
    folder: Path,
    time_s: NDArray,
    load_n: NDArray,
    rest: NDArray,
    frames_s: NDArray,
    *,
    onset_n: float,
) -> Findings:
    """Look into a capture's record of forces: what is unusual, and does not keep it from use.

    Parameters
    ----------
    folder : Path
        ``raw/<object>/<sensor>/<capture>``.
    time_s : (n,) array
        Of the samples [s].
    load_n : (n, 3) array
        On the sensor, its zero taken out, as running means [N].
    rest : (n,) bool array
        Where the zero was taken.
    frames_s : (m,) array
        Times of the frames, the record's clock [s].
    onset_n : float
        Smallest force that counts as contact [N].
    """
    path, size_n, rest_n = folder / FORCE, np.linalg.norm(load_n, axis=1), load_n[rest]
    rate_hz = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    peak_n, noise_n = float(size_n.max()), float(rest_n.std(axis=0).max())
    half = max(1, len(rest_n) // 2)
    drift_n = np.linalg.norm(rest_n[half:].mean(axis=0) - rest_n[:half].mean(axis=0))
    first = time_s < time_s[0] + np.ptp(time_s[rest])
    first_n = float(np.linalg.norm(load_n[first].mean(axis=0)))
    seen_n = np.interp(frames_s, time_s, size_n)
    pressed = np.flatnonzero(seen_n > max(onset_n, PRESSED_SHARE * peak_n))
    before = int(pressed[0]) if len(pressed) else len(seen_n)
    moved_n = max(drift_n, noise_n)
    usual = (
        (moved_n <= LARGEST_REST_SHARE * peak_n, f"{path}: force",
         "an unloaded probe where the zero is taken", f"it moving by {moved_n:.2f} N"),
        (first_n <= onset_n, f"{path}: force",
         "the load of the first frames, which is taken for zero, at the record's begin too",
         f"{first_n:.2f} N (where did the probe lie?)"),
        (rate_hz >= SLOWEST_HZ, f"{path}: time_s",
         f"{SLOWEST_HZ:g} Hz or more", f"{rate_hz:.0f} Hz"),
        (before >= FEWEST_AT_REST, f"{folder}: frames",
         f"at least {FEWEST_AT_REST} before the press", before),
        (len(pressed) >= FEWEST_PRESSED, f"{folder}: frames",
         f"at least {FEWEST_PRESSED} in the press", len(pressed)),
    )  # fmt: skip
    warnings = [f"{at}: expected {one}, found {other}" for so, at, one, other in usual if not so]
    text = f"force {rate_hz:.0f} Hz, {noise_n:.3f} N of noise at rest, peak {peak_n:.2f} N"
    return Findings(warnings=tuple(warnings), found=(text,))
