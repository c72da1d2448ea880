"""Every stage of the pipeline against the virtual lab's truth."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from palpate.capture.tables import read_table
from palpate.json_fields import read_all, read_by_folder, read_one
from palpate.report import outputs
from palpate.surface.tracked import load_tracked
from palpate.vision.clouds import read_clouds
from palpate.vision.force import FORCE
from palpate.vision.foreground import load_masks
from palpate.vision.probe import AXIS, RAW_TIP, TIP

from thesis.accuracy.capture import capture_accuracy

TITLE = "Accuracy of every stage against the virtual lab's truth"
SIGNIFICANT = 5
KEYS = ("object", "sensor", "capture")


def make_pipeline_accuracy(inputs: Any, params: Any) -> dict:
    """Errors of each tracked capture, quantity by quantity."""
    materials, rows = read_by_folder(inputs.materials), []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        with np.load(truth, allow_pickle=False) as data:
            arrays = dict(data)
        known = {key: capture[key] for key in KEYS}
        found = read_results(capture, params)
        for row in capture_accuracy(arrays, materials[capture["object"]], found):
            rows.append(known | row | {"provenance": capture["provenance"]})
    table = pd.DataFrame(rows)
    for name in ("value", "truth"):
        table[name] = [None if pd.isna(x) else float(f"{x:.{SIGNIFICANT}g}") for x in table[name]]
    return outputs.table(table, title=TITLE)


def read_results(capture: Mapping, params: Any) -> dict:
    """What the pipeline found for one capture."""
    folder = Path(params.results).joinpath(*(capture[key] for key in KEYS))
    poses = read_table(folder / "probe_pose.csv")
    return {
        "tip_m": poses[TIP].to_numpy(float),
        "raw_tip_m": poses[RAW_TIP].to_numpy(float),
        "axis": poses[AXIS].to_numpy(float),
        "clock": read_one(str(folder / "clock.json")),
        "force_n": read_table(folder / "force.csv")[FORCE].to_numpy(float),
        "mask": np.stack(list(load_masks(folder / "mask.npz"))),
        "clouds": read_clouds(folder / "clouds.npz"),
        "tracked": load_tracked(folder / f"tracked-{params.tracker}.npz"),
        "hertz": read_one(str(folder / "hertz.json")),
        "minima": _minima(folder, params.errors),
    }


def _minima(folder: Path, errors: Sequence[str]) -> dict[str, dict]:
    found = read_all([str(folder / f"minimise-{error}.json") for error in errors])
    return dict(zip(errors, found, strict=True))
