"""Time and memory of one capture's stages against its frames, picture size and template.

``make bench sections=growth``: a quarter of an hour, and 3 GB of disk for a while. The sample's
capture is filmed longer (before the press and while it is held, with noise of its own), finer
(images and optics scaled) or of an object with a finer template, and run by Snakemake.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import trimesh
import yaml
from palpate.capture.images import read_image, write_image
from palpate.capture.tables import write_table
from palpate.report.style import journal

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "tests/sample"
STAGES = ("mask", "probe_pose", "force", "clouds", "align", "surface_motion", "hertz")
FORCE_STEP_S, FORCE_NOISE_V = 0.005, 0.002
# Frames; pixels a side; triangles an edge is divided into.
FILMS = {"24": 24, "240": 240, "2,400": 2400}
PICTURES = {"0.3 MP": 1, "1.2 MP": 2, "2.8 MP": 3}
TEMPLATES = {"1,200": None, "19,000": 2, "77,000": 3}


def growth_rows() -> list[tuple]:
    """Clock and peak memory of each stage, against the sample's own size; drawn too."""
    rows = []
    for label, frames in FILMS.items():
        rows += _measured(f"{label} frames", frames=frames)
    for label, scale in PICTURES.items():
        rows += _measured(f"pictures of {label}", scale=scale)
    for label, divided in TEMPLATES.items():
        rows += _measured(f"template of {label} vertices", divided=divided)
    _draw(rows, ROOT / "results/figures/growth.png")
    return rows


def _draw(rows: list[tuple], target: Path) -> None:
    """Times and memory of the stages, a column of panels for each way of growing."""
    found = {name: value for name, value, *_ in rows}
    ways = (
        ("frames of a film", [f"{label} frames" for label in FILMS]),
        ("pixels of a picture (MP)", [f"pictures of {label}" for label in PICTURES]),
        ("vertices of the template", [f"template of {label} vertices" for label in TEMPLATES]),
    )
    with journal():
        figure, panels = plt.subplots(2, 3, figsize=(7.2, 4.6), sharey="row", layout="constrained")
        for (title, labels), column in zip(ways, panels.T, strict=True):
            for panel, measure in zip(column, ("clock", "peak memory"), strict=True):
                for stage in STAGES:
                    values = [found[f"{stage}, {label}: {measure}"] for label in labels]
                    panel.plot(range(3), values, marker="o", ms=3, label=stage)
                panel.set(yscale="log", xticks=range(3), xlim=(-0.2, 2.2))
                panel.set_xticklabels([label.split()[-2] for label in labels])
            column[1].set_xlabel(title)
        panels[0, 0].set_ylabel("time by the clock (s)")
        panels[1, 0].set_ylabel("peak memory (MB)")
        panels[0, 2].legend(fontsize=6, ncols=2)
        target.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(target, dpi=200)
        plt.close(figure)


def _measured(what: str, **grown) -> list[tuple]:
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR")) as name:
        folder = Path(name)
        _write(folder, **grown)
        place = folder / "results/foam_block/kinect/08"
        wanted = [str(place / name) for name in ("hertz.json", "motion.npz")]
        command = [sys.executable, "-m", "snakemake", "--cores", "1", "--configfile"]
        command += [str(folder / "run.yaml"), "--", *wanted]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"error: growth: {what}: {done.stderr[-500:]}")
        rows = []
        for stage in STAGES:
            path = folder / f"results/benchmarks/{stage}/foam_block-kinect-08.tsv"
            found = pd.read_csv(path, sep="\t").iloc[0]
            rows.append((f"{stage}, {what}: clock", found["s"], "s", ""))
            rows.append((f"{stage}, {what}: peak memory", found["max_rss"], "MB", ""))
    return rows


def _write(
    folder: Path, *, frames: int | None = None, scale: int = 1, divided: int | None = None
) -> None:
    """A run's raw captures, sensor and configuration."""
    block = folder / "raw/foam_block"
    source = SAMPLE / "raw/foam_block/kinect"
    _film(source / "background", block / "kinect/background", None, scale)
    early_s, late_s = _film(source / "08", block / "kinect/08", frames, scale)
    force = pd.read_csv(source / "08/force.csv")
    then = force["time_s"] + early_s
    time = np.arange(force["time_s"].iloc[0], then.iloc[-1] + late_s, FORCE_STEP_S)
    noise = np.random.default_rng(0).normal(0, FORCE_NOISE_V, (6, len(time)))
    # No gauge shows one value for seconds.
    held = (time < then.iloc[0]) | (time > then.iloc[-1])
    names = [name for name in force if name != "time_s"]
    columns = {
        name: np.interp(time, then, force[name]) + held * own
        for name, own in zip(names, noise, strict=True)
    }
    write_table(block / "kinect/08/force.csv", pd.DataFrame({"time_s": time, **columns}).round(9))
    spec = yaml.safe_load((SAMPLE / "raw/foam_block/object.yaml").read_text())
    mesh = trimesh.load_mesh(SAMPLE / "raw/foam_block/template.ply")
    for _ in range(divided or 0):
        mesh = mesh.subdivide()
    mesh.export(block / "template.ply")
    (block / "object.yaml").write_text(yaml.safe_dump(spec))
    (folder / "sensors").mkdir()
    sensor = _scaled(yaml.safe_load((SAMPLE / "sensors/kinect.yaml").read_text()), scale)
    (folder / "sensors/kinect.yaml").write_text(yaml.safe_dump(sensor))
    paths = {"raw": "raw", "results": "results", "sensors": "sensors"}
    paths = {name: str(folder / path) for name, path in paths.items()} | {"lab": None}
    (folder / "run.yaml").write_text(yaml.safe_dump({"paths": paths}))


def _scaled(sensor: dict, scale: int) -> dict:
    if scale == 1:
        return sensor
    for camera in (sensor["color"], sensor["depth"]):
        for name in ("width_px", "height_px", "fx_px", "fy_px"):
            camera[name] *= scale
        for name in ("cx_px", "cy_px"):
            camera[name] = scale * (camera[name] + 0.5) - 0.5
    sensor["color"]["encoding"] = "rgb8"
    for name in ("disparity_scale", "disparity_offset_px"):
        sensor["depth"][name] *= scale
    sensor["marker"]["reprojection_threshold_px"] *= scale
    return sensor


def _film(source: Path, target: Path, frames: int | None, scale: int) -> tuple[float, float]:
    """A recording filmed from earlier on and for longer, in larger pictures.

    Returns by how much, before and after [s].
    """
    table = pd.read_csv(source / "frames.csv")
    count = frames or len(table)
    more, step_s = count - len(table), np.diff(table["time_s"]).mean()
    early = more // 2
    origin = np.clip(np.arange(count) - early, 0, len(table) - 1)
    longer = pd.DataFrame({"frame": range(count)})
    # Those of the sample keep the times between them.
    beside = np.arange(count) - early - origin
    longer["time_s"] = table["time_s"].to_numpy()[origin] + (beside + early) * step_s
    encodings = {"color": "bayer_rggb8", "depth": "kinect_disparity"}
    for stream, encoding in encodings.items():
        (target / stream).mkdir(parents=True)
        longer[stream] = [f"{stream}/{k:06}.png" for k in range(count)]
        for k in range(count):
            place, same = target / longer[stream][k], int((origin[:k] == origin[k]).sum())
            image = source / table[stream][origin[k]]
            if scale == 1 and not same:
                shutil.copy(image, place)
                continue
            pixels = cv2.imread(str(image), cv2.IMREAD_UNCHANGED)
            if scale > 1:
                kind = cv2.INTER_NEAREST
                if stream == "color":
                    pixels, kind = read_image(image, encoding), cv2.INTER_CUBIC
                pixels = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=kind)
            if same:
                pixels = _noisy(pixels, np.random.default_rng(k), stream)
            if scale > 1 and stream == "color":
                write_image(place, pixels, "rgb8")
            else:
                cv2.imwrite(str(place), pixels)
    write_table(target / "frames.csv", longer.round(9))
    return early * step_s, (more - early) * step_s


def _noisy(pixels: np.ndarray, rng: np.random.Generator, stream: str) -> np.ndarray:
    """The same picture with a sensor's noise of its own."""
    largest, unread = (255, 256) if stream == "color" else (2046, 2047)
    noise = rng.integers(-1, 2, pixels.shape)
    noisy = np.clip(pixels.astype(int) + noise, 0, largest)
    return np.where(pixels >= unread, pixels, noisy).astype(pixels.dtype)
