"""Readings of the experiments about the sensors against the virtual lab's truth."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.study import sensor_accuracy as accuracy
from palpate.study.tables import write

SIGNIFICANT = 4
# The project's own targets: rectified pairs see finer than a 640-pixel picture [mm].
TIP_TARGET_MM = {"stereo": 0.5, "structured_light": 1.0, "depth": 1.0}


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params, rows = snakemake.params, []
    for name, experiment, truth in zip(
        params.names, params.experiments, snakemake.input.truths, strict=True
    ):
        folder = Path(snakemake.output.csv).parents[1] / "sensors" / name
        with np.load(truth, allow_pickle=False) as data:
            arrays = dict(data)
        found = READERS[experiment](folder, arrays, params.sensors[name])
        rows += [{"sensor": name} | row | {"provenance": "simulated"} for row in found]
    table = pd.DataFrame(rows)
    table["value"] = [float(f"{value:.{SIGNIFICANT}g}") for value in table["value"]]
    title = "Accuracy of the recordings about the sensors against the virtual lab's truth"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        write(table, csv, md, title=title)


def calibration(folder, truth, sensor):
    """Optics; the truth is the sensor's file."""
    return accuracy.calibration_rows(read_json(folder / "calibration.json"), sensor)


def workspace(folder, truth, sensor):
    """Resting tip."""
    target = TIP_TARGET_MM[sensor["kind"]]
    table = pd.read_csv(folder / "workspace.csv")
    return accuracy.workspace_rows(table, truth["tip_m"], target_mm=target)


def cd_case(folder, truth, sensor):
    """Tip around the case."""
    path = pd.read_csv(folder / "cd_case_path.csv")
    return accuracy.cd_case_rows(path, read_json(folder / "cd_case.json"), truth)


def loading(folder, truth, sensor):
    """Force and clocks."""
    return accuracy.loading_rows(pd.read_csv(folder / "loading.csv"), truth)


def read_json(path):
    """Read a JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


READERS = {
    "calibration": calibration,
    "workspace": workspace,
    "cd_case": cd_case,
    "loading": loading,
}
run(main, snakemake)
