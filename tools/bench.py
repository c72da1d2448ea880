"""Figures of speed and accuracy, as ratios measured side by side in one run.

``make bench`` writes results/bench.csv (name,value,unit,against,section) and prints it;
``make bench sections="solid estimate"`` measures just those.
"""

import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import trimesh
from bench_estimate import estimate_rows
from bench_growth import growth_rows
from bench_information import information_rows
from bench_lab import lab_rows
from bench_laws import law_rows
from bench_rig import rig_rows
from bench_scale import scale_rows
from bench_solid import solid_rows
from bench_study import study_rows
from bench_tracking import tracking_rows
from bench_vision import vision_rows
from palpate.capture.files import whole_file
from palpate.open3d_core import ClosestPoints

ROUNDS = 7


def ratio(ours, other) -> float:
    """Median over rounds of the other's time over ours, the two in turn."""
    ratios = []
    for _ in range(ROUNDS):
        seconds = []
        for function in (ours, other):
            start = time.perf_counter()
            function()
            seconds.append(time.perf_counter() - start)
        ratios.append(seconds[1] / seconds[0])
    return float(np.median(ratios))


def surface_rows() -> list[tuple]:
    """Closest points on a template."""
    box = trimesh.creation.icosphere(subdivisions=4, radius=0.06)
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (5000, 3))
    closest = ClosestPoints(box.vertices, box.faces)
    found = ratio(lambda: closest(points), lambda: trimesh.proximity.closest_point(box, points))
    return [("closest points on a template", found, "times faster", "trimesh.proximity")]


SECTIONS = {
    "solid": solid_rows,
    "estimate": estimate_rows,
    "surface": surface_rows,
    "tracking": tracking_rows,
    "vision": lambda: vision_rows(ratio),
    "lab": lambda: lab_rows(ratio),
    "scale": scale_rows,
    "study": study_rows,
    "growth": growth_rows,
    "laws": law_rows,
    "information": information_rows,
    "rig": rig_rows,
}
# Measured when they are named: a quarter of an hour each, the last two some minutes.
APART = ("growth", "laws", "information", "rig")


def main(target: Path, sections: list[str]) -> None:
    """Measure, write and print; all sections but those apart unless some are named."""
    unknown = set(sections) - set(SECTIONS)
    if unknown:
        sys.exit(f"bench: expected sections of {', '.join(SECTIONS)}, found {sorted(unknown)[0]}")
    tables = []
    for name in sections or (name for name in SECTIONS if name not in APART):
        table = pd.DataFrame(SECTIONS[name](), columns=["name", "value", "unit", "against"])
        table["value"] = [float(f"{value:.3g}") for value in table["value"]]
        print(table.to_string(index=False), flush=True)
        tables.append(table.assign(section=name))
    with whole_file(target) as part:
        pd.concat(tables).to_csv(part, index=False)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
