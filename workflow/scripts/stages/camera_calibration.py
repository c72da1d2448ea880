"""Optics of a sensor's two cameras, and the transform between them."""

import json
from pathlib import Path

import pandas as pd
from palpate.capture.experiments import calibrated_streams
from palpate.capture.files import whole_file
from palpate.capture.images import read_image
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_frames, read_table
from palpate.run.job import run
from palpate.vision.board import Board, board_views
from palpate.vision.calibration_json import pair_fields
from palpate.vision.pair_calibration import calibrate_pair


def main(snakemake):
    """Write calibration.json."""
    folder = Path(snakemake.input.pairs)
    row = read_table(folder / "board.csv").iloc[0]
    board = Board(int(row["columns"]), int(row["rows"]), float(row["square_m"]))
    frames = read_frames(folder)
    streams = calibrated_streams(frames.columns)
    found, missing, sizes = {}, {}, {}
    for stream in streams:
        found[stream], missing[stream], sizes[stream] = views(folder, frames[stream], board)
    pair = calibrate_pair(*found.values(), board, tuple(sizes.values()), names=streams)
    result = {
        "provenance": provenance(folder),
        "board": {"columns": board.columns, "rows": board.rows, "square_m": board.square_m},
        "pairs": len(frames),
        **pair_fields(pair, board, streams, found, missing),
    }
    with whole_file(snakemake.output.calibration) as part:
        part.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def provenance(folder):
    """What recording.yaml says; without one people recorded it."""
    path = folder / "recording.yaml"
    return load_yaml(path)["provenance"] if path.is_file() else "recorded"


def views(folder: Path, files: pd.Series, board: Board):
    """Corners of a camera's views, why others have none, and the pictures' size."""
    images = [(f"{k:02d}", read_image(folder / str(file), "mono8")) for k, file in enumerate(files)]
    found, missing = board_views(images, board)
    if not found:
        raise ValueError(
            f"{files.name}: expected boards of {board.columns} x {board.rows} inner corners, found"
            f" none in {len(images)} pictures"
        )
    return found, missing, images[0][1].shape[::-1]


run(main, snakemake)
