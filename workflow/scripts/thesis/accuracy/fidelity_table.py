"""The lab's errors beside those of the real devices: a table and a figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from palpate.capture.images import all_streams, depth_of
from palpate.capture.tables import read_table
from palpate.report import outputs
from palpate.surface.template import read_template
from palpate.vision.clouds import scene_points

from thesis.accuracy import fidelity
from thesis.accuracy.fidelity_figure import fidelity_figure
from thesis.chapter4.workspace import CORNERS, select_threshold

TITLE = "The lab's errors beside those of real devices"


def make_plane_noise(inputs: Any, params: Any) -> dict:
    """One row a distance of a flat board: depth, residual and step of the depth."""
    folder, sensor = Path(inputs.planes), params.sensor
    rows = []
    for plane in read_table(folder / "planes.csv")["plane"]:
        frames = list(all_streams(folder / f"{int(plane):02d}", sensor))
        found = [fidelity.plane_residual(scene_points(images, sensor)) for images in frames]
        depth, residual = np.mean(found, axis=0)
        row = {"depth_m": depth, "residual_m": residual, "step_m": depth_step(frames[0], sensor)}
        rows.append(row)
    return {"noise": outputs.exact(pd.DataFrame(rows))}


def depth_step(images: Mapping, sensor: Mapping) -> float:
    """Median difference of neighbouring depths that occur [m]; NaN where they are not stepped."""
    if "depth" not in images:
        return np.nan
    depth = depth_of(images["depth"], sensor["depth"])
    levels, counts = np.unique(depth[np.isfinite(depth)], return_counts=True)
    common = levels[counts > 0.02 * counts.max()]
    return float(np.median(np.diff(common)))


def make_lab_fidelity(inputs: Any, params: Any) -> dict:
    """Table and figure."""
    planes = _tables(params.planes, inputs.planes)
    workspaces = _tables(params.workspace, inputs.workspaces)
    holds = _tables(params.loading, inputs.holds)
    scatters = {name: at_selected_threshold(table) for name, table in workspaces.items()}
    study = pd.read_csv(inputs.published)
    rows = []
    for name, table in planes.items():
        rows += fidelity.plane_rows(table, params.sensors[name])
    for name, table in scatters.items():
        rows += fidelity.scatter_rows(table, name, study)
    rows += [hold_row(name, table) for name, table in holds.items()]
    for name, template, truth in zip(params.scanned, inputs.templates, inputs.truths, strict=True):
        rows += template_rows(name, template, truth)
    figure = fidelity_figure(params.sensors, planes, scatters, holds, study)
    return outputs.table(fidelity.fidelity_table(rows), title=TITLE) | {"figure": figure}


def _tables(names: list[str], paths: list[str]) -> dict[str, pd.DataFrame]:
    return {name: pd.read_csv(path) for name, path in zip(names, paths, strict=True)}


def at_selected_threshold(table):
    """The workspace's points as the study tracks them."""
    selected = select_threshold(table)
    return table[(table["method"] == CORNERS) & (table["threshold_px"] == selected)]


def hold_row(name, forces):
    """Force lost while holding; the study prints a curve and no figure."""
    row = {"quantity": "force_drop", "sensor": name, "at": "hold", "unit": "%"}
    drop = 100 * fidelity.hold_drop(forces)
    return row | {"value": drop, "reference_value": np.nan, "source": "Figure 4.6 (curve only)"}


def template_rows(name, template_file, truth_file):
    """Distance of a template made from scans from the true surface."""
    template = read_template(template_file, unit="m")
    with np.load(truth_file, allow_pickle=False) as truth:
        true = truth["surface_rest_m"], truth["surface_faces"]
    error = fidelity.template_error(template.vertices_m, template.faces, *true)
    accuracy = float(np.mean(fidelity.VIVID_MM))
    shared = {"quantity": "template_distance", "sensor": "laser", "unit": "mm"}
    shared |= {"reference_value": accuracy, "source": "VIVID 910, mean of 0.22, 0.16, 0.10"}
    return [
        shared | {"at": f"{name}, mean", "value": error["mean_m"] * 1e3},
        shared | {"at": f"{name}, 95 %", "value": error["p95_m"] * 1e3},
    ]
