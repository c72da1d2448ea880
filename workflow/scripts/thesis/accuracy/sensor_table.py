"""Readings of the experiments about the sensors against the virtual lab's truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from palpate.json_fields import read_one
from palpate.report import outputs

from thesis.accuracy import sensors as accuracy

TITLE = "Accuracy of the recordings about the sensors against the virtual lab's truth"
SIGNIFICANT = 4
# The project's own targets: rectified pairs see finer than a 640-pixel picture [mm].
TIP_TARGET_MM = {"stereo": 0.5, "structured_light": 1.0, "depth": 1.0}


def make_sensor_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each sensor's experiments."""
    rows = []
    for name, experiment, truth in zip(
        params.names, params.experiments, inputs.truths, strict=True
    ):
        with np.load(truth, allow_pickle=False) as data:
            arrays = dict(data)
        folder = Path(params.results) / "sensors" / name
        found = READERS[experiment](folder, arrays, params.sensors[name])
        rows += [{"sensor": name} | row | {"provenance": "simulated"} for row in found]
    table = pd.DataFrame(rows)
    table["value"] = [float(f"{value:.{SIGNIFICANT}g}") for value in table["value"]]
    return outputs.table(table, title=TITLE)


def _calibration(folder: Path, truth: Mapping, sensor: Mapping) -> list[dict]:
    """Optics; the truth is the sensor's file."""
    return accuracy.calibration_rows(read_one(str(folder / "calibration.json")), sensor)


def _workspace(folder: Path, truth: Mapping, sensor: Mapping) -> list[dict]:
    """Resting tip."""
    target = TIP_TARGET_MM[sensor["kind"]]
    table = pd.read_csv(folder / "workspace.csv")
    return accuracy.workspace_rows(table, truth["tip_m"], target_mm=target)


def _cd_case(folder: Path, truth: Mapping, sensor: Mapping) -> list[dict]:
    """Tip around the case."""
    path = pd.read_csv(folder / "cd_case_path.csv")
    return accuracy.cd_case_rows(path, read_one(str(folder / "cd_case.json")), truth)


def _loading(folder: Path, truth: Mapping, sensor: Mapping) -> list[dict]:
    """Force and clocks."""
    return accuracy.loading_rows(pd.read_csv(folder / "loading.csv"), truth)


READERS = {
    "calibration": _calibration,
    "workspace": _workspace,
    "cd_case": _cd_case,
    "loading": _loading,
}
