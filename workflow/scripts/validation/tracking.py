"""How right tracked surfaces are, against the virtual lab's truth.

Four errors of each vertex stand side by side. Its *place* against that of its material point, and
its distance from the true *surface*, both in the camera's frame, carry the error of the rigid
alignment. Its *displacement* from the aligned undeformed surface, against the true displacement
there, does not. The moduli are estimated from the *change* since the first frame, from which what
the first frame is wrong by is taken off, and its noise is in.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
from numpy.typing import NDArray
from palpate.npz import read_npz
from palpate.open3d_core import ClosestPoints
from palpate.report import style
from palpate.report.panels import named, volume
from palpate.report.tables import SIMULATED_NOTE, significant, to_markdown
from palpate.surface.pose import to_camera, to_object
from palpate.surface.tracked import Tracked, load_tracked
from palpate.units import CUBIC_CENTIMETRES, MILLIMETRES, PERCENT
from palpate.workflow.job import naming

TITLE = "Trackers against the virtual lab's truth"
DIGITS = 4
DENT_RADIUS_M = 0.010
# Name of the rows of the rigidly aligned template, which no tracker moves.
UNTRACKED = "none"
KINDS = ("displacement", "change", "place", "surface")
REGIONS = ("all", "observed", "unobserved", "dent")
KEYS = ["object", "sensor", "point", "tracker", "capture"]
SHOWN = [f"displacement_mean_{region}_mm" for region in REGIONS]
SHOWN += ["change_mean_all_mm", "change_mean_dent_mm", "place_mean_all_mm", "surface_mean_all_mm"]
SHOWN += ["surface_mean_dent_mm", "volume_change_of_true_percent", "seconds_per_frame"]
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
# Of the figure: columns, colours of trackers, and how far dots and medians reach aside.
DRAWN = {
    "displacement_mean_dent_mm": "Error in the dent (mm)",
    "displacement_mean_all_mm": "Error over all (mm)",
}
COLOURS = (style.GREY, style.BLUE, style.ORANGE, style.GREEN)
SPREAD, MEDIAN_HALF_WIDTH = 0.32, 0.4
FIGURE_NOTE = (
    "mean error of displacement in the most pressed frame, by tracker; dot: capture, line: median"
)


def make_tracking_accuracy(inputs: Any, params: Any) -> dict:
    """Every capture, and means over the captures."""
    files, rows = iter(zip(inputs.tracked, inputs.seconds, strict=True)), []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        known = {key: capture[key] for key in KEYS if key in capture}
        last = {"provenance": capture["provenance"]}
        found = capture_rows(truth, {name: next(files) for name in params.trackers})
        rows += [known | row | last for row in found]
    table = pd.DataFrame(rows)
    table = _rounded(table[KEYS + [name for name in table.columns if name not in KEYS]])
    notes = [f"- {note}" for note in (*NOTES, SIMULATED_NOTE)]
    return {"csv": table, "md": to_markdown(_rounded(averages(table)), title=TITLE, notes=notes)}


def capture_rows(truth: str, files: Mapping[str, tuple[str, str]]) -> Iterator[dict]:
    """Rows of a capture: without tracking, then of each tracker."""
    arrays = read_npz(truth)
    tracked = {name: load_tracked(path) for name, (path, _) in files.items()}
    first = next(iter(tracked.values()))
    for name, surface in ({UNTRACKED: untracked(first)} | tracked).items():
        if surface.observed.shape == first.observed.shape:
            surface = replace(surface, observed=first.observed)
        with naming(truth):
            row = {"tracker": name} | accuracy_row(arrays, surface)
        spent = pd.read_csv(files[name][1], sep="\t")["s"].mean() if name in files else np.nan
        yield row | {"seconds_per_frame": float(spent) / len(surface.vertices_m)}


def tracked_errors(truth: Mapping, tracked: Tracked, frame: int) -> tuple[NDArray, NDArray]:
    """Distance of each tracked vertex from its true place, and of the undeformed one, (n,) [m]."""
    pose, template_m = truth["camera_from_object"], tracked.template_m
    true = to_camera(pose, _at(truth, template_m, truth["surface_m"][[frame]])[0])
    found = np.linalg.norm(tracked.vertices_m[frame] - true, axis=1)
    return found, np.linalg.norm(to_camera(pose, template_m) - true, axis=1)


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
    surfaces, found = truth["surface_m"], tracked.vertices_m
    if len(surfaces) != len(found):
        expected = f"{len(found)} frames as tracked"
        raise ValueError(f"surface_m: expected {expected}, found {len(surfaces)}")
    pose, rest_m = truth["camera_from_object"], tracked.rest_m
    ways = (surface - truth["surface_rest_m"] for surface in surfaces)
    place = found - to_camera(pose, _at(truth, tracked.template_m, surfaces))
    moved = found - rest_m - _at(truth, to_object(pose, rest_m), ways) @ pose[:3, :3].T
    lengths = (np.linalg.norm(part, axis=2) for part in (moved, moved - moved[0], place))
    away = np.stack([from_surface(truth, vertices, k) for k, vertices in enumerate(found)])
    return dict(zip(KINDS, (*lengths, away), strict=True))


def from_surface(truth: Mapping, points_m: NDArray, frame: int) -> NDArray:
    """Distances of points, camera frame, from the true surface in a frame, (n,) [m]."""
    closest = ClosestPoints(truth["surface_m"][frame], truth["surface_faces"])
    return closest.distance(to_object(truth["camera_from_object"], points_m))


def dent_of(tracked: Tracked) -> NDArray:
    """Vertices near the contact, (n,) bool."""
    offset = tracked.template_m - tracked.contact_point_m
    return np.linalg.norm(offset, axis=1) < DENT_RADIUS_M


def untracked(tracked: Tracked) -> Tracked:
    """Put the rigidly aligned template into every frame, observed as it was."""
    still = np.broadcast_to(tracked.rest_m, tracked.vertices_m.shape)
    return replace(tracked, vertices_m=still)


def volume_changes(truth: Mapping, tracked: Tracked) -> tuple[NDArray, NDArray]:
    """Changes of the enclosed volume as tracked and in truth, both (f,) [m^3]."""
    found, true = (
        np.array([volume(place.astype(float), faces) for place in places]) - volume(rest, faces)
        for places, rest, faces in (
            (tracked.vertices_m, tracked.rest_m, tracked.faces),
            (truth["surface_m"], truth["surface_rest_m"].astype(float), truth["surface_faces"]),
        )
    )
    return found, true


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
        figures = _figures(errors, tracked, frames)
        found, true = (change[frames].mean() for change in volumes)
        figures["volume_change_cm3"] = found * CUBIC_CENTIMETRES
        figures["true_volume_change_cm3"] = true * CUBIC_CENTIMETRES
        figures["volume_change_of_true_percent"] = PERCENT * found / true
        row |= {prefix + name: value for name, value in figures.items()}
    return row


def averages(table: pd.DataFrame) -> pd.DataFrame:
    """Means over the captures of each object, sensor and tracker in the most pressed frame."""
    wanted = {"captures": ("provenance", "size")} | {name: (name, "mean") for name in SHOWN}
    wanted["provenance"] = ("provenance", "first")
    return table.groupby(["object", "sensor", "tracker"], sort=False).agg(**wanted).reset_index()


def _at(truth: Mapping, points_m: NDArray, fields: Iterable[NDArray]) -> NDArray:
    """Vectors of the true surface's vertices, at points on it while undeformed, (f, n, 3)."""
    closest = ClosestPoints(truth["surface_rest_m"], truth["surface_faces"])
    _, *where = closest(points_m)
    return np.stack([closest.interpolate(field, *where) for field in fields])


def _figures(errors: Mapping, tracked: Tracked, frames: NDArray) -> dict:
    """Mean and root mean square in each region; a frame counts as much as the other [mm]."""
    seen = tracked.observed[frames]
    masks = (np.ones_like(seen), seen, ~seen, np.broadcast_to(dent_of(tracked), seen.shape))
    figures = {}
    for kind in KINDS:
        values = errors[kind][frames] * MILLIMETRES
        for region, mask in zip(REGIONS, masks, strict=True):
            figures[f"{kind}_mean_{region}_mm"] = _over(values, mask)
            figures[f"{kind}_rms_{region}_mm"] = _over(values**2, mask) ** 0.5
    return figures


def _over(values: NDArray, mask: NDArray) -> float:
    """Mean over frames of the mean over a region; frames where it is empty are left out."""
    means = np.ma.array(values, mask=~mask).mean(axis=1)
    return float(np.ma.filled(means.mean(), np.nan))


def _rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Figures to the digits that mean something."""
    measured = table.select_dtypes("number").columns.difference(["frame", "vertices", "captures"])
    whole = {name: np.array(significant(table[name], DIGITS), dtype=float) for name in measured}
    return table.assign(**whole)


def make_tracking_accuracy_figure(inputs: Any, params: Any) -> Figure:
    """Mean error of the displacement in the most pressed frame, by object, sensor and tracker.

    Raises
    ------
    ValueError
        If the table holds no capture.
    """
    table = pd.read_csv(inputs.table, dtype={"capture": str, "point": str})
    if table.empty:
        raise ValueError("table: expected captures, found none")
    groups = list(table.groupby(["object", "sensor"], sort=False))
    shape = {"figsize": (style.PAGE_IN, 4.2), "sharey": "row", "sharex": True, "squeeze": False}
    figure, axes = plt.subplots(2, len(groups), **shape)
    letters = iter("abcdefghijklmnopqrstuvwxyz")
    for k, (row, (column, label)) in enumerate(zip(axes, DRAWN.items(), strict=True)):
        for panel, ((name, sensor), group) in zip(row, groups, strict=True):
            _dots(panel, group, column)
            title = f"{name.replace('foam_', '').capitalize()}, {style.sensor_name(sensor)}"
            named(panel, next(letters), title if k == 0 else "")
        row[0].set(ylabel=label, yscale="log")
        row[0].yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        row[0].yaxis.set_major_formatter(ScalarFormatter())
        row[0].yaxis.set_minor_formatter(NullFormatter())
    figure.align_ylabels(axes[:, 0])
    figure.tight_layout(rect=(0, 0.05, 1, 0.98))
    figure.text(0.02, 0.012, FIGURE_NOTE, fontsize=6.5)
    style.label_provenance(figure, set(table["provenance"]))
    return figure


def _dots(panel: Axes, group: pd.DataFrame, column: str) -> None:
    """Errors of each tracker beside each other by rank, which keeps dots apart without chance."""
    names = list(dict.fromkeys(group["tracker"]))
    for k, (name, colour) in enumerate(zip(names, COLOURS, strict=False)):
        values = np.sort(group.loc[group["tracker"] == name, column].dropna().to_numpy(float))
        if not len(values):
            continue
        aside = np.linspace(-SPREAD, SPREAD, len(values)) if len(values) > 1 else np.zeros(1)
        panel.plot(k + aside, values, "o", ms=3.2, mew=0, color=colour, alpha=0.85)
        ends = [k - MEDIAN_HALF_WIDTH, k + MEDIAN_HALF_WIDTH]
        panel.plot(ends, [np.median(values)] * 2, color=style.BLACK, lw=1.1, zorder=3)
    panel.set_xticks(range(len(names)), names, rotation=30)
    panel.set_xlim(-0.6, len(names) - 0.4)
    panel.grid(axis="y", lw=0.4, color="0.9")
    panel.set_axisbelow(True)
