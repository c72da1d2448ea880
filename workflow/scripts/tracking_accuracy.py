"""Compare the trackers with the virtual lab's truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from job import naming, run
from palpate.capture.files import whole_file
from palpate.study.tables import SIMULATED_NOTE, to_markdown
from palpate.study.tracking_accuracy import (
    KEYS,
    NOTES,
    UNTRACKED,
    accuracy_rows,
    averages,
    one_row,
    untracked,
)
from palpate.surface.tracked import load_tracked

SIGNIFICANT = 4


def main(snakemake):
    """Write every capture as CSV, and means over the captures as Markdown."""
    inputs, params = snakemake.input, snakemake.params
    files = iter(zip(inputs.tracked, inputs.seconds, strict=True))
    rows = []
    for capture, truth in zip(params.captures, inputs.truths, strict=True):
        known = {key: capture[key] for key in KEYS if key in capture}
        last = {"provenance": capture["provenance"]}
        found = capture_rows(truth, {name: next(files) for name in params.trackers})
        rows += [known | row | last for row in found]
    table = pd.DataFrame(rows)
    table = rounded(table[KEYS + [name for name in table.columns if name not in KEYS]])
    title = "Trackers against the virtual lab's truth"
    notes = [f"- {note}" for note in (*NOTES, SIMULATED_NOTE)]
    text = to_markdown(rounded(averages(table)), title=title, notes=notes)
    with whole_file(snakemake.output.csv) as csv, whole_file(snakemake.output.md) as md:
        table.to_csv(csv, index=False, lineterminator="\n")
        md.write_text(text, encoding="utf-8")


def capture_rows(truth, files):
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


def seconds_of(path):
    """Wall time of a job from its benchmark [s]."""
    return float(pd.read_csv(Path(path), sep="\t")["s"].mean())


def rounded(table):
    """Figures to the places that mean something."""
    result = table.copy()
    for name in result.select_dtypes("number").columns:
        if name not in ("frame", "vertices", "captures"):
            # No negative zeros.
            result[name] = [float(f"{x:.{SIGNIFICANT}g}") + 0.0 for x in result[name]]
    return result


run(main, snakemake)
