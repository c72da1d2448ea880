"""A probe calibrated by the lab's films of it, and what the films show.

``make bench sections=rig``: ten minutes. The stereo head films the handle that turns about its tip,
is held free and presses something rigid; the rules find what docs/rig.md has one find.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml
from bench_study import run_snakemake
from palpate.capture.images import Stream
from palpate.units import MILLIMETRES
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
FILMS = ROOT / "raw/sensors/bumblebee"
TRUTH = ROOT / "results/lab/sensors/bumblebee"
# Of each film some frames, and the part of them that has the probe: rows, columns.
SHOWN = {
    "pivot": ("results/figures/rig_pivot.png", (18, 108, 144, 199)),
    "load": ("results/figures/rig_load.png", (0, 54, 109, 164)),
    "stiffness": ("results/figures/rig_stiffness.png", (0, 30)),
}
PART, SMALLER, GAP_PX, COLOURS = (slice(160, 560), slice(290, 770)), 2, 6, 96


def rig_rows() -> list[tuple]:
    """Film, calibrate, draw; rows are how far off the calibrations are."""
    made = [f"results/sensors/bumblebee/{name}.json" for name in ("tip", "load", "stiffness")]
    run_snakemake("rig", "-j1", "--quiet", "all", "--", *made)
    for film, (picture, frames) in SHOWN.items():
        _draw(FILMS / film, frames, ROOT / picture)
    tip, load, stiffness = (json.loads((ROOT / path).read_text()) for path in made)
    real = {name: np.load(TRUTH / f"{name}.npz") for name in SHOWN}
    off_m = np.linalg.norm(tip["tip_m"] - real["pivot"]["tip_m"])
    off_kg = abs(load["mass_kg"] - real["load"]["mass_kg"])
    off_m_n = abs(stiffness["compliance_m_n"] - 1 / real["stiffness"]["stiffness_n_m"])
    of_lab = "the lab's truth"
    return [
        ("tip of a calibrated probe, off by", off_m * MILLIMETRES, "mm", of_lab),
        ("its load", off_kg * 1e3, "g", of_lab),
        ("what it gives way by", off_m_n * MILLIMETRES, "mm/N", of_lab),
    ]


def _draw(film: Path, frames: Sequence[int], picture: Path) -> None:
    """Frames of a film in a row."""
    sensor = yaml.safe_load((ROOT / "config/sensors/bumblebee.yaml").read_text())
    stream = Stream(film, sensor)
    parts = [stream[k][PART] for k in frames]
    white = np.full((parts[0].shape[0], GAP_PX * SMALLER, 3), 255, dtype=np.uint8)
    row = np.hstack([piece for part in parts for piece in (part, white)][:-1])
    height, width = row.shape[:2]
    small = Image.fromarray(row).resize((width // SMALLER, height // SMALLER), Image.LANCZOS)
    picture.parent.mkdir(parents=True, exist_ok=True)
    small.quantize(COLOURS, dither=Image.Dither.NONE).save(picture, optimize=True)
