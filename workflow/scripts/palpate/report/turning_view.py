"""The dent in space, to turn: the tracked surface with motions seen and computed upon it."""

from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.result import CaptureFit
from palpate.report.objects_page import as_script, encoded, in_steps
from palpate.surface.tracked import Tracked
from palpate.units import FROM_MEDIAN, MILLIMETRES

# Frames of a press that are shown, with the first.
MOST_FRAMES = 12
# Motions beyond this part of all have the last colour.
MOST = 98.0
DECIMALS = 3
# Buttons: sign and name.
TURNS = {
    "left": ("◀", "Turn left"),
    "right": ("▶", "Turn right"),
    "up": ("▲", "Tip up"),
    "down": ("▼", "Tip down"),
    "nearer": ("+", "Zoom in"),
    "farther": ("−", "Zoom out"),
}
TOLD = (
    "The surface that follows the camera's picture, to turn (drag, or arrow keys; + and - zoom, 0"
    " goes back). Dots are places whose motion was compared: blue went in, orange came out. Where"
    " both pictures have the same colours, the estimate explains what was seen; a single dot is off"
    " by {scatter:.2g} mm."
)


def view_of(tracked: Tracked, fit: CaptureFit, force_n: Sequence[float]) -> dict:
    """What the page draws of a capture, with the force in each frame (f,) [N].

    ``steps`` (base64 of int16, frame by vertex by axis) times ``step_mm`` are places about the
    object's middle, as ``samples`` are; ``from_rad``: where the camera stood; ``seen`` and
    ``computed``: motions by frame and sample [mm], None where one was not compared; ``scatter_mm``:
    deviation of one from the other; ``deepest``: place of that frame among the frames.
    """
    shown, deepest = np.arange(len(fit.frames)), int(np.argmax(fit.depth_m))
    if len(shown) > MOST_FRAMES:
        spread = np.linspace(0, shown[-1], MOST_FRAMES - 1).round().astype(int)
        shown = np.union1d(spread, [deepest])
    x, y, _ = -tracked.camera_from_object[:3, :3].T @ tracked.camera_from_object[:3, 3]
    steps, step_mm, middle_mm = in_steps(tracked)
    numbers = fit.frames[shown]
    seen, computed = (MILLIMETRES * m[shown] for m in (fit.moved_m, fit.fitted_moved_m))
    return {
        "steps": encoded(steps[numbers], "<i2"),
        "step_mm": step_mm,
        "faces": encoded(tracked.faces, "<u4"),
        "vertices": len(tracked.template_m),
        "size_mm": float(np.linalg.norm(np.ptp(steps[0], axis=0)) * step_mm),
        "samples": _rounded((MILLIMETRES * fit.cell_m - middle_mm).ravel()),
        "seen": [_rounded(row) for row in seen],
        "computed": [_rounded(row) for row in computed],
        "most_mm": round(float(np.nanpercentile(np.abs(seen), MOST)), DECIMALS),
        "scatter_mm": float(FROM_MEDIAN * np.nanmedian(np.abs(seen - computed))),
        # From the object's -y axis, about the vertical.
        "from_rad": round(float(np.arctan2(x, -y)), DECIMALS),
        "frames": [
            f"frame {k + 1} of {len(force_n)}: {force_n[k]:.2f} N, {MILLIMETRES * depth:.1f} mm"
            for k, depth in zip(numbers.tolist(), fit.depth_m[shown].tolist(), strict=True)
        ],
        "deepest": int(np.argmax(fit.depth_m[shown])),
    }


def section(capture: str, view: Mapping) -> str:
    """HTML of a view (`view_of`) of a capture that own_page.js makes turn."""
    buttons = "".join(
        f'<button type="button" data-turn="{way}" aria-label="{name}">{sign}</button>'
        for way, (sign, name) in TURNS.items()
    )
    canvases = "".join(
        f'<figure><canvas tabindex="0" role="application" aria-label="{what} motion of the surface:'
        f' arrow keys turn it"></canvas><figcaption>{what}</figcaption></figure>'
        for what in ("Measured", "Computed")
    )
    last, most = len(view["frames"]) - 1, view["most_mm"]
    return (
        f'<div class="turning screen"><h3>{escape(capture)}: the dent, to turn</h3>'
        f'<div class="pair">{canvases}</div>'
        f'<div class="row"><label>Frame <input type="range" min="0" max="{last}" step="1"></label>'
        f'<output aria-live="polite"></output></div>'
        f'<div class="row">{buttons}<button type="button" data-turn="back">Reset view</button>'
        f'<span class="scale">−{most:.2g} mm <span class="ramp"></span> +{most:.2g} mm</span></div>'
        f'<p class="quiet">{escape(TOLD.format(scatter=view["scatter_mm"]))}</p>'
        f'<script type="application/json">{as_script(view)}</script></div>'
    )


def _rounded(values: NDArray) -> list[float | None]:
    return [None if np.isnan(x) else round(float(x), DECIMALS) for x in values]
