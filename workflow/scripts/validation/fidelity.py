"""How true to life the lab's captures are: their errors beside those of the real devices."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import NDArray
from palpate.capture.images import all_streams, depth_of
from palpate.capture.tables import read_table
from palpate.npz import read_npz
from palpate.open3d_core import ClosestPoints
from palpate.report import outputs, style
from palpate.surface.template import read_template
from palpate.units import MILLIMETRES, PERCENT
from palpate.vision.clouds import scene_cloud
from validation.sensors import at_selected_threshold

TITLE = "The lab's errors beside those of real devices"
# Part of a plane's width and height that counts: matching windows hang over its edges.
INNER = 0.9
CLIP_STD = 4.0
NANOMETRE = 1e-9
HOLD_END_S = 0.5
TEMPLATE_SAMPLES = 20_000
# Normal residuals of planes recorded with real Kinects [mm], and their distances [m].
REAL_PLANES_MM, REAL_PLANES_M = (1.45, 1.83), (0.6, 1.5)
# Accuracy of a VIVID 910 in x, y and z, as its maker states it [mm].
VIVID_MM = (0.22, 0.16, 0.10)
KHOSHELHAM = "Khoshelham and Elberink 2012"
COLUMNS = ["quantity", "sensor", "at", "value", "reference_value", "unit", "source", "provenance"]
COLOURS, OTHER_COLOUR = {"kinect": style.ORANGE}, style.BLUE
STEREO = "stereo"


def make_plane_noise(inputs: Any, params: Any) -> dict:
    """One row a distance of a flat board: depth, residual and step of the depth."""
    folder, sensor = Path(inputs.planes), params.sensor
    rows = []
    for plane in read_table(folder / "planes.csv")["plane"]:
        frames = list(all_streams(folder / f"{int(plane):02d}", sensor))
        found = [plane_residual(scene_cloud(images, sensor).points_m) for images in frames]
        rows.append([*np.mean(found, axis=0), _depth_step(frames[0], sensor)])
    table = pd.DataFrame(rows, columns=["depth_m", "residual_m", "step_m"])
    return {"noise": outputs.exact(table)}


def make_lab_fidelity(inputs: Any, params: Any) -> dict:
    """Table, and figure of plane noise, tip scatter and force while holding."""
    planes, sensors = _tables(params.planes, inputs.planes), params.sensors
    workspaces = _tables(params.workspace, inputs.workspaces)
    holds = _tables(params.loading, inputs.holds)
    scatters = {name: at_selected_threshold(table) for name, table in workspaces.items()}
    study = pd.read_csv(inputs.published).set_index("axis")
    scans = zip(params.scanned, inputs.templates, inputs.truths, strict=True)
    rows = [row for name, table in planes.items() for row in plane_rows(table, sensors[name])]
    rows += [row for name, table in scatters.items() for row in _scatter_rows(table, name, study)]
    for name, table in holds.items():
        # The study prints a curve and no figure.
        drop = PERCENT * hold_drop(table)
        rows.append(_row("force_drop", name, "hold", drop, np.nan, "%", "Figure 4.6 (curve only)"))
    rows += [row for scan in scans for row in _template_rows(*scan)]
    figure, axes = plt.subplots(2, 2, figsize=(style.PAGE_IN, 5.2))
    for name, table in planes.items():
        _planes_panel(axes[0, int(sensors[name]["kind"] == STEREO)], table, sensors[name])
    _scatter_panel(axes[1, 0], scatters, study)
    _hold_panel(axes[1, 1], holds)
    for letter, panel in zip("abcd", axes.ravel(), strict=True):
        style.panel_letter(panel, letter)
    figure.tight_layout(rect=(0, 0.02, 1, 1), h_pad=1.6)
    style.label_provenance(figure, {"simulated"})
    return outputs.table(pd.DataFrame(rows), title=TITLE) | {"figure": figure}


def khoshelham_noise_m(depth_m: NDArray) -> NDArray:
    """Standard deviation of a Kinect's depth [m], half of a step (Khoshelham and Elberink 2012)."""
    return 1.425e-6 * (np.asarray(depth_m) * 1e3) ** 2 * 1e-3


def nguyen_noise_m(depth_m: NDArray) -> NDArray:
    """Axial standard deviation of a Kinect's depth [m], head-on (Nguyen et al. 2012)."""
    return 0.0012 + 0.0019 * (np.asarray(depth_m) - 0.4) ** 2


def stereo_noise_m(depth_m: NDArray, sensor: Mapping, *, disparity_std_px: float) -> NDArray:
    """Depth noise of a stereo pair: z^2 sigma_d / (f b) [m]."""
    product_px_m = sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]
    return np.asarray(depth_m) ** 2 * disparity_std_px / product_px_m


def disparity_std_px(planes: pd.DataFrame, sensor: Mapping) -> float:
    """Disparity noise that explains a stereo pair's planes best."""
    unit = stereo_noise_m(planes["depth_m"], sensor, disparity_std_px=1)
    return float(np.median(planes["residual_m"] / unit))


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
    """Part of the largest of forces (``time_s, force_n``) that is lost until the end of a hold."""
    end = forces["time_s"] > forces["time_s"].max() - HOLD_END_S
    return float(1 - forces["force_n"][end].mean() / forces["force_n"].max())


def plane_rows(planes: pd.DataFrame, sensor: Mapping) -> list[dict]:
    """Rows of the fidelity table for a sensor's planes (columns ``depth_m, residual_m``)."""
    rows = []
    for plane in planes.itertuples():
        z = plane.depth_m
        of = sensor["sensor"], f"{z:.2f} m"
        if sensor["kind"] == STEREO:
            std = disparity_std_px(planes, sensor)
            expected = stereo_noise_m(z, sensor, disparity_std_px=std) * MILLIMETRES
            known = {"z^2 sigma_d / (f b), sigma_d fitted": expected}
        else:
            known = {KHOSHELHAM: khoshelham_noise_m(z) * MILLIMETRES}
            known |= {"Nguyen et al. 2012": nguyen_noise_m(z) * MILLIMETRES}
            if REAL_PLANES_M[0] <= z <= REAL_PLANES_M[1]:
                known["real planes, 1.45 to 1.83 mm at 0.6 to 1.5 m"] = np.mean(REAL_PLANES_MM)
        residual = "plane_residual", *of, plane.residual_m * MILLIMETRES
        rows += [_row(*residual, value, "mm", source) for source, value in known.items()]
        if sensor["kind"] != STEREO:
            steps = plane.step_m * MILLIMETRES, 2 * khoshelham_noise_m(z) * MILLIMETRES
            rows.append(_row("depth_step", *of, *steps, "mm", KHOSHELHAM))
    return rows


def _scatter_rows(scatter: pd.DataFrame, sensor: str, study: pd.DataFrame) -> list[dict]:
    """Rows for the tip's scatter, mean over the workspace's points, beside Table 4.2."""
    rows = []
    for axis, known_cm in study.reindex(columns=[f"{sensor}_cm"]).iloc[:, 0].items():
        value = scatter[f"std_{axis}_m"].mean() * MILLIMETRES
        rows.append(_row("tip_scatter", sensor, axis, value, known_cm * 10, "mm", "Table 4.2"))
    found = PERCENT * scatter["found"].sum() / scatter["frames"].sum()
    return [*rows, _row("marker_found", sensor, "workspace", found, np.nan, "%", "")]


def _template_rows(name: str, template_file: str, truth_file: str) -> list[dict]:
    """Distance of a template made from scans from the true surface: mean and 95 % quantile."""
    vertices_m, truth = read_template(template_file, unit="m").vertices_m, read_npz(truth_file)
    closest = ClosestPoints(truth["surface_rest_m"], truth["surface_faces"])
    sample = vertices_m[:: max(1, len(vertices_m) // TEMPLATE_SAMPLES)]
    away = closest.distance(sample) * MILLIMETRES
    known = float(np.mean(VIVID_MM)), "mm", "VIVID 910, mean of 0.22, 0.16, 0.10"
    found = {"mean": away.mean(), "95 %": np.quantile(away, 0.95)}
    return [
        _row("template_distance", "laser", f"{name}, {kind}", float(value), *known)
        for kind, value in found.items()
    ]


def _depth_step(images: Mapping, sensor: Mapping) -> float:
    """Median difference of neighbouring depths that occur [m]; NaN where they are not stepped."""
    if "depth" not in images:
        return np.nan
    depth = depth_of(images["depth"], sensor["depth"])
    levels, counts = np.unique(depth[np.isfinite(depth)], return_counts=True)
    return float(np.median(np.diff(levels[counts > 0.02 * counts.max()])))


def _tables(names: Sequence[str], paths: Sequence[str]) -> dict[str, pd.DataFrame]:
    return {name: pd.read_csv(path) for name, path in zip(names, paths, strict=True)}


def _row(*cells: object) -> dict:
    """One row of the table, which is all of the lab."""
    return dict(zip(COLUMNS, (*cells, "simulated"), strict=True))


def _planes_panel(axes: Axes, planes: pd.DataFrame, sensor: Mapping) -> None:
    """Residuals over the distance beside a stereo pair's model, or what is published of Kinects."""
    name, farthest, black = sensor["sensor"], planes["depth_m"].max() * 1.05, style.BLACK
    if sensor["kind"] == STEREO:
        z, std = np.linspace(0.45, farthest, 100), disparity_std_px(planes, sensor)
        model = stereo_noise_m(z, sensor, disparity_std_px=std) * MILLIMETRES
        axes.plot(z, model, color=black, label=rf"$z^2\sigma_d/(f b)$, $\sigma_d$ = {std:.3f} px")
    else:
        z, look = np.linspace(0.5, farthest, 100), {"color": style.GREY, "alpha": 0.35, "lw": 0}
        axes.fill_between(REAL_PLANES_M, *REAL_PLANES_MM, label="real planes", **look)
        noise = khoshelham_noise_m(z) * MILLIMETRES, nguyen_noise_m(z) * MILLIMETRES
        axes.plot(z, noise[0], color=black, label="Khoshelham & Elberink 2012")
        axes.plot(z, noise[1], color=style.GREEN, ls="--", label="Nguyen et al. 2012")
        axes.set_ylabel("Residual of a plane (mm)")
    look = {"ms": 4, "color": COLOURS.get(name, OTHER_COLOUR), "label": "lab"}
    axes.plot(planes["depth_m"], planes["residual_m"] * MILLIMETRES, "o", **look)
    axes.set(title=style.sensor_name(name), xlabel="Distance (m)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left")


def _scatter_panel(axes: Axes, scatters: Mapping, study: pd.DataFrame) -> None:
    """Means over the workspace's points, and between which four fifths lie, beside the study's."""
    for k, (name, table) in enumerate(sorted(scatters.items())):
        place = np.arange(3) + 0.26 * (k - (len(scatters) - 1) / 2)
        values = np.stack([table[f"std_{axis}_m"] * MILLIMETRES for axis in "xyz"])
        mean, (low, high) = values.mean(axis=1), np.quantile(values, [0.1, 0.9], axis=1)
        colour, label = COLOURS.get(name, OTHER_COLOUR), style.sensor_name(name)
        look = {"fmt": "o", "ms": 4, "lw": 1, "color": colour, "label": f"{label}, lab"}
        axes.errorbar(place, mean, np.maximum([mean - low, high - mean], 0), **look)
        if f"{name}_cm" in study:
            look = {"ms": 4.5, "mfc": "none", "color": colour, "label": f"{label}, study"}
            axes.plot(place, study.loc[[*"xyz"], f"{name}_cm"] * 10, "D", **look)
    axes.set_xticks(range(3), ["x", "y", "z (depth)"])
    axes.set(yscale="log", ylabel="Scatter of the tip at rest (mm)")
    axes.set_ylim(0.008, 4)
    axes.legend(loc="upper left", ncols=2)


def _hold_panel(axes: Axes, holds: Mapping[str, pd.DataFrame]) -> None:
    for name, table in sorted(holds.items()):
        colour, label = COLOURS.get(name, OTHER_COLOUR), f"{style.sensor_name(name)}, lab"
        axes.plot(table["time_s"], table["force_n"], color=colour, label=label)
    axes.set(xlabel="Time (s)", ylabel="Force, pressed and held (N)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="lower right")
