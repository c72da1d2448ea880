"""How true to life the lab's captures are: their errors beside those of the real devices."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.capture.images import all_streams, depth_of
from palpate.capture.tables import read_table
from palpate.open3d_core import ClosestPoints
from palpate.report import outputs
from palpate.surface.template import read_template
from palpate.vision.clouds import scene_points
from palpate.vision.pose import CORNERS, select_threshold
from validation.fidelity_figure import fidelity_figure
from validation.published_noise import (
    REAL_PLANES_MM,
    disparity_std_px,
    khoshelham_noise_m,
    khoshelham_step_m,
    nguyen_noise_m,
    product_px_m,
    stereo_noise_m,
)

TITLE = "The lab's errors beside those of real devices"
# Part of a plane's width and height that counts: matching windows hang over its edges.
INNER = 0.9
CLIP_STD = 4.0
NANOMETRE = 1e-9
HOLD_END_S = 0.5
TEMPLATE_SAMPLES = 20_000
# Accuracy of a VIVID 910 in x, y and z, as its maker states it [mm].
VIVID_MM = (0.22, 0.16, 0.10)
KHOSHELHAM = "Khoshelham and Elberink 2012"
COLUMNS = [
    "quantity",
    "sensor",
    "at",
    "value",
    "reference_value",
    "unit",
    "source",
    "provenance",
]


def make_plane_noise(inputs: Any, params: Any) -> dict:
    """One row a distance of a flat board: depth, residual and step of the depth."""
    folder, sensor = Path(inputs.planes), params.sensor
    rows = []
    for plane in read_table(folder / "planes.csv")["plane"]:
        frames = list(all_streams(folder / f"{int(plane):02d}", sensor))
        found = [plane_residual(scene_points(images, sensor)) for images in frames]
        depth, residual = np.mean(found, axis=0)
        row = {"depth_m": depth, "residual_m": residual, "step_m": depth_step(frames[0], sensor)}
        rows.append(row)
    return {"noise": outputs.exact(pd.DataFrame(rows))}


def make_lab_fidelity(inputs: Any, params: Any) -> dict:
    """Table and figure."""
    planes = _tables(params.planes, inputs.planes)
    workspaces = _tables(params.workspace, inputs.workspaces)
    holds = _tables(params.loading, inputs.holds)
    scatters = {name: at_selected_threshold(table) for name, table in workspaces.items()}
    study = pd.read_csv(inputs.published)
    rows = []
    for name, table in planes.items():
        rows += plane_rows(table, params.sensors[name])
    for name, table in scatters.items():
        rows += scatter_rows(table, name, study)
    rows += [hold_row(name, table) for name, table in holds.items()]
    for name, template, truth in zip(params.scanned, inputs.templates, inputs.truths, strict=True):
        rows += template_rows(name, template, truth)
    figure = fidelity_figure(params.sensors, planes, scatters, holds, study)
    table = pd.DataFrame(rows)
    return outputs.table(table, title=TITLE) | {"figure": figure}


def plane_residual(points_m: NDArray) -> tuple[float, float]:
    """Fit a plane to the inner part of a board's points.

    Parameters
    ----------
    points_m : (n, 3) array
        Camera frame [m].

    Returns
    -------
    depth_m : float
        Mean depth.
    residual_m : float
        Standard deviation along the plane's normal, gross errors clipped.
    """
    middle = np.median(points_m[:, :2], axis=0)
    half = np.quantile(np.abs(points_m[:, :2] - middle), 0.98, axis=0)
    points = points_m[(np.abs(points_m[:, :2] - middle) < INNER * half).all(axis=1)]
    for _ in range(3):
        centre = points.mean(axis=0)
        _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
        away = (points - centre) @ axes[2]
        points = points[np.abs(away) <= CLIP_STD * away.std() + NANOMETRE]
    return float(centre[2]), float(away.std())


def hold_drop(forces: pd.DataFrame) -> float:
    """Part of the largest force that is lost until the end of a hold.

    Parameters
    ----------
    forces : DataFrame
        ``time_s`` and ``force_n``.
    """
    end = forces["time_s"] > forces["time_s"].max() - HOLD_END_S
    return float(1 - forces["force_n"][end].mean() / forces["force_n"].max())


def plane_rows(planes: pd.DataFrame, sensor: Mapping) -> list[dict]:
    """Rows of the fidelity table for a sensor's planes (columns ``depth_m, residual_m``)."""
    name, rows = sensor["sensor"], []
    for plane in planes.itertuples():
        z, at = plane.depth_m, f"{plane.depth_m:.2f} m"
        if sensor["kind"] == "stereo":
            std, product = disparity_std_px(planes, sensor), product_px_m(sensor)
            expected = stereo_noise_m(z, disparity_std_px=std, product_px_m=product) * 1e3
            known = {"z^2 sigma_d / (f b), sigma_d fitted": expected}
        else:
            known = {KHOSHELHAM: khoshelham_noise_m(z) * 1e3}
            known |= {"Nguyen et al. 2012": nguyen_noise_m(z) * 1e3}
            if 0.6 <= z <= 1.5:
                known["real planes, 1.45 to 1.83 mm at 0.6 to 1.5 m"] = np.mean(REAL_PLANES_MM)
        residual = "plane_residual", name, at, plane.residual_m * 1e3
        rows += [_row(*residual, value, "mm", source) for source, value in known.items()]
        if sensor["kind"] != "stereo":
            step, expected = plane.step_m * 1e3, khoshelham_step_m(z) * 1e3
            rows.append(_row("depth_step", name, at, step, expected, "mm", KHOSHELHAM))
    return rows


def scatter_rows(scatter: pd.DataFrame, sensor: str, published: pd.DataFrame) -> list[dict]:
    """Rows for the tip's scatter, mean over the workspace's points, beside Table 4.2."""
    study, rows = published.set_index("axis").reindex(columns=[f"{sensor}_cm"]), []
    for axis, known_cm in study.iloc[:, 0].items():
        value = scatter[f"std_{axis}_m"].mean() * 1e3
        rows.append(_row("tip_scatter", sensor, axis, value, known_cm * 10, "mm", "Table 4.2"))
    found = 100 * scatter["found"].sum() / scatter["frames"].sum()
    return [*rows, _row("marker_found", sensor, "workspace", found, np.nan, "%", "")]


def depth_step(images: Mapping, sensor: Mapping) -> float:
    """Median difference of neighbouring depths that occur [m]; NaN where they are not stepped."""
    if "depth" not in images:
        return np.nan
    depth = depth_of(images["depth"], sensor["depth"])
    levels, counts = np.unique(depth[np.isfinite(depth)], return_counts=True)
    common = levels[counts > 0.02 * counts.max()]
    return float(np.median(np.diff(common)))


def at_selected_threshold(table: pd.DataFrame) -> pd.DataFrame:
    """The workspace's points as the study tracks them."""
    selected = select_threshold(table)
    return table[(table["method"] == CORNERS) & (table["threshold_px"] == selected)]


def hold_row(name: str, forces: pd.DataFrame) -> dict:
    """Force lost while holding; the study prints a curve and no figure."""
    drop = 100 * hold_drop(forces)
    return _row("force_drop", name, "hold", drop, np.nan, "%", "Figure 4.6 (curve only)")


def template_rows(name: str, template_file: str, truth_file: str) -> list[dict]:
    """Distance of a template made from scans from the true surface: mean and 95 % quantile."""
    vertices_m = read_template(template_file, unit="m").vertices_m
    with np.load(truth_file, allow_pickle=False) as truth:
        closest = ClosestPoints(truth["surface_rest_m"], truth["surface_faces"])
    away = closest.distance(vertices_m[:: max(1, len(vertices_m) // TEMPLATE_SAMPLES)]) * 1e3
    known = float(np.mean(VIVID_MM)), "mm", "VIVID 910, mean of 0.22, 0.16, 0.10"
    found = {"mean": away.mean(), "95 %": np.quantile(away, 0.95)}
    return [
        _row("template_distance", "laser", f"{name}, {kind}", float(value), *known)
        for kind, value in found.items()
    ]


def _tables(names: list[str], paths: list[str]) -> dict[str, pd.DataFrame]:
    return {name: pd.read_csv(path) for name, path in zip(names, paths, strict=True)}


def _row(*cells: object) -> dict:
    """One row of the table, which is all of the lab."""
    return dict(zip(COLUMNS, (*cells, "simulated"), strict=True))
