"""Table 4.1, Equation 4.12 and Figures 4.9 and 4.10: the camera calibration."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames
from palpate.json_fields import read_all
from palpate.report import style
from palpate.units import CENTIMETRES
from palpate.vision.camera import OPTICS

# The study calls the infrared camera IR and prints its translation in centimetres.
PUBLISHED_NAMES = {"color": "color", "infrared": "ir"}
STREAM_TITLES = {"color": "Colour camera", "infrared": "Infrared camera"}
COLOURS = {"color": style.ORANGE, "infrared": style.BLUE}


def make_table_4_1(inputs: Any, params: Any) -> pd.DataFrame:
    """Table 4.1 of the first calibrated sensor."""
    (result,) = read_all(inputs.calibration)
    return table_4_1(result, pd.read_csv(inputs.published))


def make_equation_4_12(inputs: Any, params: Any) -> pd.DataFrame:
    """Equation 4.12 of the first calibrated sensor."""
    (result,) = read_all(inputs.calibration)
    return equation_4_12(result, pd.read_csv(inputs.published))


def pair_of(folder: str, view: str) -> dict[str, NDArray]:
    """A pair of pictures by stream."""
    frames = read_frames(folder)
    return {
        stream: read_image(Path(folder) / str(frames[stream].iloc[int(view)]), "mono8")
        for stream in ("infrared", "color")
    }


def table_4_1(result: Mapping, published: pd.DataFrame) -> pd.DataFrame:
    """Focal lengths and principal points with standard errors, beside Table 4.1.

    Parameters
    ----------
    result : mapping
        calibration.json.
    published : DataFrame
        config/published/table_4_1.csv.
    """
    printed = published.set_index("camera")
    rows = []
    for stream in ("color", "infrared"):
        camera = result["cameras"][stream]
        known = printed.loc[PUBLISHED_NAMES[stream]]
        rows.append(
            {"camera": stream}
            | {name: round(camera[name], 4) for name in OPTICS}
            | {f"{name}_error": round(camera["standard_errors"][name], 4) for name in OPTICS}
            | {f"published_{name}": known[name] for name in OPTICS}
            | {"views": len(camera["errors_px"]), "rejected": len(camera["rejected"])}
            | {"rms_px": round(camera["rms_px"], 4), "provenance": result["provenance"]}
        )
    return pd.DataFrame(rows)


def equation_4_12(result: Mapping, published: pd.DataFrame) -> pd.DataFrame:
    """Transform from the infrared to the colour camera, beside Equation 4.12 [m]."""
    ours = np.array(result["color_from_infrared"])
    printed = published.to_numpy(float)
    printed[:3, 3] /= CENTIMETRES
    names = ["r1", "r2", "r3", "t_m"]
    table = pd.DataFrame(np.round(ours, 8), columns=names)
    table.insert(0, "row", range(1, 5))
    for column, name in enumerate(names):
        table[f"published_{name}"] = np.round(printed[:, column], 8)
    return table.assign(provenance=result["provenance"])


def figure_4_9(inputs: Any, params: Any) -> Figure:
    """First infrared and colour pair of the calibration with the corners found (Fig. 4.9)."""
    (result,) = read_all(inputs.calibration)
    view = sorted(result["pair_errors_px"])[0]
    images = pair_of(inputs.pairs[0], view)
    figure, axes = plt.subplots(1, 2, figsize=(style.PAGE_IN, 2.95))
    for panel, stream, letter in zip(axes, ("infrared", "color"), "ab", strict=True):
        image = images[stream]
        panel.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="none")
        seen = result["cameras"][stream]["corners_px"][view]
        corners = np.array([corner for corner in seen if corner is not None])
        panel.plot(*corners.T, "-", lw=0.5, color=COLOURS[stream], alpha=0.8)
        panel.plot(*corners.T, "o", ms=2.2, mfc="none", mew=0.7, color=COLOURS[stream])
        panel.plot(*corners[0], "s", ms=5, mfc="none", mew=1.2, color=COLOURS[stream])
        panel.set_title(STREAM_TITLES[stream])
        panel.set_axis_off()
        style.panel_letter(panel, letter)
    # Letters stand outside the panels.
    figure.tight_layout(rect=(0.02, 0.03, 1, 0.98))
    style.label_provenance(figure, {result["provenance"]})
    return figure


def figure_4_10(inputs: Any, params: Any) -> Figure:
    """Poses of the target relative to both cameras, from above and from the side (Fig. 4.10)."""
    (result,) = read_all(inputs.calibration)
    board = result["board"]
    width, height = ((count - 1) * board["square_m"] for count in board["inner_corners"])
    outline = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0], [0, 0, 0]])
    figure, axes = plt.subplots(1, 2, figsize=(style.PAGE_IN, 3.2))
    poses = result["cameras"]["color"]["camera_from_board"]
    infrared = np.array(result["color_from_infrared"])[:3, 3]
    for panel, side, letter in zip(axes, (0, 1), "ab", strict=True):
        for pose in map(np.array, poses.values()):
            corners = outline @ pose[:3, :3].T + pose[:3, 3]
            panel.plot(corners[:, 2], corners[:, side], color=style.GREY, lw=0.7)
            panel.plot(corners[0, 2], corners[0, side], ".", ms=3, color=style.BLACK)
        for name, place in (("color", np.zeros(3)), ("infrared", infrared)):
            panel.plot(
                place[2], place[side], ">", ms=6, color=COLOURS[name], label=STREAM_TITLES[name]
            )
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_xlabel("z, away from the colour camera (m)")
        panel.set_ylabel(("x, to the right (m)", "y, down (m)")[side])
        if side == 1:
            panel.invert_yaxis()
        style.panel_letter(panel, letter)
    axes[0].legend(loc="lower left")
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    style.label_provenance(figure, {result["provenance"]})
    return figure
