"""How true to life the lab's captures are: their errors beside those of the real devices."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from palpate.open3d_core import ClosestPoints

# Part of a plane's width and height that counts: matching windows hang over its edges.
INNER = 0.9
CLIP_STD = 4.0
NANOMETRE = 1e-9
HOLD_END_S = 0.5
TEMPLATE_SAMPLES = 20_000
# Normal residuals of planes filmed with real Kinects at 0.6 to 1.5 m [mm].
REAL_PLANES_MM = (1.45, 1.83)
# Accuracy of a VIVID 910 in x, y and z, as its maker states it [mm].
VIVID_MM = (0.22, 0.16, 0.10)
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


def khoshelham_noise_m(depth_m: NDArray) -> NDArray:
    """Standard deviation of a Kinect's depth [m] (Khoshelham and Elberink 2012)."""
    return 1.425e-6 * (np.asarray(depth_m) * 1e3) ** 2 * 1e-3


def khoshelham_step_m(depth_m: NDArray) -> NDArray:
    """Step between neighbouring depths of a Kinect [m] (Khoshelham and Elberink 2012)."""
    return 2.85e-6 * (np.asarray(depth_m) * 1e3) ** 2 * 1e-3


def nguyen_noise_m(depth_m: NDArray) -> NDArray:
    """Axial standard deviation of a Kinect's depth [m], head-on (Nguyen et al. 2012)."""
    return 0.0012 + 0.0019 * (np.asarray(depth_m) - 0.4) ** 2


def stereo_noise_m(depth_m: NDArray, *, disparity_std_px: float, product_px_m: float) -> NDArray:
    """Depth noise of a stereo pair: z^2 sigma_d / (f b) [m]."""
    return np.asarray(depth_m) ** 2 * disparity_std_px / product_px_m


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


def template_error(
    vertices_m: NDArray, faces: NDArray, true_m: NDArray, true_faces: NDArray
) -> dict[str, float]:
    """Distances of a template's vertices from the true surface: mean and 95 % quantile [m]."""
    closest = ClosestPoints(true_m, true_faces)
    step = max(1, len(vertices_m) // TEMPLATE_SAMPLES)
    away = closest.distance(vertices_m[::step])
    return {"mean_m": float(away.mean()), "p95_m": float(np.quantile(away, 0.95))}


def plane_rows(planes: pd.DataFrame, sensor: Mapping) -> list[dict]:
    """Rows of the fidelity table for a sensor's planes (columns ``depth_m, residual_m``)."""
    rows = []
    for plane in planes.itertuples():
        at = f"{plane.depth_m:.2f} m"
        shared = {"sensor": sensor["sensor"], "at": at, "unit": "mm"}
        residual = {"quantity": "plane_residual", "value": plane.residual_m * 1e3} | shared
        if sensor["kind"] == "stereo":
            published = stereo_noise_m(
                plane.depth_m,
                disparity_std_px=disparity_std_px(planes, sensor),
                product_px_m=product_px_m(sensor),
            )
            source = "z^2 sigma_d / (f b), sigma_d fitted"
            rows.append(residual | {"reference_value": published * 1e3, "source": source})
            continue
        for source, model in (
            ("Khoshelham and Elberink 2012", khoshelham_noise_m),
            ("Nguyen et al. 2012", nguyen_noise_m),
        ):
            rows.append(
                residual | {"reference_value": model(plane.depth_m) * 1e3, "source": source}
            )
        if 0.6 <= plane.depth_m <= 1.5:
            real = float(np.mean(REAL_PLANES_MM))
            source = "real planes, 1.45 to 1.83 mm at 0.6 to 1.5 m"
            rows.append(residual | {"reference_value": real, "source": source})
        rows.append(
            shared
            | {
                "quantity": "depth_step",
                "value": plane.step_m * 1e3,
                "reference_value": khoshelham_step_m(plane.depth_m) * 1e3,
                "source": "Khoshelham and Elberink 2012",
            }
        )
    return rows


def product_px_m(sensor: Mapping) -> float:
    """Focal length times baseline of a stereo pair."""
    return sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]


def disparity_std_px(planes: pd.DataFrame, sensor: Mapping) -> float:
    """Disparity noise that explains a stereo pair's planes best."""
    unit = stereo_noise_m(planes["depth_m"], disparity_std_px=1, product_px_m=product_px_m(sensor))
    return float(np.median(planes["residual_m"] / unit))


def scatter_rows(scatter: pd.DataFrame, sensor: str, published: pd.DataFrame) -> list[dict]:
    """Rows for the tip's scatter, mean over the workspace's points, beside Table 4.2."""
    study = published.set_index("axis")
    column = f"{sensor}_cm"
    rows = []
    for axis in "xyz":
        known = float(study.loc[axis, column]) * 10 if column in study else np.nan
        rows.append(
            {
                "quantity": "tip_scatter",
                "sensor": sensor,
                "at": axis,
                "value": scatter[f"std_{axis}_m"].mean() * 1e3,
                "reference_value": known,
                "unit": "mm",
                "source": "Table 4.2",
            }
        )
    found = 100 * scatter["found"].sum() / scatter["frames"].sum()
    row = {"quantity": "marker_found", "sensor": sensor, "at": "workspace", "value": found}
    return [*rows, row | {"reference_value": np.nan, "unit": "%", "source": ""}]


def fidelity_table(rows: Sequence[Mapping]) -> pd.DataFrame:
    """The fidelity table in its order of columns."""
    return pd.DataFrame(rows).assign(provenance="simulated")[COLUMNS]
