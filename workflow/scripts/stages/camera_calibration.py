"""Optics of a sensor's two cameras, and the transform between them."""

from pathlib import Path

import pandas as pd
from palpate.capture.experiments import calibrated_streams, read_marker
from palpate.capture.files import write_json
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames
from palpate.vision.board import FlatBoard, board_views
from palpate.vision.calibration_json import pair_fields
from palpate.vision.marker import board_of
from palpate.vision.pair_calibration import calibrate_pair
from palpate.workflow.job import run
from palpate.yaml_files import load_yaml


def main(snakemake):
    """Write calibration.json."""
    folder = Path(snakemake.input.pairs)
    marker = read_marker(folder)
    board = board_of(marker)
    frames = read_frames(folder)
    streams = calibrated_streams(frames.columns)
    found, missing, sizes = {}, {}, {}
    for stream in streams:
        found[stream], missing[stream], sizes[stream] = views(folder, frames[stream], board)
    pair = calibrate_pair(*found.values(), board, tuple(sizes.values()), names=streams)
    result = {
        "provenance": provenance(folder),
        "board": marker,
        "pairs": len(frames),
        **pair_fields(pair, board, streams, found, missing),
    }
    write_json(snakemake.output.calibration, result)


def provenance(folder):
    """What recording.yaml says; without one people recorded it."""
    path = folder / "recording.yaml"
    return load_yaml(path)["provenance"] if path.is_file() else "recorded"


def views(folder: Path, files: pd.Series, board: FlatBoard):
    """Corners of a camera's views, why others have none, and the pictures' size."""
    images = [(f"{k:02d}", read_image(folder / str(file), "mono8")) for k, file in enumerate(files)]
    found, missing = board_views(images, board)
    if not found:
        raise ValueError(
            f"{files.name}: expected {board.described}, found none in {len(images)} pictures"
        )
    return found, missing, images[0][1].shape[::-1]


run(main, snakemake)
