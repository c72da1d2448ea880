"""Recordings about the sensors as they are read, against the virtual lab's truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.json_fields import read_one
from palpate.npz import read_npz
from palpate.report import outputs
from palpate.report.tables import significant
from palpate.surface.pose import to_camera
from palpate.units import MILLIMETRES, MILLISECONDS, PERCENT
from palpate.vision.camera import OPTICS
from palpate.vision.pose import CORNERS, REFINED, select_threshold
from scipy.spatial.transform import Rotation
from validation.measured import rms

TITLE = "Accuracy of the recordings about the sensors against the virtual lab's truth"
DIGITS = 4
# The project's own targets: rectified pairs see finer than a 640-pixel picture [mm].
TIP_TARGET_MM = {"stereo": 0.5, "structured_light": 1.0, "depth": 1.0}


def make_sensor_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each sensor's experiments."""
    rows, files = [], zip(params.names, params.experiments, inputs.truths, strict=True)
    for name, experiment, path in files:
        folder = Path(params.results, "sensors", name)
        found = READERS[experiment](folder, read_npz(path), params.sensors[name])
        rows += [{"sensor": name} | row | {"provenance": "simulated"} for row in found]
    table = pd.DataFrame(rows)
    table["value"] = significant(table["value"], DIGITS)
    return outputs.table(table, title=TITLE)


def _calibration(folder: Path, _: Mapping, sensor: Mapping) -> list[dict]:
    """Optics and transform against the sensor's file, from which the lab makes its pictures."""
    calibration, rows = read_one(folder / "calibration.json"), []
    for stream, block in (("color", "color"), ("infrared", "depth")):
        found, true = calibration["cameras"][stream], sensor[block]
        for name in OPTICS:
            error = PERCENT * (found[name] / true[name] - 1)
            rows.append(_error(f"calibration_{stream}_{name}_error", error, "%", 0.2))
    rest = np.array(sensor["depth"]["color_from_depth"])
    apart = np.linalg.inv(rest) @ np.array(calibration["color_from_infrared"])
    return [
        *rows,
        _error("equation_4_12_rotation_error", _angle_deg(apart), "degree", 0.1),
        _error("equation_4_12_translation_error", _shift_mm(apart), "mm", 1.0),
    ]


def _workspace(folder: Path, truth: Mapping, sensor: Mapping) -> list[dict]:
    table = pd.read_csv(folder / "workspace.csv")
    return workspace_rows(table, truth["tip_m"], target_mm=TIP_TARGET_MM[sensor["kind"]])


def workspace_rows(table: pd.DataFrame, tips_m: NDArray, *, target_mm: float) -> list[dict]:
    """Error of the tip over the workspace (workspace.csv), as the study finds it and refined.

    True tips (points, 3) are in the camera's frame [m]; the target is the largest root mean square
    that the project allows itself [mm].
    """
    refined, rows = table[table["method"] == REFINED], []
    parts = ("study", at_selected_threshold(table), None), ("refined", refined, target_mm)
    for name, part, target in parts:
        means = part[["mean_x_m", "mean_y_m", "mean_z_m"]].to_numpy(float)
        bias = np.linalg.norm(means - tips_m[part["point"].astype(int) - 1], axis=1)
        square = bias**2 + (part[["std_x_m", "std_y_m", "std_z_m"]] ** 2).sum(axis=1)
        mean = np.sqrt(np.average(square, weights=part["found"]))
        frames, found = part[["frames", "found"]].sum()
        # A pose flipped to the other planar solution would show here.
        worst = (bias + part["farthest_m"].to_numpy(float)).max()
        rows += [
            _error(f"workspace_{name}_tip_rms", mean * MILLIMETRES, "mm", target),
            _error(f"workspace_{name}_tip_worst_point", bias.max() * MILLIMETRES, "mm"),
            _error(f"workspace_{name}_lost_frames", frames - found, ""),
            _error(f"workspace_{name}_frames", frames, ""),
            _error(f"workspace_{name}_worst_frame_at_most", worst * MILLIMETRES, "mm"),
        ]
    return rows


def at_selected_threshold(table: pd.DataFrame) -> pd.DataFrame:
    """The workspace's points (workspace.csv) as the study tracks them."""
    selected = select_threshold(table)
    return table[(table["method"] == CORNERS) & (table["threshold_px"] == selected)]


def _cd_case(folder: Path, truth: Mapping, _: Mapping) -> list[dict]:
    """Place of the case, and the tip's way around it."""
    path = pd.read_csv(folder / "cd_case_path.csv")
    found = np.array(read_one(folder / "cd_case.json")["camera_from_case"])
    apart = np.linalg.inv(truth["camera_from_object"]) @ found
    # Half a turn maps a case onto itself.
    turn = min(_angle_deg(apart), _angle_deg(apart @ np.diag([-1.0, -1.0, 1.0, 1.0])))
    way = path[["smooth_x_m", "smooth_y_m", "smooth_z_m"]].to_numpy(float)
    off = rms(to_camera(found, way) - truth["tip_m"])
    return [
        _error("cd_case_place_error", _shift_mm(apart), "mm"),
        _error("cd_case_turn_error", turn, "degree"),
        _error("cd_case_tip_rms", off * MILLIMETRES, "mm"),
    ]


def _loading(folder: Path, truth: Mapping, _: Mapping) -> list[dict]:
    """Force at the frames and the clocks' offset of the loading test."""
    table, force = pd.read_csv(folder / "loading.csv"), np.linalg.norm(truth["force_n"], axis=1)
    error = rms(table["force_n"] - force) / force.max() * PERCENT
    offset_s, std_s = table.loc[0, ["clock_offset_s", "clock_offset_std_s"]]
    offset_s -= float(truth["clock_offset_s"])
    return [
        _error("loading_force_rms_of_peak", error, "%", 1.0),
        _error("loading_clock_offset_error", offset_s * MILLISECONDS, "ms", 3.0),
        _error("loading_clock_offset_stated_std", std_s * MILLISECONDS, "ms"),
    ]


def _angle_deg(transform: NDArray) -> float:
    return float(np.degrees(Rotation.from_matrix(transform[:3, :3]).magnitude()))


def _shift_mm(transform: NDArray) -> float:
    return float(np.linalg.norm(transform[:3, 3]) * MILLIMETRES)


def _error(name: str, value: float, unit: str, target: float | None = None) -> dict:
    """One row, whose truth is 0; the target is what the project allows itself."""
    return {"quantity": name, "value": float(value), "unit": unit, "target": target}


READERS = {
    "calibration": _calibration,
    "workspace": _workspace,
    "cd_case": _cd_case,
    "loading": _loading,
}
