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
NOTHING = ""
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
    if len(samples["force_n"]) != count:
        found = len(samples["force_n"])
        raise ValueError(f"samples: expected {count}, one for each frame, found {found}")
    deepest = int(shown.fit["range"]["last_frame"])
    steps, step_mm, middle_mm = in_steps(tracked)
    # Since the first frame, as the moduli are estimated.
    moved = tracked.vertices_m[deepest] - tracked.vertices_m[0]
    moved_mm = np.linalg.norm(moved, axis=1) * MILLIMETRES
    return {
        "title": title(shown.capture),
        "provenance": shown.capture["provenance"],
        "steps": encoded(steps, "<i2"),
        "step_mm": step_mm,
        "middle_mm": middle_mm.tolist(),
        "faces": encoded(tracked.faces, "<u4"),
        "vertices": len(tracked.template_m),
        "frames": [
            _pressed(force, depth)
            for force, depth in zip(samples["force_n"], samples["depth_m"], strict=True)
        ],
        "deepest_frame": deepest,
        "largest_mm": float(moved_mm.max().round(3)),
        "moduli": [*recommended(shown.advised), *moduli(shown.fit, shown.minima)],
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


def title(capture: Mapping) -> str:
    """Name of a capture as a reader knows it."""
    name = capture["object"].replace("_", " ").capitalize()
    return f"{name}, point {capture['point']}, {sensor_name(capture['sensor'])}"


def recommended(advised: Mapping | None) -> list[dict[str, str]]:
    """Row of the recommended estimate, with what is known of nu; none where there is none."""
    if advised is None:
        return []
    verdict = advised["poisson_ratio_verdict"]
    told = {"verdict": OF_NU.get(verdict, NOTHING)}
    return [_row(f"Recommended, by {by(advised)}", advised) | told]


def moduli(fit: Mapping, minima: Mapping[str, Mapping]) -> list[dict[str, str]]:
    """Moduli of a capture by method, as text, with what is to be said of nu."""
    advised = fit["recommended"]
    star = Modulus(
        advised["reduced_modulus_pa"], *advised["reduced_modulus_interval_pa"], INTERVAL, "Pa"
    )
    rows = [
        _row("Hertz fit (Eq. 5.1)", fit["study"]),
        _row("Recommended contact model", star.cells("reduced_modulus_pa"))
        | {"verdict": "; ".join(advised["doubts"]) or NOTHING},
    ]
    for error, minimum in minima.items():
        row = _row(f"Minimisation, {ERROR_NAMES[error]} error", minimum)
        rows.append(row | {"verdict": _verdict(minimum)})
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
    data = {"tracker": tracker, "views": list(views)}
    parts = {
        "@@style@@": STYLE,
        "@@estimates@@": estimates,
        "@@plotly@@": plotly.replace("</script", "<\\/script"),
        "@@behaviour@@": behaviour,
        "@@data@@": json.dumps(data, ensure_ascii=True).replace("<", "\\u003c"),
    }
    for place, part in parts.items():
        if template.count(place) != 1:
            found = template.count(place)
            raise ValueError(f"template: expected {place} once, found it {found} times")
        template = template.replace(place, part)
    return template


def _pressed(force_n: float, depth_m: float) -> str:
    depth = f", {depth_m * MILLIMETRES:.1f} mm deep" if depth_m > 0 else NOTHING
    return f"{force_n:.2f} N{depth}"


def _verdict(minimum: Mapping) -> str:
    verdict, reason = minimum["profile"]["verdict"], minimum["least_squares"]["length"]["unknown"]
    return f"{verdict} ({reason})" if reason else verdict


def _row(method: str, found: Mapping) -> dict[str, str]:
    """Row of the table of moduli; whether a bound ended the search for them."""
    moduli = {key: Modulus.of_row(found, name) for key, name in COLUMNS.items()}
    told = {key: one.told() + bound_mark(found) for key, one in moduli.items() if one}
    return dict.fromkeys(COLUMNS, NOTHING) | told | {"method": method, "verdict": NOTHING}


def encoded(values: NDArray, kind: str) -> str:
    """Base64 of numbers in an order of bytes that is told."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
