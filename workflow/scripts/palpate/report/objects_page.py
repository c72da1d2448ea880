"""Tracked objects in three dimensions: one page that needs nothing from elsewhere."""

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.modulus import INTERVAL, Modulus
from palpate.report.own_words import OF_NU, by
from palpate.report.style import ERROR_NAMES, sensor_name
from palpate.report.table_page import STYLE
from palpate.report.tables import bound_mark
from palpate.surface.pose import to_object
from palpate.surface.tracked import Tracked
from palpate.units import MILLIMETRES

# Coordinates are kept as whole steps of the object's extent, with room at both ends.
LARGEST_STEP = 32_000
# Of the table of moduli.
COLUMNS = {"E": "youngs_modulus_pa", "nu": "poisson_ratio", "reduced": "reduced_modulus_pa"}


@dataclass(frozen=True)
class Shown:
    """One capture on the page: ``object``, ``sensor``, ``capture``, ``point``, ``provenance``.

    With its hertz.json, whose samples hold force and depth of each frame, minimise-<error>.json by
    error option, and the recommended row of summary.csv of its object and sensor, if there is one.
    """

    capture: Mapping
    tracked: Tracked
    fit: Mapping
    minima: Mapping[str, Mapping]
    advised: Mapping | None = None


def view(shown: Shown) -> dict:
    """What the page gets of one capture.

    ``title``, ``provenance``; ``steps`` (base64 of int16, frame by vertex by axis), ``step_mm`` and
    ``middle_mm`` that take them to the object frame, ``faces`` (base64 of uint32); ``frames``
    (force and depth of each, as text), ``deepest_frame``, ``largest_mm``: the greatest displacement
    there, and ``moduli``: rows of text.

    Raises
    ------
    ValueError
        If the fit has not as many samples as the surface has frames, or a vertex is not finite.
    """
    tracked, samples = shown.tracked, shown.fit["samples"]
    count = len(tracked.vertices_m)
    if (found := len(samples["force_n"])) != count:
        raise ValueError(f"samples: expected {count}, one for each frame, found {found}")
    deepest = int(shown.fit["range"]["last_frame"])
    steps, step_mm, middle_mm = in_steps(tracked)
    # Since the first frame, as the moduli are estimated.
    moved = tracked.vertices_m[deepest] - tracked.vertices_m[0]
    moved_mm = np.linalg.norm(moved, axis=1) * MILLIMETRES
    name = shown.capture["object"].replace("_", " ").capitalize()
    rows = moduli(shown.fit, shown.minima)
    if (advised := shown.advised) is not None:
        verdict = OF_NU.get(advised["poisson_ratio_verdict"], "")
        rows = [_row(f"Recommended, by {by(advised)}", advised, verdict), *rows]
    return {
        "title": f"{name}, point {shown.capture['point']}, {sensor_name(shown.capture['sensor'])}",
        "provenance": shown.capture["provenance"],
        "steps": encoded(steps, "<i2"),
        "step_mm": step_mm,
        "middle_mm": middle_mm.tolist(),
        "faces": encoded(tracked.faces, "<u4"),
        "vertices": len(tracked.template_m),
        "frames": [
            f"{force:.2f} N" + f", {depth * MILLIMETRES:.1f} mm deep" * (depth > 0)
            for force, depth in zip(samples["force_n"], samples["depth_m"], strict=True)
        ],
        "deepest_frame": deepest,
        "largest_mm": float(moved_mm.max().round(3)),
        "moduli": rows,
    }


def in_steps(tracked: Tracked) -> tuple[NDArray, float, NDArray]:
    """Vertices of all frames in the object frame as whole steps about their middle.

    Steps (f, n, 3) int, the length of a step [mm], a 64,000th of the object's greatest extent, and
    the middle (3,) [mm].

    Raises
    ------
    ValueError
        If a vertex is not finite.
    """
    places = to_object(tracked.camera_from_object, tracked.vertices_m) * MILLIMETRES
    if not np.isfinite(places).all():
        raise ValueError("vertices_m: expected finite places, found others")
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    middle = (low + high) / 2
    step = float((high - low).max() / (2 * LARGEST_STEP))
    return np.rint((places - middle) / step).astype(int), step, middle


def moduli(fit: Mapping, minima: Mapping[str, Mapping]) -> list[dict[str, str]]:
    """Moduli of a capture by method, as text, with what is to be said of nu."""
    advised = fit["recommended"]
    ends = advised["reduced_modulus_interval_pa"]
    star = Modulus(advised["reduced_modulus_pa"], *ends, INTERVAL, "Pa").cells("reduced_modulus_pa")
    rows = [
        _row("Hertz fit (Eq. 5.1)", fit["study"]),
        _row("Recommended contact model", star, "; ".join(advised["doubts"])),
    ]
    for error, minimum in minima.items():
        reason = minimum["least_squares"]["length"]["unknown"]
        verdict = minimum["profile"]["verdict"] + (f" ({reason})" if reason else "")
        rows.append(_row(f"Minimisation, {ERROR_NAMES[error]} error", minimum, verdict))
    return rows


def page(
    template: str,
    *,
    behaviour: str,
    plotly: str,
    views: Sequence[Mapping],
    tracker: str,
    estimates: str = "",
) -> str:
    """Put style, views, their behaviour and the plotting library into the page.

    The template is HTML with the places ``@@name@@``, behaviour and plotly are scripts, views are
    as `view` gives them, and ``estimates`` as `objects_table.section` does; ``tracker`` says whose
    surfaces they are. The same views give the same page.
    """
    parts = {
        "@@style@@": STYLE,
        "@@estimates@@": estimates,
        "@@plotly@@": plotly.replace("</script", "<\\/script"),
        "@@behaviour@@": behaviour,
        "@@data@@": as_script({"tracker": tracker, "views": list(views)}),
    }
    for place, part in parts.items():
        if (found := template.count(place)) != 1:
            raise ValueError(f"template: expected {place} once, found it {found} times")
        template = template.replace(place, part)
    return template


def _row(method: str, found: Mapping, verdict: str = "") -> dict[str, str]:
    """Row of the table of moduli; whether a bound ended the search for them."""
    moduli = {key: Modulus.of_row(found, name) for key, name in COLUMNS.items()}
    told = {key: one.told() + bound_mark(found) if one else "" for key, one in moduli.items()}
    return told | {"method": method, "verdict": verdict}


def as_script(data: Mapping) -> str:
    """JSON that may stand in a page's script."""
    return json.dumps(data).replace("<", "\\u003c")


def encoded(values: NDArray, kind: str) -> str:
    """Base64 of numbers in an order of bytes that is told."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
