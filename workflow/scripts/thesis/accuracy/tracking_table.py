"""The trackers against the virtual lab's truth."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from palpate.report.tables import SIMULATED_NOTE, to_markdown
from palpate.surface.tracked import load_tracked
from palpate.workflow.job import naming

from thesis.accuracy.tracking import (
    KEYS,
    NOTES,
    UNTRACKED,
    accuracy_rows,
    averages,
    one_row,
    untracked,
)

TITLE = "Trackers against the virtual lab's truth"
SIGNIFICANT = 4


def make_tracking_accuracy(inputs: Any, params: Any) -> dict:
    """Every capture, and means over the captures."""
    files = iter(zip(inputs.tracked, inputs.seconds, strict=True))
    rows = []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        known = {key: capture[key] for key in KEYS if key in capture}
        last = {"provenance": capture["provenance"]}
        found = capture_rows(truth, {name: next(files) for name in params.trackers})
        rows += [known | row | last for row in found]
    table = pd.DataFrame(rows)
    table = rounded(table[KEYS + [name for name in table.columns if name not in KEYS]])
    notes = [f"- {note}" for note in (*NOTES, SIMULATED_NOTE)]
    return {"csv": table, "md": to_markdown(rounded(averages(table)), title=TITLE, notes=notes)}


def capture_rows(truth: str, files: Mapping[str, tuple[str, str]]) -> list[dict]:
    """Rows of a capture: without tracking, then of each tracker."""
    with np.load(truth, allow_pickle=False) as data:
        arrays = {name: data[name] for name in data.files if name != "mask"}
    rows = []
    for name, (path, seconds) in files.items():
        tracked = load_tracked(path)
        spent = seconds_of(seconds) / len(tracked.vertices_m)
        if not rows:
            observed = tracked.observed
        if observed.shape == tracked.observed.shape:
            tracked = replace(tracked, observed=observed)
        kinds = {name: (tracked, spent)}
        if not rows:
            kinds = {UNTRACKED: (untracked(tracked), None)} | kinds
        for kind, (surface, each) in kinds.items():
            with naming(truth):
                found = one_row(accuracy_rows(arrays, surface))
            rows.append({"tracker": kind} | found | {"seconds_per_frame": each})
    return rows


def seconds_of(path: str) -> float:
    """Wall time of a job from its benchmark [s]."""
    return float(pd.read_csv(Path(path), sep="\t")["s"].mean())


def rounded(table: pd.DataFrame) -> pd.DataFrame:
    """Figures to the places that mean something."""
    result = table.copy()
    for name in result.select_dtypes("number").columns:
        if name not in ("frame", "vertices", "captures"):
            # No negative zeros.
            result[name] = [float(f"{x:.{SIGNIFICANT}g}") + 0.0 for x in result[name]]
    return result
