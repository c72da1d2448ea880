"""Recordings about the sensors as they are read, against the virtual lab's truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.json_fields import read_one
from palpate.report import outputs
from palpate.report.tables import significant
from palpate.units import MILLIMETRES, MILLISECONDS, PERCENT
from palpate.vision.camera import OPTICS
from palpate.vision.pose import CORNERS, REFINED, select_threshold
from scipy.spatial.transform import Rotation

TITLE = "Accuracy of the recordings about the sensors against the virtual lab's truth"
DIGITS = 4
# The project's own targets: rectified pairs see finer than a 640-pixel picture [mm].
TIP_TARGET_MM = {"stereo": 0.5, "structured_light": 1.0, "depth": 1.0}


def make_sensor_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each sensor's experiments."""
    rows, files = [], zip(params.names, params.experiments, inputs.truths, strict=True)
    for name, experiment, path in files:
        with np.load(path, allow_pickle=False) as data:
            truth = dict(data)
        found = READERS[experiment](
            Path(params.results, "sensors", name), truth, params.sensors[name]
        )
        rows += [{"sensor": name} | row | {"provenance": "simulated"} for row in found]
    table = pd.DataFrame(rows)
    table["value"] = significant(table["value"], DIGITS)
    return outputs.table(table, title=TITLE)


def calibration_rows(calibration: Mapping, sensor: Mapping) -> list[dict]:
    """Optics and transform against the sensor's file, from which the lab makes its pictures.

    Parameters
    ----------
    calibration : mapping
        calibration.json.
    sensor : mapping
        The sensor's file.
    """
    rows = []
    for stream, block in (("color", "color"), ("infrared", "depth")):
        found, true = calibration["cameras"][stream], sensor[block]
        for name in OPTICS:
            error = PERCENT * (found[name] / true[name] - 1)
            rows.append(_error(f"calibration_{stream}_{name}_error", error, "%", 0.2))
    rest = np.array(sensor["depth"]["color_from_depth"])
    apart = np.linalg.inv(rest) @ np.array(calibration["color_from_infrared"])
    shift = np.linalg.norm(apart[:3, 3]) * MILLIMETRES
    rows.append(_error("equation_4_12_rotation_error", _angle_deg(apart), "degree", 0.1))
    return [*rows, _error("equation_4_12_translation_error", shift, "mm", 1.0)]


def workspace_rows(table: pd.DataFrame, tips_m: NDArray, *, target_mm: float) -> list[dict]:
    """Error of the tip over the workspace, as the study finds it and refined.

    Parameters
    ----------
    table : DataFrame
        workspace.csv.
    tips_m : (points, 3) array
        True tip on each point, camera frame [m].
    target_mm : float
        Largest root mean square that the project allows itself [mm].
    """
    study = table[(table["method"] == CORNERS) & (table["threshold_px"] == select_threshold(table))]
    rows = []
    for name, part, target in (
        ("study", study, None),
        ("refined", table[table["method"] == REFINED], target_mm),
    ):
        bias, square = _errors(part, tips_m)
        rms = np.sqrt(np.average(square, weights=part["found"])) * MILLIMETRES
        rows.append(_error(f"workspace_{name}_tip_rms", rms, "mm", target))
        rows.append(_error(f"workspace_{name}_tip_worst_point", bias.max() * MILLIMETRES, "mm"))
        lost = part["frames"].sum() - part["found"].sum()
        rows.append(_error(f"workspace_{name}_lost_frames", lost, ""))
        rows.append(_error(f"workspace_{name}_frames", part["frames"].sum(), ""))
        # A pose flipped to the other planar solution would show here.
        worst = (bias + part["farthest_m"].to_numpy(float)).max() * MILLIMETRES
        rows.append(_error(f"workspace_{name}_worst_frame_at_most", worst, "mm"))
    return rows


def cd_case_rows(path: pd.DataFrame, place: Mapping, truth: Mapping) -> list[dict]:
    """Place of the case, and the tip's way around it.

    Parameters
    ----------
    path : DataFrame
        cd_case_path.csv.
    place : mapping
        cd_case.json.
    truth : mapping
        ``tip_m`` (frames, 3), ``camera_from_object`` (4, 4).
    """
    found = np.array(place["camera_from_case"])
    apart = np.linalg.inv(truth["camera_from_object"]) @ found
    # Half a turn maps a case onto itself.
    turn = min(_angle_deg(apart), _angle_deg(apart @ np.diag([-1.0, -1.0, 1.0, 1.0])))
    way = path[["smooth_x_m", "smooth_y_m", "smooth_z_m"]].to_numpy(float)
    tips = way @ found[:3, :3].T + found[:3, 3]
    rms = np.sqrt(((tips - truth["tip_m"]) ** 2).sum(axis=1).mean()) * MILLIMETRES
    shift = np.linalg.norm(apart[:3, 3]) * MILLIMETRES
    return [
        _error("cd_case_place_error", shift, "mm"),
        _error("cd_case_turn_error", turn, "degree"),
        _error("cd_case_tip_rms", rms, "mm"),
    ]


def loading_rows(table: pd.DataFrame, truth: Mapping) -> list[dict]:
    """Force at the frames and the clocks' offset of the loading test.

    Parameters
    ----------
    table : DataFrame
        loading.csv.
    truth : mapping
        ``force_n`` (frames, 3), ``clock_offset_s``.
    """
    force = np.linalg.norm(truth["force_n"], axis=1)
    error = np.sqrt(np.mean((table["force_n"] - force) ** 2)) / force.max() * PERCENT
    first = table.iloc[0]
    offset = (first["clock_offset_s"] - float(truth["clock_offset_s"])) * MILLISECONDS
    deviation = first["clock_offset_std_s"] * MILLISECONDS
    return [
        _error("loading_force_rms_of_peak", error, "%", 1.0),
        _error("loading_clock_offset_error", offset, "ms", 3.0),
        _error("loading_clock_offset_stated_std", deviation, "ms"),
    ]


def _errors(part: pd.DataFrame, tips_m: NDArray) -> tuple[NDArray, pd.Series]:
    """Bias of each point's mean tip [m], and mean square error of its frames [m^2]."""
    means = part[["mean_x_m", "mean_y_m", "mean_z_m"]].to_numpy(float)
    bias = np.linalg.norm(means - tips_m[part["point"].astype(int) - 1], axis=1)
    return bias, bias**2 + (part[["std_x_m", "std_y_m", "std_z_m"]] ** 2).sum(axis=1)


def _angle_deg(transform: NDArray) -> float:
    return float(np.degrees(Rotation.from_matrix(transform[:3, :3]).magnitude()))


def _error(name: str, value: float, unit: str, target: float | None = None) -> dict:
    """One row, whose truth is 0; the target is what the project allows itself."""
    return {"quantity": name, "value": float(value), "unit": unit, "target": target}


READERS = {
    "calibration": lambda folder, truth, sensor: calibration_rows(
        read_one(str(folder / "calibration.json")), sensor
    ),
    "workspace": lambda folder, truth, sensor: workspace_rows(
        pd.read_csv(folder / "workspace.csv"),
        truth["tip_m"],
        target_mm=TIP_TARGET_MM[sensor["kind"]],
    ),
    "cd_case": lambda folder, truth, sensor: cd_case_rows(
        pd.read_csv(folder / "cd_case_path.csv"), read_one(str(folder / "cd_case.json")), truth
    ),
    "loading": lambda folder, truth, sensor: loading_rows(
        pd.read_csv(folder / "loading.csv"), truth
    ),
}
