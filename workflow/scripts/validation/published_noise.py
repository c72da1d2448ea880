"""Depth noise of real devices, as it is published."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

# Normal residuals of planes recorded with real Kinects at 0.6 to 1.5 m [mm].
REAL_PLANES_MM = (1.45, 1.83)


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


def product_px_m(sensor: Mapping) -> float:
    """Focal length times baseline of a stereo pair."""
    return sensor["color"]["fx_px"] * sensor["stereo"]["baseline_m"]


def disparity_std_px(planes: pd.DataFrame, sensor: Mapping) -> float:
    """Disparity noise that explains a stereo pair's planes best."""
    unit = stereo_noise_m(planes["depth_m"], disparity_std_px=1, product_px_m=product_px_m(sensor))
    return float(np.median(planes["residual_m"] / unit))
