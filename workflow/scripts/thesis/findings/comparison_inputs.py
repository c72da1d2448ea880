"""What the scripts of comparison and findings read: tables by name, printed ones and ours."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from palpate.json_fields import read_all

from thesis.chapter4.workspace import CORNERS, select_threshold
from thesis.findings import comparison

NAMES = {"capture": str, "point": str, "attempt": str}


def tables_of(paths: Sequence[str]) -> dict[str, pd.DataFrame]:
    """Tables by the names of their files; names of points stay words."""
    return {Path(path).stem: pd.read_csv(path, dtype=NAMES) for path in paths}


def traces_of(inputs: object, captures: Sequence[Mapping], error: str) -> list[tuple]:
    """Capture, error option and trace of each minimisation."""
    minima = read_all(inputs.minima)
    pairs = zip(captures, minima, strict=True)
    return [(capture, error, minimum["trace"]) for capture, minimum in pairs]


def settled_of(traces: Sequence[tuple]) -> pd.DataFrame:
    """When each minimisation settles, and its first and last error [mm]."""
    rows = [
        {
            "object": capture["object"],
            "sensor": capture["sensor"],
            "settled_iteration": comparison.settled_iteration(trace),
            "error_first_mm": trace[0]["error_m"] * comparison.MILLIMETRES,
            "error_last_mm": trace[-1]["error_m"] * comparison.MILLIMETRES,
        }
        for capture, _, trace in traces
    ]
    return pd.DataFrame(rows)


def workspaces_of(sensors: Sequence[str], paths: Sequence[str]) -> pd.DataFrame | None:
    """Workspace by each sensor as the study reads it, the selected threshold marked."""
    parts = []
    for sensor, path in zip(sensors, paths, strict=True):
        table = pd.read_csv(path)
        mine = table[table["method"] == CORNERS].assign(sensor=sensor)
        parts.append(mine.assign(selected=mine["threshold_px"] == select_threshold(table)))
    return pd.concat(parts, ignore_index=True) if parts else None
