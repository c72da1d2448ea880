"""Figures 4.13, 4.20 and 4.21, or how far the traced path lies from the case."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from artefact_files import draw, write_table
from frames import Stream
from job import run
from palpate.study import probe_figures

TITLE = "Tracing the CD case (Section 4.2.4): the tip's centre against the case's outline (mm)"


def main(snakemake):
    """Write the table or draw the figure that the rule is named after."""
    source, params, output = snakemake.input, snakemake.params, snakemake.output
    paths = by_sensor(params, source.paths, pd.read_csv)
    places = by_sensor(params, source.places, read_json)
    provenance = set(params.provenance.values())
    if params.artefact == "cd_case_table":
        table = pd.DataFrame([row(name, paths[name], places[name]) for name in params.names])
        table["provenance"] = table["sensor"].map(params.provenance)
        write_table(output, table, title=TITLE)
    elif params.artefact == "figure_4_13":
        draw(output, lambda: probe_figures.figure_4_13(paths, provenance))
    elif params.artefact == "figure_4_20":
        frames = Stream(Path(source.cases[0]) / "trace", params.sensors[params.names[0]])
        draw(output, lambda: probe_figures.figure_4_20(frames[len(frames) // 3], provenance))
    else:
        clouds = by_sensor(params, source.clouds, read_cloud)
        draw(output, lambda: probe_figures.figure_4_21(paths, clouds, places, provenance))


def row(name, path, place):
    """Offsets of one sensor's path; a hand leaves the edge here and there."""
    found = {"sensor": name, "frames": len(path)}
    for kind in ("raw", "smooth", "study"):
        offset = path[f"{kind}_offset_m"] * 1e3
        found |= {f"{kind}_offset_mm": offset.mean(), f"{kind}_offset_std_mm": offset.std()}
    return found | {"tip_radius_mm": place["tip_radius_m"] * 1e3}


def by_sensor(params, files, read):
    """Read a file of each sensor."""
    return {name: read(path) for name, path in zip(params.names, files, strict=True)}


def read_json(path):
    """Read a JSON file."""
    return json.loads(Path(path).read_text(encoding="utf-8"))


def read_cloud(path):
    """Points of the case's cloud."""
    with np.load(path, allow_pickle=False) as data:
        return data["points_m"].astype(float)


run(main, snakemake)
