"""The object's surface to turn, frame by frame: tracked, and as the estimate computes it."""

import base64
from collections.abc import Mapping, Sequence

import numpy as np
import trimesh
from markupsafe import Markup
from numpy.typing import NDArray
from plotly.offline import get_plotlyjs
from scipy.spatial.distance import cdist

from palpate.estimate.direct.result import CaptureFit
from palpate.report.pages import title_of
from palpate.report.point_maps import PointMap
from palpate.report.style import capture_name, sensor_name
from palpate.surface.pose import to_object
from palpate.surface.tracked import Tracked
from palpate.units import KILOPASCALS, MILLIMETRES

# Coordinates are kept as whole steps of the object's extent, with room at both ends.
LARGEST_STEP = 32_000
# Frames of an indentation that are shown, with the first and the deepest.
MOST_FRAMES = 24
# Displacements beyond this percentile of all have the last colour; samples stand this part of their
# distance from the middle outside of the surface, to be seen.
MOST, OUTSIDE = 98.0, 0.01
DECIMALS = 3
# Marks of points stand above the surface by this part of its extent, so that it hides none of them.
LIFTED = 0.02


def plotly() -> Markup:
    """The script that draws views, to be embedded once a page."""
    return Markup(get_plotlyjs().replace("</script", "<\\/script"))


def view(
    capture: Mapping, tracked: Tracked, fit: Mapping, estimate: CaptureFit | None = None
) -> dict:
    """What the viewer gets of one capture.

    Parameters
    ----------
    capture : mapping
        ``object``, ``sensor``, ``capture``, ``provenance``.
    tracked : Tracked
    fit : mapping
        Its hertz.json, whose samples hold force and depth of each frame.
    estimate : CaptureFit, optional
        What the direct estimate compared of it: corrects the depths, and adds the samples.

    Returns
    -------
    dict
        ``title``, ``provenance``; ``steps`` (base64 of int16, frame by vertex by axis), ``step_mm``
        and ``middle_mm`` that take them to the object frame, ``faces`` (base64 of uint32);
        ``frames`` (as text), ``deepest_frame`` among these, ``largest_mm``: the largest
        displacement there; ``from_rad``: azimuth of the camera from the object's -y axis;
        ``samples`` [mm], ``measured`` and ``computed`` displacements by frame and sample [mm], None
        where one was not compared, and ``most_mm``: None and nothing without an estimate.

    Raises
    ------
    ValueError
        If the fit has not as many samples as the surface has frames, or a vertex is not finite.
    """
    samples, count = fit["samples"], len(tracked.vertices_m)
    if (found := len(samples["force_n"])) != count:
        raise ValueError(f"samples: expected {count}, one for each frame, found {found}")
    depth_m, deepest = samples["depth_m"], int(fit["range"]["last_frame"])
    if estimate is not None:
        depth_m = estimate.tip_depth_m
        deepest = int(estimate.frames[np.argmax(estimate.depth_m)])
    spread = np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int)
    shown = np.union1d(spread, [deepest])
    places = to_object(tracked.camera_from_object, tracked.vertices_m) * MILLIMETRES
    # Since the first frame, as the moduli are estimated.
    moved = np.linalg.norm(tracked.vertices_m[deepest] - tracked.vertices_m[0], axis=1)
    surface = _surface(places, tracked.faces, shown)
    return surface | {
        "title": f"{title_of(capture['object'])}, {capture_name(capture)}",
        "provenance": capture["provenance"],
        "frames": [_told(k, count, samples["force_n"][k], depth_m[k]) for k in shown.tolist()],
        "deepest_frame": int(np.flatnonzero(shown == deepest)[0]),
        "largest_mm": round(float(MILLIMETRES * moved.max()), DECIMALS),
        "from_rad": _azimuth(tracked),
        **(_samples(estimate, shown, surface["middle_mm"]) if estimate else {"samples": None}),
    }


def map_view(one: PointMap, tracked: Tracked) -> dict:
    """What the viewer gets of a map of stiffness, seen as in a capture of its sensor.

    Returns
    -------
    dict
        As of `view`, of one frame and without samples, and ``map``: ``value``, ``low`` and ``high``
        by vertex and then by point, ``ends`` of the colours [kPa], and ``names`` and ``places`` of
        the points [mm].
    """
    vertices = tracked.template_m
    each = one.map.at(vertices)
    moduli = [(m.value, m.low, m.high) for m in one.map.moduli]
    fields = KILOPASCALS * np.column_stack([each, np.transpose(moduli)])
    surface = _surface(MILLIMETRES * vertices[None], tracked.faces, np.zeros(1, int))
    mesh = trimesh.Trimesh(vertices, tracked.faces, process=False)
    outward = mesh.vertex_normals[cdist(one.map.places_m, vertices).argmin(axis=1)]
    lifted = one.map.places_m + LIFTED * np.ptp(vertices, axis=0).max() * outward
    ends = fields[1, len(vertices) :].min(), fields[2, len(vertices) :].max()
    return surface | {
        "title": f"Map of effective E*, {sensor_name(one.sensor)}",
        "frames": [one.text()],
        "deepest_frame": 0,
        "from_rad": _azimuth(tracked),
        "samples": None,
        "map": dict(zip(("value", "low", "high"), fields.round(DECIMALS).tolist(), strict=True))
        | {"ends": ends, "names": list(one.points)}
        | {"places": (MILLIMETRES * lifted).round(DECIMALS).tolist()},
    }


def _azimuth(tracked: Tracked) -> float:
    """Of the camera from the object's -y axis [rad]."""
    x, y, _ = -tracked.camera_from_object[:3, :3].T @ tracked.camera_from_object[:3, 3]
    return round(float(np.arctan2(x, -y)), DECIMALS)


def _surface(places_mm: NDArray, faces: NDArray, shown: NDArray) -> dict:
    """Vertices (f, n, 3) of the frames that are shown, as whole steps about their middle."""
    if not np.isfinite(places_mm).all():
        raise ValueError("vertices_m: expected finite places, found others")
    low, high = places_mm.min(axis=(0, 1)), places_mm.max(axis=(0, 1))
    middle, step = (low + high) / 2, float((high - low).max() / (2 * LARGEST_STEP))
    return {
        "steps": _encoded(np.rint((places_mm[shown] - middle) / step), "<i2"),
        "step_mm": step,
        "middle_mm": middle.tolist(),
        "faces": _encoded(faces, "<u4"),
        "vertices": places_mm.shape[1],
    }


def _samples(estimate: CaptureFit, shown: NDArray, middle_mm: Sequence[float]) -> dict:
    """Places, and displacements measured and computed in the frames that are shown."""
    places = MILLIMETRES * estimate.cell_m
    outward = places - middle_mm
    found = np.full((2, len(shown), len(places)), np.nan)
    _, mine, theirs = np.intersect1d(shown, estimate.frames, return_indices=True)
    found[0, mine], found[1, mine] = estimate.moved_m[theirs], estimate.fitted_moved_m[theirs]
    measured, computed = MILLIMETRES * found
    return {
        "samples": (places + OUTSIDE * outward).round(DECIMALS).ravel().tolist(),
        "measured": np.where(np.isnan(measured), None, measured.round(DECIMALS)).tolist(),
        "computed": np.where(np.isnan(computed), None, computed.round(DECIMALS)).tolist(),
        "most_mm": round(float(np.nanpercentile(np.abs(measured), MOST)), DECIMALS),
    }


def _told(frame: int, count: int, force_n: float, depth_m: float) -> str:
    deep = f", {depth_m * MILLIMETRES:.1f} mm deep" * bool(depth_m > 0)
    return f"{frame + 1} of {count}: {force_n:.2f} N{deep}"


def _encoded(values: NDArray, kind: str) -> str:
    """Base64 of numbers in a stated order of bytes."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
