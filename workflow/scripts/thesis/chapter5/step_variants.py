"""Changes of the error minimisation: one after the other, each alone, and on the true surface."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from palpate.surface.tracked import Tracked

FIRST, ADDED, ALONE, TRUE = "as configured", "added", "alone", "true surface"


@dataclass(frozen=True)
class Variant:
    """The error minimisation with some of its options changed.

    Attributes
    ----------
    step : str
        Name of the change; ``as configured`` for none.
    kind : {"as configured", "added", "alone", "true surface"}
        Without a change, with this change and all before it, or with this one only; or with all up
        to this one on the true surface instead of a tracked one, which is what a perfect tracker
        would leave.
    changes : dict
        Options that differ from the configured ones.
    """

    step: str
    kind: str
    changes: dict


def variants(steps: Mapping[str, Mapping]) -> list[Variant]:
    """Variants that show what each step changes, in the order of the steps.

    Parameters
    ----------
    steps : mapping
        Changed options by step.

    Returns
    -------
    list of Variant
        The configured one, then with one step more each, with each step alone, and with one step
        more each on the true surface, where a step that just changes the tracker has no place.

    Raises
    ------
    ValueError
        If there is no step.
    """
    if not steps:
        raise ValueError("steps: expected at least one, found none")
    added, together = [], {}
    for name, changes in steps.items():
        together = together | dict(changes)
        added.append(Variant(name, ADDED, together))
    alone = [Variant(name, ALONE, dict(changes)) for name, changes in steps.items()]
    first = Variant(FIRST, FIRST, {})
    true = [
        Variant(variant.step, TRUE, {k: v for k, v in variant.changes.items() if k != "tracker"})
        for variant in (first, *added)
        if set(steps.get(variant.step, {})) != {"tracker"}
    ]
    return [first, *added, *alone, *true]


def true_surface(tracked: Tracked, truth: Mapping) -> Tracked:
    """The true surface in the place of a tracked one, at the pose that the pipeline found.

    Parameters
    ----------
    tracked : Tracked
        With f frames.
    truth : mapping
        Arrays of the lab's truth.npz: ``surface_m`` (f, n, 3) [m] in the object's frame and
        ``surface_faces``.

    Raises
    ------
    ValueError
        If the truth has other frames than the tracked surface.
    """
    surface_m, frames = np.asarray(truth["surface_m"], dtype=float), len(tracked.vertices_m)
    if len(surface_m) != frames:
        raise ValueError(f"surface_m: expected {frames} frames, found {len(surface_m)}")
    pose = tracked.camera_from_object
    vertices_m = surface_m @ pose[:3, :3].T + pose[:3, 3]
    return replace(
        tracked,
        template_m=surface_m[0],
        faces=np.asarray(truth["surface_faces"]),
        rest_m=vertices_m[0],
        vertices_m=vertices_m,
        observed=np.ones(vertices_m.shape[:2], dtype=bool),
        prior="",
    )
