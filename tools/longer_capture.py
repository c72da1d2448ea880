"""The sample's captures recorded for longer or in larger images, for the benchmarks."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from palpate.capture.images import read_image, write_image
from palpate.capture.tables import write_table

SAMPLE = Path(__file__).resolve().parents[1] / "tests/sample"
FORCE_STEP_S, FORCE_NOISE_V = 0.005, 0.002
# Largest value of an 8-bit image and of a Kinect's disparity; larger ones are no readings.
LARGEST = {"uint8": 255, "uint16": 2046}


def write_capture(source: Path, target: Path, *, frames: int | None = None, scale: int = 1) -> None:
    """Copy a capture or a background of the sample, the forces of a capture with it.

    Parameters
    ----------
    source, target : Path
        Folders.
    frames : int, optional
        More frames than the sample has: the first and the last are repeated before the
        indentation and after it, with noise of their own.
    scale : int, optional
        Factor of the images' width and height (of the Kinect alone).
    """
    table = pd.read_csv(source / "frames.csv")
    count = frames or len(table)
    early, step_s = (count - len(table)) // 2, np.diff(table["time_s"]).mean()
    origin = np.clip(np.arange(count) - early, 0, len(table) - 1)
    # Those of the sample keep the times between them.
    added = np.arange(count) - early - origin
    longer = pd.DataFrame({"frame": range(count)})
    longer["time_s"] = table["time_s"].to_numpy()[origin] + (added + early) * step_s
    for stream in table.columns.drop(["frame", "time_s"]):
        (target / stream).mkdir(parents=True)
        longer[stream] = [f"{stream}/{k:06}.png" for k in range(count)]
        for k, image in enumerate(table[stream].to_numpy()[origin]):
            # No sensor takes the same image twice.
            rng = np.random.default_rng(k) if added[k] else None
            _write_image(source / image, target / longer[stream][k], scale, rng)
    write_table(target / "frames.csv", longer.round(9))
    if (source / "force.csv").is_file():
        late_s = longer["time_s"].iloc[-1] - table["time_s"].iloc[-1] - early * step_s
        force = _longer_force(pd.read_csv(source / "force.csv"), early * step_s, late_s)
        write_table(target / "force.csv", force.round(9))


def _write_image(source: Path, target: Path, scale: int, rng: np.random.Generator | None) -> None:
    if scale == 1 and rng is None:
        shutil.copy(source, target)
        return
    pixels = cv2.imread(str(source), cv2.IMREAD_UNCHANGED)
    mosaic = scale > 1 and target.parent.name == "color"
    if mosaic:
        pixels = read_image(source, "bayer_rggb8")
    if scale > 1:
        kind = cv2.INTER_CUBIC if mosaic else cv2.INTER_NEAREST
        pixels = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=kind)
    if rng is not None:
        largest = LARGEST[pixels.dtype.name]
        noisy = np.clip(pixels.astype(int) + rng.integers(-1, 2, pixels.shape), 0, largest)
        pixels = np.where(pixels > largest, pixels, noisy).astype(pixels.dtype)
    if mosaic:
        write_image(target, pixels, "rgb8")
    else:
        cv2.imwrite(str(target), pixels)


def _longer_force(force: pd.DataFrame, early_s: float, late_s: float) -> pd.DataFrame:
    """A record with its first and last reading repeated, with noise of their own."""
    time = force["time_s"] + early_s
    first, last = time.iloc[0], time.iloc[-1]
    before = np.arange(first - early_s, first - FORCE_STEP_S / 2, FORCE_STEP_S)
    after = np.arange(last + FORCE_STEP_S, last + late_s, FORCE_STEP_S)
    rng, parts = np.random.default_rng(0), [force.assign(time_s=time)]
    for times, reading in ((before, force.iloc[0]), (after, force.iloc[-1])):
        held = pd.DataFrame([reading] * len(times), columns=force.columns)
        gauges = held.drop(columns="time_s") + rng.normal(0, FORCE_NOISE_V, (len(times), 6))
        parts.append(held.assign(time_s=times, **gauges))
    return pd.concat([part for part in parts if len(part)]).sort_values("time_s")
