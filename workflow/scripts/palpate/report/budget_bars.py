"""What makes an interval wide, as bars, and what to improve next in words."""

import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import CONFIGURED, OBSERVED
from palpate.estimate.direct.prior import RATIO, STEPS
from palpate.units import readable

# Contributions that are shown, and what they are called.
SHOWN = {
    "contribution_log_effective_reduced_modulus": "effective E*",
    "contribution_log_youngs_modulus": "E at once",
    "contribution_poisson_ratio": "nu",
}
# Parts of a variance from which on a source has a bar, and advice.
LEAST_SHARE, LEAST_ADVISED = 0.02, 0.1
MOST_ADVICE = 4
# Units that take a prefix.
READABLE = ("m", "s", "N", "rad")


class Words(NamedTuple):
    """What a page says of a source; of one without a unit also what its size is a part of."""

    name: str
    advice: str
    of: str = ""


FINER = (
    "Compute force and surface with finer finite elements (`direct.model.edge_m`), and state what"
    " they are off by then (`direct.fit.model_std`)."
)
# By the source's name in uncertainty_budget.csv.
SOURCES = {
    "law of the force": Words(
        "law of the force",
        "Press in smaller steps from the first touch on: how the force bends with depth tells how"
        " the material stiffens.",
        "of the way between the laws",
    ),
    "law of the motion": Words(
        "law of the surface's motion",
        "Let the camera see more of the surface beside the tip. Where the object bears more, press"
        " deeper too, with a larger `deepest_m` in `object.yaml`.",
        "of the way between the laws",
    ),
    "scale of the camera": Words(
        "scale of the camera's distances",
        "Calibrate the camera with a board at the object's distance.",
        "% of all distances",
    ),
    "relaxing shares": Words(
        "how much of E relaxes",
        "Press faster, then hold still at the deepest for 10 s or more.",
        "% of E at each time",
    ),
    STEPS: Words(
        "when it relaxes",
        "Hold still at the deepest for 10 s or more: slow relaxing needs time to show.",
        "% of E from time to time",
    ),
    RATIO: Words(
        "Poisson's ratio as it was given",
        "Give Poisson's ratio more exactly, or leave it to the captures.",
        "of nu",
    ),
    "zero of the depth": Words(
        "where the tip first touches",
        "Scan the object again for its template, and measure the tip's place on the probe: the fit"
        " has to guess where the surface was touched.",
    ),
    "clocks": Words(
        "clocks of camera and force", "Press more slowly, or let one clock time camera and force."
    ),
    "clock of the camera": Words(
        "clocks of poses and camera",
        "Press more slowly, or let one clock time camera and poses, and state how well it does"
        " (`base.clock_offset_std_s` in the sensor's file).",
    ),
    "zero of the motion": Words(
        "the surface at rest", "Film more frames before the press, with nothing moving."
    ),
    "tip of the probe": Words(
        "place of the ball's centre in the target's frame",
        "Calibrate it: `palpate calibrate tip` (docs/rig.md).",
    ),
    "camera in the base frame": Words(
        "place of the camera in the base frame",
        "Calibrate it with more poses, turned about all axes and near the object:"
        " `palpate calibrate hand-eye`.",
    ),
    "place of the contact": Words(
        "place of the contact",
        "Mark the point on the object and declare it more exactly, and press where the surface is"
        " even.",
    ),
    "sinking": Words("the object sinking", "Put the object on something that does not give way."),
    "rocking": Words("the object rocking", "Hold the object so that it cannot tilt."),
    "noise of the motion": Words(
        "noise of the surface's motion",
        "Bring the camera closer, light the object evenly, and record more frames or captures: the"
        " motion of the surface is known no better than the depth pictures.",
    ),
    "noise of the depth": Words(
        "noise of the tip's depth",
        "Keep the probe's board in full view and near the camera, and record more frames or"
        " captures: the tip's depth is known no better than the board's pose.",
    ),
    "captures apart": Words(
        "captures that differ",
        "Record more captures at the same point, with the same hand and the same rest between them:"
        " those there are differ by more than their noise.",
        "% of a modulus",
    ),
    "scale of the force": Words(
        "scale of the force sensor",
        "Calibrate the force sensor with known weights.",
        "% of all forces",
    ),
    "zero of the force": Words(
        "zero of the force sensor",
        "Record the force for some seconds before the touch, in the probe's pose.",
    ),
    "drift of the force": Words(
        "drift of the force sensor", "Let the force sensor warm up, and keep the recording short."
    ),
    "radius of the sphere": Words(
        "radius of the tip", "Measure the tip with a caliper at several places."
    ),
    "curvature of the template": Words(
        "curvature of the scanned form",
        "Scan the object again, finer around the point that is pressed.",
    ),
    "compliance of the probe": Words(
        "bending of the probe", "Press the probe against something hard to measure how it bends."
    ),
    "indentation table: force": Words("finite elements: force", FINER, "% of E"),
    "indentation table: motion": Words("finite elements: surface's motion", FINER, "of nu"),
    "friction at the sphere": Words(
        "friction at the sphere", "Wet or oil the sphere, or dust it with talc.", "% of E"
    ),
    "indentation table: base friction": Words(
        "finite elements: friction at the base",
        "Bond the object to its base: the friction there is not known.",
        "of nu",
    ),
}


def bars(rows: Sequence[Mapping]) -> str:
    """Sources of a budget (`Budget.rows`) as bars, and advice for the largest, in HTML.

    A bar is a source's share of the variance.
    """
    shares = _shares(rows)
    most = shares.max(axis=0)
    order = np.argsort(-most, kind="stable")
    seen = [k for k in order if most[k] >= LEAST_SHARE]
    # On a narrow screen each bar has a head of its own.
    heads = "".join(f"<span>share of {label}</span>" for label in SHOWN.values())
    lines = [
        _legend(rows),
        '<ul class="budget">',
        f'<li class="heads"><span>source</span><span>known to</span>{heads}</li>',
        *(_source(rows[k], shares[:, k]) for k in seen),
    ]
    if len(seen) < len(rows):
        rest = _parts(1 - shares[:, seen].sum(axis=1))
        lines.append(f'<li><b>all others</b><span class="size"></span>{rest}</li>')
    return "\n".join([*lines, "</ul>", *_advice(rows, shares, order)])


def largest(rows: Sequence[Mapping]) -> str:
    """One sentence with the largest source of each quantity's doubt, and its share."""
    of: dict[str, list[str]] = {}
    for label, shares in zip(SHOWN.values(), _shares(rows), strict=True):
        at = int(np.argmax(shares))
        name = SOURCES[rows[at]["source"]].name
        of.setdefault(name, []).append(f"{100 * shares[at]:.0f} % of {label}")
    told = ", ".join(f"{source} ({', '.join(parts)})" for source, parts in of.items())
    return f"What limits it most, by its share of the variance: {told}."


def _shares(rows: Sequence[Mapping]) -> NDArray:
    """Parts of the variance of each quantity that is shown, by source (q, n)."""
    squares = np.array([[row[name] for row in rows] for name in SHOWN]) ** 2
    return squares / np.maximum(squares.sum(axis=1, keepdims=True), 1e-300)


def _legend(rows: Sequence[Mapping]) -> str:
    """What the bars are parts of."""
    wholes = []
    for at, (name, label) in enumerate(SHOWN.items()):
        std = float(np.sqrt(sum(row[name] ** 2 for row in rows)))
        told = f"{std:.3f}" if name.endswith("ratio") else f"{100 * std:.1f} %"
        wholes.append(f'<span class="key q{at}">{label}: ±{told}</span>')
    return (
        f"<p>Standard uncertainty: {' '.join(wholes)}<br>A bar is a source's share of the"
        " variance, the square of that; the largest share of any comes first.</p>"
    )


def _source(row: Mapping, shares: NDArray) -> str:
    words = SOURCES[row["source"]]
    size = _size(row["standard_uncertainty"], row["unit"], words.of)
    size += f", {row['origin']}" if row["origin"] not in (CONFIGURED, OBSERVED) else ""
    return f'<li><b>{escape(words.name)}</b><span class="size">±{size}</span>{_parts(shares)}</li>'


def _parts(shares: NDArray) -> str:
    """A bar for each quantity."""
    parts = zip(SHOWN.values(), 100 * shares, strict=True)
    return "".join(
        f'<span class="bar"><span class="of">{label}</span><span class="track">'
        f'<span class="fill q{at}" style="width:{part:.1f}%"></span></span>'
        f'<span class="part">{part:.0f} %</span></span>'
        for at, (label, part) in enumerate(parts)
    )


def _size(std: float, unit: str, of: str) -> str:
    """A standard uncertainty in the unit in which it is read best, or what it is a part of."""
    if unit == "1":
        return f"{100 * std if of.startswith('%') else std:.2g} {of}"
    own, _, per = unit.partition("/")
    scale, better = readable(std, own) if own in READABLE else (1.0, own.replace("1", ""))
    return f"{scale * std:.2g} {better}{f'/{per}' * bool(per)}"


def _advice(rows: Sequence[Mapping], shares: NDArray, order: NDArray) -> list[str]:
    """What to do about the largest sources and for what, each sentence once."""
    found: dict[str, str] = {}
    for at in order:
        parts = zip(SHOWN.values(), shares[:, at], strict=True)
        helped = [label for label, part in parts if part >= LEAST_ADVISED]
        if len(found) == MOST_ADVICE or not helped:
            break
        words = SOURCES[rows[at]["source"]]
        advice = re.sub("`(.+?)`", r"<code>\1</code>", escape(words.advice, quote=False))
        found.setdefault(advice, f"for {', '.join(helped)}: {words.name}")
    items = [f"<li>{told} <i>({escape(of)})</i></li>" for told, of in found.items()]
    return ["<h3>What to improve next</h3>", '<ol class="advice">', *items, "</ol>"]
