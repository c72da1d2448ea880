"""Time and memory of one capture's stages against its frames, picture size and template.

``make bench sections=growth``: a quarter of an hour, and 3 GB of disk for a while. The sample's
capture is recorded longer (before the indentation and while it is held), finer (images and optics
scaled) or of an object with a finer template, and run by Snakemake.
"""

import os
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import trimesh
import yaml
from bench_study import run_snakemake
from longer_capture import SAMPLE, write_capture
from palpate.report.style import journal

ROOT = Path(__file__).resolve().parents[1]
STAGES = ("mask", "probe_pose", "force", "clouds", "align", "surface_motion", "hertz")
# Frames; pixels a side; triangles an edge is divided into.
LENGTHS = {"24": 24, "240": 240, "2,400": 2400}
PICTURES = {"0.3 MP": 1, "1.2 MP": 2, "2.8 MP": 3}
TEMPLATES = {"1,200": None, "19,000": 2, "77,000": 3}


def growth_rows() -> list[tuple]:
    """Clock and peak memory of each stage, against the sample's own size; drawn too."""
    rows = []
    for label, frames in LENGTHS.items():
        rows += _measured(f"{label} frames", frames=frames)
    for label, scale in PICTURES.items():
        rows += _measured(f"pictures of {label}", scale=scale)
    for label, divided in TEMPLATES.items():
        rows += _measured(f"template of {label} vertices", divided=divided)
    _draw(rows, ROOT / "results/figures/growth.png")
    return rows


def _draw(rows: list[tuple], target: Path) -> None:
    """Times and memory of the stages, a column of panels for each kind of growth."""
    found = {name: value for name, value, *_ in rows}
    kinds = (
        ("frames of a recording", [f"{label} frames" for label in LENGTHS]),
        ("pixels of a picture (MP)", [f"pictures of {label}" for label in PICTURES]),
        ("vertices of the template", [f"template of {label} vertices" for label in TEMPLATES]),
    )
    with journal():
        figure, panels = plt.subplots(2, 3, figsize=(7.2, 4.6), sharey="row", layout="constrained")
        for (title, labels), column in zip(kinds, panels.T, strict=True):
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
        run = ("--cores", "1", "--configfile", str(folder / "run.yaml"), "--", *wanted)
        run_snakemake(f"growth: {what}", *run)
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
    write_capture(source / "background", block / "kinect/background", scale=scale)
    write_capture(source / "08", block / "kinect/08", frames=frames, scale=scale)
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
