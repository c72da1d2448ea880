"""Every stage of the pipeline against the virtual lab's truth."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.tables import read_table
from palpate.json_fields import read_all, read_by_folder, read_one
from palpate.open3d_core import ClosestPoints
from palpate.report import outputs
from palpate.report.tables import significant
from palpate.surface.tracked import load_tracked
from palpate.units import MILLIMETRES, MILLISECONDS
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks
from palpate.vision.kalman import study_filter
from palpate.vision.probe import AXIS, RAW_TIP, TIP
from validation.measured import quantity
from validation.tracking import DENT_RADIUS_M, tracked_errors

TITLE = "Accuracy of every stage against the virtual lab's truth"
DIGITS = 5
KEYS = ("object", "sensor", "capture")
# The two poses that a plane allows lie farther apart than this.
FLIPPED_DEG = 15.0


def make_pipeline_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each tracked capture, quantity by quantity."""
    materials, rows = read_by_folder(inputs.materials), []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        with np.load(truth, allow_pickle=False) as data:
            arrays = dict(data)
        known = {key: capture[key] for key in KEYS}
        found = results_of(capture, params)
        for row in capture_accuracy(arrays, materials[capture["object"]], found):
            rows.append(known | row | {"provenance": capture["provenance"]})
    table = pd.DataFrame(rows)
    for name in ("value", "truth"):
        table[name] = significant(table[name], DIGITS)
    return outputs.table(table, title=TITLE)


def results_of(capture: Mapping, params: Any) -> dict:
    """What the pipeline found for one capture."""
    folder = Path(params.results).joinpath(*(capture[key] for key in KEYS))
    poses = read_table(folder / "probe_pose.csv")
    minima = [str(folder / f"minimise-{error}.json") for error in params.errors]
    return {
        "tip_m": poses[TIP].to_numpy(float),
        "raw_tip_m": poses[RAW_TIP].to_numpy(float),
        "axis": poses[AXIS].to_numpy(float),
        "clock": read_one(str(folder / "clock.json")),
        "force_n": read_table(folder / "force.csv")[FORCE].to_numpy(float),
        "mask": np.stack(list(load_masks(folder / "mask.npz"))),
        "clouds": read_clouds(folder / "clouds.npz"),
        "tracked": load_tracked(folder / f"tracked-{params.tracker}.npz"),
        "hertz": read_one(str(folder / "hertz.json")),
        "minima": dict(zip(params.errors, read_all(minima), strict=True)),
    }


def capture_accuracy(truth: Mapping, material: Mapping, results: Mapping) -> list[dict]:
    """Compare one capture's results with the truth.

    Parameters
    ----------
    truth : mapping
        Arrays of truth.npz.
    material : mapping
        material.json.
    results : mapping
        ``tip_m`` and ``raw_tip_m`` (f, 3) [m], ``axis`` (f, 3), ``force_n`` (f, 3) [N], ``clock``
        (clock.json), ``mask`` (f, h, w) bool,
        ``clouds`` (sequence of Cloud), ``tracked`` (Tracked), ``hertz`` (hertz.json) and
        ``minima`` (minimise-<error>.json by error option).

    Returns
    -------
    list of dict
        ``quantity, value, unit, truth``.
    """
    frame = results["hertz"]["range"]["last_frame"]
    rows = _tip(truth, results) + _force(truth, results) + _clock(truth, results["clock"])
    rows += _mask(truth, results["mask"])
    rows += _cloud(truth, results["clouds"], frame)
    rows += _surface(truth, results["tracked"], frame)
    rows += _moduli(material, results)
    return rows


def _tip(truth: Mapping, results: Mapping) -> list[dict]:
    """Tip as measured, as filtered for the results, and as the study's filter gives it."""
    raw = results["raw_tip_m"]
    paths = {"raw_tip": raw, "tip": results["tip_m"], "study_filter_tip": study_filter(raw)}
    rows = [
        quantity(f"{name}_position_rms", _rms_length(path - truth["tip_m"]) * MILLIMETRES, "mm")
        for name, path in paths.items()
    ]
    cosine = np.clip((results["axis"] * truth["axis"]).sum(axis=1), -1, 1)
    angle = np.degrees(np.arccos(cosine))
    rows.append(quantity("axis_direction_max", float(angle.max()), "degree"))
    return [*rows, quantity("flipped_frames", float((angle > FLIPPED_DEG).sum()), "")]


def _force(truth: Mapping, results: Mapping) -> list[dict]:
    found, true = results["force_n"], truth["force_n"]
    size, true_size = np.linalg.norm(found, axis=1), np.linalg.norm(true, axis=1)
    pressed = true_size > 0.5 * true_size.max()
    cosine = (found * true).sum(axis=1)[pressed] / (size * true_size)[pressed]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return [
        quantity("force_rms", _rms_length(found - true), "N"),
        quantity("force_magnitude_rms", float(np.sqrt(np.mean((size - true_size) ** 2))), "N"),
        quantity("force_direction_mean", float(angle.mean()), "degree"),
        quantity("force_magnitude_rms_of_peak", _percent(size, true_size), "%"),
        quantity("force_peak", float(size.max()), "N", float(true_size.max())),
    ]


def _clock(truth: Mapping, clock: Mapping) -> list[dict]:
    """Offset of the force's clock as estimated and applied, and its stated deviation."""
    poses_s = float(truth["pose_clock_offset_s"]) if "pose_clock_offset_s" in truth else 0.0
    true = (float(truth["clock_offset_s"]) - poses_s) * MILLISECONDS
    return [
        quantity("clock_offset", clock["offset_s"] * MILLISECONDS, "ms", true),
        quantity("clock_offset_stated_std", clock["std_s"] * MILLISECONDS, "ms"),
    ]


def _percent(found: NDArray, true: NDArray) -> float:
    """Root mean square error in percent of the largest value."""
    return 100 * float(np.sqrt(np.mean((found - true) ** 2)) / true.max())


def _mask(truth: Mapping, mask: NDArray) -> list[dict]:
    width = int(truth["mask_shape"][-1])
    true = np.unpackbits(truth["mask"], axis=-1, count=width).astype(bool)
    shared = (mask & true).sum(axis=(1, 2)) / (mask | true).sum(axis=(1, 2))
    return [
        quantity("mask_intersection_over_union_mean", float(shared.mean()), ""),
        quantity("mask_intersection_over_union_min", float(shared.min()), ""),
    ]


def _cloud(truth: Mapping, clouds: Sequence, frame: int) -> list[dict]:
    pose = truth["camera_from_object"]
    points = (clouds[frame].points_m - pose[:3, 3]) @ pose[:3, :3]
    closest = ClosestPoints(truth["surface_m"][frame], truth["surface_faces"])
    distance = closest.distance(points)
    return [
        quantity("cloud_median", float(np.median(distance)) * MILLIMETRES, "mm"),
        quantity("cloud_rms", float(np.sqrt(np.mean(distance**2))) * MILLIMETRES, "mm"),
        quantity("cloud_points", float(len(points)), ""),
    ]


def _surface(truth: Mapping, tracked: object, frame: int) -> list[dict]:
    found, still = tracked_errors(truth, tracked, frame)
    offset = tracked.template_m - tracked.contact_point_m
    dent = np.linalg.norm(offset, axis=1) < DENT_RADIUS_M
    seen = tracked.observed[frame]
    parts = {"dent": dent, "elsewhere": ~dent, "observed": seen, "all": np.ones_like(dent)}
    rows = []
    for name, part in parts.items():
        rows.append(quantity(f"surface_{name}_mean", float(found[part].mean()) * MILLIMETRES, "mm"))
        rows.append(
            quantity(f"untracked_{name}_mean", float(still[part].mean()) * MILLIMETRES, "mm")
        )
    return rows


def _moduli(material: Mapping, results: Mapping) -> list[dict]:
    star, hertz = material["reduced_modulus_pa"], results["hertz"]
    rows = [
        quantity(f"hertz_{name}_reduced_modulus", hertz[name]["reduced_modulus_pa"], "Pa", star)
        for name in ("study", "free_contact")
    ]
    for error, found in results["minima"].items():
        bound = {"at_bound": found["at_bound"]}
        for name in ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa"):
            stem, unit = name.removesuffix("_pa"), "Pa" if name.endswith("_pa") else ""
            rows.append(quantity(f"{error}_{stem}", found[name], unit, material[name]) | bound)
    return rows


def _rms_length(vectors: NDArray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
