"""Figure of the lab's fidelity: sensor noise, tip scatter and relaxation beside real devices."""

from collections.abc import Mapping

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from palpate.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    label_provenance,
    panel_letter,
    sensor_name,
)
from validation.published_noise import (
    REAL_PLANES_MM,
    disparity_std_px,
    khoshelham_noise_m,
    nguyen_noise_m,
    product_px_m,
    stereo_noise_m,
)

COLOURS = {"bumblebee": BLUE, "kinect": ORANGE}


def fidelity_figure(
    sensors: Mapping[str, Mapping],
    planes: Mapping[str, pd.DataFrame],
    scatters: Mapping[str, pd.DataFrame],
    holds: Mapping[str, pd.DataFrame],
    published: pd.DataFrame,
) -> Figure:
    """Draw plane noise, tip scatter and force while holding.

    Parameters
    ----------
    sensors : mapping
        Name to the sensor's file.
    planes, scatters, holds : mapping
        Name of a sensor to its measurements.
    published : DataFrame
        Table 4.2.
    """
    figure, axes = plt.subplots(2, 2, figsize=(PAGE_IN, 5.2))
    for name, sensor in sensors.items():
        stereo = sensor["kind"] == "stereo"
        if name in planes:
            panel = _stereo_panel if stereo else _kinect_panel
            panel(axes[0, int(stereo)], planes[name], sensor)
    _scatter_panel(axes[1, 0], scatters, published)
    _hold_panel(axes[1, 1], holds)
    for letter, panel in zip("abcd", axes.ravel(), strict=True):
        panel_letter(panel, letter)
    figure.tight_layout(rect=(0, 0.02, 1, 1), h_pad=1.6)
    label_provenance(figure, {"simulated"})
    return figure


def _kinect_panel(axes: Axes, planes: pd.DataFrame, sensor: Mapping) -> None:
    z = np.linspace(0.5, planes["depth_m"].max() * 1.05, 100)
    axes.fill_between(
        [0.6, 1.5], *REAL_PLANES_MM, color=GREY, alpha=0.35, lw=0, label="real planes"
    )
    axes.plot(z, khoshelham_noise_m(z) * 1e3, color=BLACK, label="Khoshelham & Elberink 2012")
    axes.plot(z, nguyen_noise_m(z) * 1e3, color=GREEN, ls="--", label="Nguyen et al. 2012")
    _dots(axes, planes, sensor)
    axes.set_title(sensor_name(sensor["sensor"]))
    axes.set_ylabel("Residual of a plane (mm)")


def _stereo_panel(axes: Axes, planes: pd.DataFrame, sensor: Mapping) -> None:
    z = np.linspace(0.45, planes["depth_m"].max() * 1.05, 100)
    std = disparity_std_px(planes, sensor)
    model = stereo_noise_m(z, disparity_std_px=std, product_px_m=product_px_m(sensor))
    axes.plot(z, model * 1e3, color=BLACK, label=rf"$z^2\sigma_d/(f b)$, $\sigma_d$ = {std:.3f} px")
    _dots(axes, planes, sensor)
    axes.set_title(sensor_name(sensor["sensor"]))


def _dots(axes: Axes, planes: pd.DataFrame, sensor: Mapping) -> None:
    colour = COLOURS.get(sensor["sensor"], BLUE)
    axes.plot(planes["depth_m"], planes["residual_m"] * 1e3, "o", ms=4, color=colour, label="lab")
    axes.set_xlabel("Distance (m)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="upper left")


def _scatter_panel(axes: Axes, scatters: Mapping, published: pd.DataFrame) -> None:
    """Medians and quartiles over the workspace's points beside the study's means."""
    study = published.set_index("axis")
    for k, (name, table) in enumerate(sorted(scatters.items())):
        place = np.arange(3) + 0.26 * (k - (len(scatters) - 1) / 2)
        values = np.stack([table[f"std_{axis}_m"] * 1e3 for axis in "xyz"])
        low, high = np.quantile(values, [0.1, 0.9], axis=1)
        mean = values.mean(axis=1)
        axes.errorbar(
            place,
            mean,
            yerr=[np.maximum(mean - low, 0), np.maximum(high - mean, 0)],
            fmt="o",
            ms=4,
            lw=1,
            color=COLOURS.get(name, BLUE),
            label=f"{sensor_name(name)}, lab",
        )
        if f"{name}_cm" in study:
            known = [study.loc[axis, f"{name}_cm"] * 10 for axis in "xyz"]
            axes.plot(
                place,
                known,
                "D",
                ms=4.5,
                mfc="none",
                color=COLOURS.get(name, BLUE),
                label=f"{sensor_name(name)}, study",
            )
    axes.set_xticks(range(3), ["x", "y", "z (depth)"])
    axes.set_yscale("log")
    axes.set_ylabel("Scatter of the tip at rest (mm)")
    axes.set_ylim(0.008, 4)
    axes.legend(loc="upper left", ncols=2)


def _hold_panel(axes: Axes, holds: Mapping[str, pd.DataFrame]) -> None:
    for name, table in sorted(holds.items()):
        axes.plot(
            table["time_s"],
            table["force_n"],
            color=COLOURS.get(name, BLUE),
            label=f"{sensor_name(name)}, lab",
        )
    axes.set_xlabel("Time (s)")
    axes.set_ylabel("Force, pressed and held (N)")
    axes.set_ylim(bottom=0)
    axes.legend(loc="lower right")
