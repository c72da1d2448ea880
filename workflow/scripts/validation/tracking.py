"""How right tracked surfaces are, against the virtual lab's truth.

Four errors of each vertex stand side by side. Its *place* against that of its material point, and
its distance from the true *surface*, both in the camera's frame, carry the error of the rigid
alignment. Its *displacement* from the aligned undeformed surface, against the true displacement
there, does not. The moduli are estimated from the *change* since the first frame, from which what
the first frame is wrong by is taken off, and its noise is in.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints
from palpate.report.tables import SIMULATED_NOTE, significant, to_markdown
from palpate.surface.pose import to_camera, to_object
from palpate.surface.tracked import Tracked, load_tracked
from palpate.units import CUBIC_CENTIMETRES, MILLIMETRES
from palpate.workflow.job import naming

TITLE = "Trackers against the virtual lab's truth"
DIGITS = 4
DENT_RADIUS_M = 0.010
# Name of the rows of the rigidly aligned template, which no tracker moves.
UNTRACKED = "none"
KINDS = ("displacement", "change", "place", "surface")
REGIONS = ("all", "observed", "unobserved", "dent")
KEYS = ["object", "sensor", "point", "tracker", "capture"]
SHOWN = [
    "displacement_mean_all_mm",
    "displacement_mean_observed_mm",
    "displacement_mean_unobserved_mm",
    "displacement_mean_dent_mm",
    "change_mean_all_mm",
    "change_mean_dent_mm",
    "place_mean_all_mm",
    "surface_mean_all_mm",
    "surface_mean_dent_mm",
    "volume_change_of_true_percent",
    "seconds_per_frame",
]
NOTES = (
    "Mean errors over vertices in the most pressed frame [mm], averaged over the captures;"
    " tracking_accuracy.csv has every capture, root mean squares and means over all frames in"
    " contact (contact_...).",
    "displacement: from the rigidly aligned template, against the true displacement there; change:"
    " the same since the first frame, from which the moduli are estimated; place: of the material"
    " point in the camera's frame, with the alignment's error; surface: distance from the true"
    " surface there. dent: within 10 mm of the contact.",
    "An object that looks alike from several sides may be aligned with a turn (the ball about the"
    " vertical): its place errors then tell that turn.",
    f"Tracker {UNTRACKED}: the rigidly aligned template; its displacement error is the true"
    " displacement. Observed are, in all rows of a capture, the first compared tracker's vertices.",
    "The trackers' options were chosen on captures of this lab, some of them among these. The"
    " elastic tracker takes off what sensor and template are wrong by at rest, the study's does"
    " not; its prior (neo-Hookean, Poisson's ratio 0.3) is the lab's law and the block's ratio.",
    "volume_change_of_true: change of volume in percent of the true surface's, 100 is right."
    " seconds_per_frame: of the whole job, reading and writing included; it alone differs from"
    " run to run.",
)


def make_tracking_accuracy(inputs: Any, params: Any) -> dict:
    """Every capture, and means over the captures."""
    files = iter(zip(inputs.tracked, inputs.seconds, strict=True))
    rows = []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        known = {key: capture[key] for key in KEYS if key in capture}
        last = {"provenance": capture["provenance"]}
        found = capture_rows(truth, {name: next(files) for name in params.trackers})
        rows += [known | row | last for row in found]
    table = pd.DataFrame(rows)
    table = _rounded(table[KEYS + [name for name in table.columns if name not in KEYS]])
    notes = [f"- {note}" for note in (*NOTES, SIMULATED_NOTE)]
    return {"csv": table, "md": to_markdown(_rounded(averages(table)), title=TITLE, notes=notes)}


def capture_rows(truth: str, files: Mapping[str, tuple[str, str]]) -> list[dict]:
    """Rows of a capture: without tracking, then of each tracker."""
    with np.load(truth, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files if name != "mask"}
    tracked = {name: load_tracked(path) for name, (path, _) in files.items()}
    first = next(iter(tracked.values()))
    rows = []
    for name, surface in ({UNTRACKED: untracked(first)} | tracked).items():
        if surface.observed.shape == first.observed.shape:
            surface = replace(surface, observed=first.observed)
        with naming(truth):
            row = {"tracker": name} | accuracy_row(arrays, surface)
        spent = pd.read_csv(files[name][1], sep="\t")["s"].mean() if name in files else np.nan
        rows.append(row | {"seconds_per_frame": float(spent) / len(surface.vertices_m)})
    return rows


def tracked_errors(truth: Mapping, tracked: Tracked, frame: int) -> tuple[NDArray, NDArray]:
    """Distance of each tracked vertex from its true place, and of the undeformed one, (n,) [m]."""
    true = _true_places(truth, tracked.template_m, [frame])[0]
    rest = to_camera(truth["camera_from_object"], tracked.template_m)
    found = np.linalg.norm(tracked.vertices_m[frame] - true, axis=1)
    return found, np.linalg.norm(rest - true, axis=1)


def vertex_errors(truth: Mapping, tracked: Tracked) -> dict[str, NDArray]:
    """Errors of all vertices in all frames, by the names of `KINDS`, (f, n) arrays [m].

    Parameters
    ----------
    truth : mapping
        ``camera_from_object``, ``surface_rest_m``, ``surface_faces`` and ``surface_m`` of
        truth.npz.
    tracked : Tracked

    Raises
    ------
    ValueError
        If the truth has another number of frames.
    """
    frames = range(len(tracked.vertices_m))
    if len(truth["surface_m"]) != len(frames):
        found = len(truth["surface_m"])
        raise ValueError(f"surface_m: expected {len(frames)} frames as tracked, found {found}")
    place = tracked.vertices_m - _true_places(truth, tracked.template_m, frames)
    moved = tracked.vertices_m - tracked.rest_m - _true_displacements(truth, tracked.rest_m, frames)
    away = [_from_surface(truth, tracked.vertices_m[k], k) for k in frames]
    lengths = (np.linalg.norm(part, axis=2) for part in (moved, moved - moved[0], place))
    return dict(zip(KINDS, (*lengths, np.stack(away)), strict=True))


def untracked(tracked: Tracked) -> Tracked:
    """Put the rigidly aligned template into every frame, observed as it was."""
    still = np.broadcast_to(tracked.rest_m, tracked.vertices_m.shape)
    return replace(tracked, vertices_m=still)


def volume_changes(truth: Mapping, tracked: Tracked) -> tuple[NDArray, NDArray]:
    """Changes of the enclosed volume as tracked and in truth, both (f,) [m^3]."""
    rest, faces = truth["surface_rest_m"].astype(float), truth["surface_faces"]
    found = [_volume(place, tracked.faces) for place in tracked.vertices_m]
    true = [_volume(place.astype(float), faces) for place in truth["surface_m"]]
    before = _volume(tracked.rest_m, tracked.faces)
    return np.array(found) - before, np.array(true) - _volume(rest, faces)


def accuracy_row(truth: Mapping, tracked: Tracked) -> dict:
    """Figures of a tracked capture: in its most pressed frame, and over all frames in contact.

    Parameters
    ----------
    truth : mapping
        As in `vertex_errors`, and ``depth_m`` (f,): depth of the sphere, negative before contact.
    tracked : Tracked

    Returns
    -------
    dict
        ``frame`` (the deepest one), ``vertices``, mean and root mean square of the errors in each
        region [mm] and the changes of volume; over all frames in contact under ``contact_...``.
    """
    depth = np.asarray(truth["depth_m"])
    if not (depth > 0).any():
        raise ValueError("depth_m: expected a frame in contact, found none")
    errors, volumes = vertex_errors(truth, tracked), volume_changes(truth, tracked)
    row = {"frame": int(np.argmax(depth)), "vertices": len(tracked.template_m)}
    for prefix, frames in (("", [row["frame"]]), ("contact_", np.flatnonzero(depth > 0))):
        found = _figures(errors, tracked, frames)
        found |= _volume_figures(*(change[frames].mean() for change in volumes))
        row |= {prefix + name: value for name, value in found.items()}
    return row


def averages(table: pd.DataFrame) -> pd.DataFrame:
    """Means over the captures of each object, sensor and tracker in the most pressed frame."""
    groups = table.groupby(["object", "sensor", "tracker"], sort=False)
    means = groups[SHOWN].mean()
    means.insert(0, "captures", groups.size())
    provenance = groups["provenance"].first()
    return means.assign(provenance=provenance).reset_index()


def _true_places(truth: Mapping, template_m: NDArray, frames) -> NDArray:
    """True places of the template's material points, camera frame, (f, n, 3) [m]."""
    closest = ClosestPoints(truth["surface_rest_m"], truth["surface_faces"])
    _, triangle, weights = closest(template_m)
    pose, surface = truth["camera_from_object"], truth["surface_m"]
    return np.stack(
        [
            to_camera(pose, closest.interpolate(surface[k].astype(float), triangle, weights))
            for k in frames
        ]
    )


def _true_displacements(truth: Mapping, rest_m: NDArray, frames) -> NDArray:
    """True displacements where the aligned template lies, camera frame, (f, n, 3) [m]."""
    pose, rest = truth["camera_from_object"], truth["surface_rest_m"]
    closest = ClosestPoints(rest, truth["surface_faces"])
    _, triangle, weights = closest(to_object(pose, rest_m))
    turn = pose[:3, :3].T
    return np.stack(
        [
            closest.interpolate(truth["surface_m"][k] - rest, triangle, weights) @ turn
            for k in frames
        ]
    )


def _from_surface(truth: Mapping, vertices_m: NDArray, frame: int) -> NDArray:
    """Distances of vertices, camera frame, from the true surface in a frame, (n,) [m]."""
    closest = ClosestPoints(truth["surface_m"][frame], truth["surface_faces"])
    return closest.distance(to_object(truth["camera_from_object"], vertices_m))


def _volume(vertices: NDArray, faces: NDArray) -> float:
    # From the middle: the parts are then as large as the whole.
    a, b, c = (vertices - vertices.mean(axis=0))[faces].swapaxes(0, 1)
    return float((a * np.cross(b, c)).sum() / 6)


def _figures(errors: Mapping, tracked: Tracked, frames: NDArray) -> dict:
    """Mean and root mean square in each region; a frame counts as much as the other [mm]."""
    offset = np.linalg.norm(tracked.template_m - tracked.contact_point_m, axis=1)
    seen, dent = tracked.observed[frames], offset < DENT_RADIUS_M
    masks = (np.ones_like(seen), seen, ~seen, np.broadcast_to(dent, seen.shape))
    figures = {}
    for kind in KINDS:
        values = errors[kind][frames] * MILLIMETRES
        for region, mask in zip(REGIONS, masks, strict=True):
            figures[f"{kind}_mean_{region}_mm"] = _over(values, mask)
            figures[f"{kind}_rms_{region}_mm"] = _over(values**2, mask) ** 0.5
    return figures


def _over(values: NDArray, mask: NDArray) -> float:
    """Mean over frames of the mean over a region; frames where it is empty are left out."""
    counts = mask.sum(axis=1)
    kept = counts > 0
    if not kept.any():
        return float("nan")
    return float(((values * mask).sum(axis=1)[kept] / counts[kept]).mean())


def _volume_figures(found_m3: float, true_m3: float) -> dict:
    return {
        "volume_change_cm3": found_m3 * CUBIC_CENTIMETRES,
        "true_volume_change_cm3": true_m3 * CUBIC_CENTIMETRES,
        "volume_change_of_true_percent": 100 * found_m3 / true_m3,
    }


def _rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Figures to the digits that mean something."""
    measured = table.select_dtypes("number").columns.difference(["frame", "vertices", "captures"])
    whole = {name: np.array(significant(table[name], DIGITS), dtype=float) for name in measured}
    return table.assign(**whole)
