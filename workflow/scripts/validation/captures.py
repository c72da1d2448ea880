"""Every stage of the pipeline against the virtual lab's truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.tables import read_table
from palpate.json_fields import read_all, read_by_folder, read_json
from palpate.npz import read_npz
from palpate.report import outputs
from palpate.report.tables import significant
from palpate.surface.tracked import Tracked, load_tracked
from palpate.units import MILLIMETRES, MILLISECONDS, PERCENT
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks
from palpate.vision.pose import study_filter
from palpate.vision.probe import AXIS, RAW_TIP, TIP
from validation.measured import quantity, rms
from validation.tracking import dent_of, from_surface, tracked_errors

TITLE = "Accuracy of every stage against the virtual lab's truth"
DIGITS = 5
KEYS = ("object", "sensor", "capture")
# The two poses that a plane allows lie farther apart than this.
FLIPPED_DEG = 15.0
POSES = {"tip_m": TIP, "raw_tip_m": RAW_TIP, "axis": AXIS}


def make_pipeline_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each tracked capture, quantity by quantity."""
    materials, rows = read_by_folder(inputs.materials), []
    for capture, path in zip(params.captures, inputs.truths, strict=True):
        known = {key: capture[key] for key in KEYS}
        found, material = results_of(capture, params), materials[capture["object"]]
        for row in capture_accuracy(read_npz(path), material, found):
            rows.append(known | row | {"provenance": capture["provenance"]})
    table = pd.DataFrame(rows)
    for name in ("value", "truth"):
        table[name] = significant(table[name], DIGITS)
    return outputs.table(table, title=TITLE)


def results_of(capture: Mapping, params: Any) -> dict:
    """What the pipeline found for one capture."""
    folder = Path(params.results).joinpath(*(capture[key] for key in KEYS))
    poses = read_table(folder / "probe_pose.csv")
    minima = [folder / f"minimise-{error}.json" for error in params.errors]
    return {
        **{name: poses[at].to_numpy(float) for name, at in POSES.items()},
        "clock": read_json(folder / "clock.json"),
        "force_n": read_table(folder / "force.csv")[FORCE].to_numpy(float),
        "mask": np.stack(list(load_masks(folder / "mask.npz"))),
        "clouds": read_clouds(folder / "clouds.npz"),
        "tracked": load_tracked(folder / f"tracked-{params.tracker}.npz"),
        "hertz": read_json(folder / "hertz.json"),
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
        (clock.json), ``mask`` (f, h, w) bool, ``clouds`` (sequence of Cloud), ``tracked``
        (Tracked), ``hertz`` (hertz.json) and ``minima`` (minimise-<error>.json by error option).

    Returns
    -------
    list of dict
        ``quantity, value, unit, truth``.
    """
    frame = results["hertz"]["range"]["last_frame"]
    return [
        *_tip(truth, results),
        *_force(truth, results),
        *_clock(truth, results["clock"]),
        *_mask(truth, results["mask"]),
        *_cloud(truth, results["clouds"][frame].points_m, frame),
        *_surface(truth, results["tracked"], frame),
        *_moduli(material, results),
    ]


def _tip(truth: Mapping, results: Mapping) -> list[dict]:
    """Tip as measured, as filtered for the results, and as the study's filter gives it."""
    raw, angle = results["raw_tip_m"], _angle_deg((results["axis"] * truth["axis"]).sum(axis=1))
    paths = {"raw_tip": raw, "tip": results["tip_m"], "study_filter_tip": study_filter(raw)}
    return [
        *(
            quantity(f"{name}_position_rms", rms(path - truth["tip_m"]) * MILLIMETRES, "mm")
            for name, path in paths.items()
        ),
        quantity("axis_direction_max", angle.max(), "degree"),
        quantity("flipped_frames", (angle > FLIPPED_DEG).sum()),
    ]


def _force(truth: Mapping, results: Mapping) -> list[dict]:
    found, true = results["force_n"], truth["force_n"]
    size, true_size = np.linalg.norm(found, axis=1), np.linalg.norm(true, axis=1)
    peak, off = true_size.max(), rms(size - true_size)
    pressed = true_size > 0.5 * peak
    cosine = (found * true).sum(axis=1)[pressed] / (size * true_size)[pressed]
    return [
        quantity("force_rms", rms(found - true), "N"),
        quantity("force_magnitude_rms", off, "N"),
        quantity("force_direction_mean", _angle_deg(cosine).mean(), "degree"),
        quantity("force_magnitude_rms_of_peak", PERCENT * off / peak, "%"),
        quantity("force_peak", size.max(), "N", float(peak)),
    ]


def _angle_deg(cosine: NDArray) -> NDArray:
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def _clock(truth: Mapping, clock: Mapping) -> list[dict]:
    """Offset of the force's clock as estimated and applied, and its stated deviation."""
    poses_s = float(truth.get("pose_clock_offset_s", 0.0))
    true = (float(truth["clock_offset_s"]) - poses_s) * MILLISECONDS
    return [
        quantity("clock_offset", clock["offset_s"] * MILLISECONDS, "ms", true),
        quantity("clock_offset_stated_std", clock["std_s"] * MILLISECONDS, "ms"),
    ]


def _mask(truth: Mapping, mask: NDArray) -> list[dict]:
    width = int(truth["mask_shape"][-1])
    true = np.unpackbits(truth["mask"], axis=-1, count=width).astype(bool)
    shared = (mask & true).sum(axis=(1, 2)) / (mask | true).sum(axis=(1, 2))
    return [
        quantity("mask_intersection_over_union_mean", shared.mean()),
        quantity("mask_intersection_over_union_min", shared.min()),
    ]


def _cloud(truth: Mapping, points_m: NDArray, frame: int) -> list[dict]:
    distance = from_surface(truth, points_m, frame)
    return [
        quantity("cloud_median", np.median(distance) * MILLIMETRES, "mm"),
        quantity("cloud_rms", rms(distance) * MILLIMETRES, "mm"),
        quantity("cloud_points", len(points_m)),
    ]


def _surface(truth: Mapping, tracked: Tracked, frame: int) -> list[dict]:
    errors = dict(zip(("surface", "untracked"), tracked_errors(truth, tracked, frame), strict=True))
    dent = dent_of(tracked)
    parts = {"dent": dent, "elsewhere": ~dent, "observed": tracked.observed[frame]}
    return [
        quantity(f"{kind}_{name}_mean", error[part].mean() * MILLIMETRES, "mm")
        for name, part in (parts | {"all": np.ones_like(dent)}).items()
        for kind, error in errors.items()
    ]


def _moduli(material: Mapping, results: Mapping) -> list[dict]:
    star, hertz = material["reduced_modulus_pa"], results["hertz"]
    rows = [
        quantity(f"hertz_{name}_reduced_modulus", hertz[name]["reduced_modulus_pa"], "Pa", star)
        for name in ("study", "free_contact")
    ]
    for error, found in results["minima"].items():
        for name in ("youngs_modulus_pa", "poisson_ratio", "reduced_modulus_pa"):
            stem, unit = name.removesuffix("_pa"), "Pa" if name.endswith("_pa") else ""
            row = quantity(f"{error}_{stem}", found[name], unit, material[name])
            rows.append(row | {"at_bound": found["at_bound"]})
    return rows
