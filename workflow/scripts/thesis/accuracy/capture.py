"""How right a capture's results are, against the virtual lab's truth."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints
from palpate.units import MILLIMETRES, MILLISECONDS
from palpate.vision.kalman import study_filter

from thesis.accuracy.tracking import DENT_RADIUS_M, tracked_errors

# The two poses that a plane allows lie farther apart than this.
FLIPPED_DEG = 15.0


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
        _row(f"{name}_position_rms", _rms_length(path - truth["tip_m"]) * MILLIMETRES, "mm")
        for name, path in paths.items()
    ]
    cosine = np.clip((results["axis"] * truth["axis"]).sum(axis=1), -1, 1)
    angle = np.degrees(np.arccos(cosine))
    rows.append(_row("axis_direction_max", float(angle.max()), "degree"))
    return [*rows, _row("flipped_frames", float((angle > FLIPPED_DEG).sum()), "")]


def _force(truth: Mapping, results: Mapping) -> list[dict]:
    found, true = results["force_n"], truth["force_n"]
    size, true_size = np.linalg.norm(found, axis=1), np.linalg.norm(true, axis=1)
    pressed = true_size > 0.5 * true_size.max()
    cosine = (found * true).sum(axis=1)[pressed] / (size * true_size)[pressed]
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    return [
        _row("force_rms", _rms_length(found - true), "N"),
        _row("force_magnitude_rms", float(np.sqrt(np.mean((size - true_size) ** 2))), "N"),
        _row("force_direction_mean", float(angle.mean()), "degree"),
        _row("force_magnitude_rms_of_peak", _percent(size, true_size), "%"),
        _row("force_peak", float(size.max()), "N", float(true_size.max())),
    ]


def _clock(truth: Mapping, clock: Mapping) -> list[dict]:
    """Offset of the force's clock as estimated and applied, and its stated deviation."""
    true = float(truth["clock_offset_s"]) * MILLISECONDS
    return [
        _row("clock_offset", clock["offset_s"] * MILLISECONDS, "ms", true),
        _row("clock_offset_stated_std", clock["std_s"] * MILLISECONDS, "ms"),
    ]


def _percent(found: NDArray, true: NDArray) -> float:
    """Root mean square error in percent of the largest value."""
    return 100 * float(np.sqrt(np.mean((found - true) ** 2)) / true.max())


def _mask(truth: Mapping, mask: NDArray) -> list[dict]:
    width = int(truth["mask_shape"][-1])
    true = np.unpackbits(truth["mask"], axis=-1, count=width).astype(bool)
    shared = (mask & true).sum(axis=(1, 2)) / (mask | true).sum(axis=(1, 2))
    return [
        _row("mask_intersection_over_union_mean", float(shared.mean()), ""),
        _row("mask_intersection_over_union_min", float(shared.min()), ""),
    ]


def _cloud(truth: Mapping, clouds: Sequence, frame: int) -> list[dict]:
    pose = truth["camera_from_object"]
    points = (clouds[frame].points_m - pose[:3, 3]) @ pose[:3, :3]
    closest = ClosestPoints(truth["surface_m"][frame], truth["surface_faces"])
    distance = closest.distance(points)
    return [
        _row("cloud_median", float(np.median(distance)) * MILLIMETRES, "mm"),
        _row("cloud_rms", float(np.sqrt(np.mean(distance**2))) * MILLIMETRES, "mm"),
        _row("cloud_points", float(len(points)), ""),
    ]


def _surface(truth: Mapping, tracked: object, frame: int) -> list[dict]:
    found, still = tracked_errors(truth, tracked, frame)
    offset = tracked.template_m - tracked.contact_point_m
    dent = np.linalg.norm(offset, axis=1) < DENT_RADIUS_M
    seen = tracked.observed[frame]
    parts = {"dent": dent, "elsewhere": ~dent, "observed": seen, "all": np.ones_like(dent)}
    rows = []
    for name, part in parts.items():
        rows.append(_row(f"surface_{name}_mean", float(found[part].mean()) * MILLIMETRES, "mm"))
        rows.append(_row(f"untracked_{name}_mean", float(still[part].mean()) * MILLIMETRES, "mm"))
    return rows


def _moduli(material: Mapping, results: Mapping) -> list[dict]:
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    E_star = material["reduced_modulus_pa"]
    hertz = results["hertz"]
    rows = [
        _row(f"hertz_{name}_reduced_modulus", hertz[name]["reduced_modulus_pa"], "Pa", E_star)
        for name in ("study", "free_contact")
    ]
    for error, minimum in results["minima"].items():
        found = [
            _row(f"{error}_youngs_modulus", minimum["youngs_modulus_pa"], "Pa", E),
            _row(f"{error}_poisson_ratio", minimum["poisson_ratio"], "", nu),
            _row(f"{error}_reduced_modulus", minimum["reduced_modulus_pa"], "Pa", E_star),
        ]
        rows += [row | {"at_bound": minimum["at_bound"]} for row in found]
    return rows


def _row(quantity: str, value: float, unit: str, truth: float | None = None) -> dict:
    return {"quantity": quantity, "value": value, "unit": unit, "truth": truth}


def _rms_length(vectors: NDArray) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
