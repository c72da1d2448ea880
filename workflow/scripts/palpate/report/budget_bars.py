"""Uncertainty budget of an estimate: shares of the variance, and what to improve next."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.estimate.direct.options import CONFIGURED, OBSERVED
from palpate.estimate.direct.prior import RATIO, STEPS
from palpate.units import PERCENT, readable

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
    "Compute force and surface with finer finite elements (`direct.model.edge_m`), and state their"
    " error then (`direct.fit.model_std`)."
)
# By the source's name in uncertainty_budget.csv.
SOURCES = {
    "law of the force": Words(
        "law of the force",
        "Indent in smaller steps from the first touch on: the curvature of force over depth"
        " determines how the material stiffens.",
        "of the material-law parameter",
    ),
    "law of the motion": Words(
        "law of the surface displacement",
        "Let the camera see more of the surface beside the tip. Where the object bears it, indent"
        " deeper too, with a larger `deepest_m` in `object.yaml`.",
        "of the material-law parameter",
    ),
    "scale of the camera": Words(
        "scale of the camera's distances",
        "Calibrate the camera with a target at the object's distance.",
        "% of all distances",
    ),
    "relaxing shares": Words(
        "relaxation amplitudes",
        "Indent faster, then hold still at maximum depth for 10 s or more.",
        "% of E at each time",
    ),
    STEPS: Words(
        "relaxation times",
        "Hold still at maximum depth for 10 s or more: slow relaxation needs time to show.",
        "% of E from time to time",
    ),
    RATIO: Words(
        "Poisson's ratio as it was given",
        "Give Poisson's ratio more exactly, or leave it to the captures.",
        "of nu",
    ),
    "zero of the depth": Words(
        "offset of the depth",
        "Scan the object again for its template, and measure the tip's place on the probe: the fit"
        " has to find where the surface was touched.",
    ),
    "clocks": Words(
        "clocks of camera and force", "Indent more slowly, or let one clock time camera and force."
    ),
    "clock of the camera": Words(
        "clocks of poses and camera",
        "Indent more slowly, or let one clock time camera and poses, and state how well it does"
        " (`base.clock_offset_std_s` in the sensor's file).",
    ),
    "zero of the motion": Words(
        "the surface at rest", "Record more frames before the touch, with nothing moving."
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
        "Mark the point on the object and declare it more exactly, and indent where the surface is"
        " even.",
    ),
    "sinking": Words("support compliance: sinking", "Put the object on something stiff."),
    "rocking": Words("support compliance: rocking", "Fix the object so that it cannot tilt."),
    "noise of the motion": Words(
        "noise of the surface displacement",
        "Bring the camera closer, light the object evenly, and record more frames or captures: the"
        " displacement is known no better than the depth images.",
    ),
    "noise of the depth": Words(
        "noise of the indentation depth",
        "Keep the probe's target in full view and near the camera, and record more frames or"
        " captures: the depth is known no better than the target's pose.",
    ),
    "captures apart": Words(
        "captures that differ",
        "Record more captures at the same point, at the same speed and with the same pause between"
        " them: those there are differ by more than their noise.",
        "% of a modulus",
    ),
    "scale of the force": Words(
        "scale of the force sensor",
        "Calibrate the force sensor with known weights.",
        "% of all forces",
    ),
    "zero of the force": Words(
        "offset of the force sensor",
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
        "Scan the object again, finer around the point of contact.",
    ),
    "compliance of the probe": Words(
        "compliance of the probe", "Measure it: `palpate calibrate stiffness` (docs/rig.md)."
    ),
    "indentation table: force": Words("finite elements: force", FINER, "% of E"),
    "indentation table: motion": Words("finite elements: displacement", FINER, "of nu"),
    "friction at the sphere": Words(
        "friction at the sphere", "Wet or oil the sphere, or dust it with talc.", "% of E"
    ),
    "indentation table: base friction": Words(
        "finite elements: base friction",
        "Bond the object to its base: the friction there is not known.",
        "of nu",
    ),
}


def bars(rows: Sequence[Mapping]) -> dict:
    """What a page shows of a budget (`Budget.rows`), as text and shares of the variance.

    Returns
    -------
    dict
        ``wholes``: name and standard uncertainty of each quantity that is shown; ``sources``, the
        largest first, each with ``name``, ``size`` and ``parts``, its share of each [%]; and
        ``advice``, what to do about the largest sources and for what.
    """
    shares = _shares(rows)
    most = shares.max(axis=0)
    order = np.argsort(-most, kind="stable")
    seen = [k for k in order if most[k] >= LEAST_SHARE]
    sources = [
        {"name": SOURCES[rows[k]["source"]].name, "size": _size(rows[k]), "parts": shares[:, k]}
        for k in seen
    ]
    if len(seen) < len(rows):
        rest = 1 - shares[:, seen].sum(axis=1)
        sources.append({"name": "all others", "size": "", "parts": rest})
    for one in sources:
        one["parts"] = (PERCENT * one["parts"]).tolist()
    wholes = [(label, _whole(rows, name)) for name, label in SHOWN.items()]
    return {"wholes": wholes, "sources": sources, "advice": _advice(rows, shares, order)}


def largest(rows: Sequence[Mapping]) -> str:
    """One sentence with the largest source of each quantity's uncertainty, and its share."""
    of: dict[str, list[str]] = {}
    for label, shares in zip(SHOWN.values(), _shares(rows), strict=True):
        at = int(np.argmax(shares))
        name = SOURCES[rows[at]["source"]].name
        of.setdefault(name, []).append(f"{100 * shares[at]:.0f} % of {label}")
    told = ", ".join(f"{source} ({', '.join(parts)})" for source, parts in of.items())
    return f"Largest sources of uncertainty, by share of the variance: {told}."


def _shares(rows: Sequence[Mapping]) -> NDArray:
    """Parts of the variance of each quantity that is shown, by source (q, n)."""
    squares = np.array([[row[name] for row in rows] for name in SHOWN]) ** 2
    return squares / np.maximum(squares.sum(axis=1, keepdims=True), 1e-300)


def _whole(rows: Sequence[Mapping], name: str) -> str:
    """Standard uncertainty of a quantity by all sources."""
    std = float(np.sqrt(sum(row[name] ** 2 for row in rows)))
    return f"{std:.3f}" if name.endswith("ratio") else f"{PERCENT * std:.1f} %"


def _size(row: Mapping) -> str:
    """A standard uncertainty in the unit in which it is read best, or what it is a part of."""
    std, of = row["standard_uncertainty"], SOURCES[row["source"]].of
    origin = f", {row['origin']}" if row["origin"] not in (CONFIGURED, OBSERVED) else ""
    own, slash, per = row["unit"].partition("/")
    scale, unit = readable(std, own) if own in READABLE else (1.0, own.removeprefix("1"))
    if not unit + per:
        scale, unit = PERCENT if of.startswith("%") else 1.0, of
    # Two digits that count, without an exponent where there are few others.
    return f"±{float(f'{scale * std:.2g}'):g} {unit}{slash}{per}{origin}"


def _advice(rows: Sequence[Mapping], shares: NDArray, order: NDArray) -> dict[str, str]:
    """What to do about the largest sources, each sentence once, and for what."""
    found: dict[str, str] = {}
    for at in order:
        parts = zip(SHOWN.values(), shares[:, at], strict=True)
        helped = [label for label, part in parts if part >= LEAST_ADVISED]
        if len(found) == MOST_ADVICE or not helped:
            break
        words = SOURCES[rows[at]["source"]]
        found.setdefault(words.advice, f"for {', '.join(helped)}: {words.name}")
    return found
