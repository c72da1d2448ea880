"""Every stage of the pipeline against the virtual lab's truth."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from job import run
from palpate.capture.files import whole_file
from palpate.capture.tables import read_table
from palpate.study.accuracy import capture_accuracy
from palpate.study.tables import write
from palpate.surface.tracked import load_tracked
from palpate.vision.clouds import unpack_clouds
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks
from palpate.vision.probe import AXIS, RAW_TIP, TIP

SIGNIFICANT = 5
KEYS = ("object", "sensor", "capture")


def main(snakemake):
    """Write the table as CSV and Markdown."""
    params, rows = snakemake.params, []
    results = Path(snakemake.output.csv).parents[1]
    materials = {Path(path).parent.name: read_json(path) for path in snakemake.input.materials}
    for capture, truth in zip(params.captures, snakemake.input.truths, strict=True):
        folder = results.joinpath(*(capture[key] for key in KEYS))
        with np.load(truth, allow_pickle=False) as data:
            arrays = dict(data)
        known = {key: capture[key] for key in KEYS}
        found = read_results(folder, params.errors, params.tracker)
        for row in capture_accuracy(arrays, materials[capture["object"]], found):
            rows.append(known | row | {"provenance": capture["provenance"]})
    table = pd.DataFrame(rows)
    for name in ("value", "truth"):
        table[name] = [None if pd.isna(x) else float(f"{x:.{SIGNIFICANT}g}") for x in table[name]]
    title = "Accuracy of every stage against the virtual lab's truth"
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        write(table, csv, md, title=title)


def read_json(path):
    """Read a JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def read_results(folder, errors, tracker):
    """Read what the pipeline found for one capture."""
    poses = read_table(folder / "probe_pose.csv")
    with np.load(folder / "clouds.npz", allow_pickle=False) as data:
        clouds = [cloud.points_m for cloud in unpack_clouds(data)]
    return {
        "tip_m": poses[TIP].to_numpy(float),
        "raw_tip_m": poses[RAW_TIP].to_numpy(float),
        "axis": poses[AXIS].to_numpy(float),
        "clock": read_json(folder / "clock.json"),
        "force_n": read_table(folder / "force.csv")[FORCE].to_numpy(float),
        "mask": load_masks(folder / "mask.npz"),
        "clouds": clouds,
        "tracked": load_tracked(folder / f"tracked-{tracker}.npz"),
        "hertz": read_json(folder / "hertz.json"),
        "minima": {error: read_json(folder / f"minimise-{error}.json") for error in errors},
    }


run(main, snakemake)
