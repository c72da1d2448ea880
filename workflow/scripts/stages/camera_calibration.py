"""Optics of a sensor's colour and infrared cameras, and the transform between them."""

import json
from pathlib import Path

import numpy as np
from palpate.capture.files import whole_file
from palpate.capture.images import read_image
from palpate.capture.schema import load_yaml
from palpate.capture.tables import read_frames, read_table
from palpate.run.job import run
from palpate.vision.board import Board, board_views
from palpate.vision.calibration import calibrate_camera, calibrate_pair

STREAMS = ("infrared", "color")


def main(snakemake):
    """Write calibration.json."""
    folder = Path(snakemake.input.pairs)
    row = read_table(folder / "board.csv").iloc[0]
    board = Board(int(row["columns"]), int(row["rows"]), float(row["square_m"]))
    frames = read_frames(folder)
    found, results = {}, {}
    for stream in STREAMS:
        images = [(f"{k:02d}", grey(folder / str(file))) for k, file in enumerate(frames[stream])]
        found[stream], missing = board_views(images, board)
        if not found[stream]:
            raise ValueError(
                f"{stream}: expected boards of {board.columns} x {board.rows} inner corners, found"
                f" none in {len(images)} pictures"
            )
        size = images[0][1].shape[::-1]
        calibration = calibrate_camera(found[stream], board, size)
        results[stream] = described(calibration, missing)
        found[stream] = {name: found[stream][name] for name in calibration.camera_from_board}
        results[stream]["corners_px"] = {n: c.round(4).tolist() for n, c in found[stream].items()}
        found[f"{stream} camera"] = calibration.camera
    cameras = tuple(found[f"{stream} camera"] for stream in STREAMS)
    pair = calibrate_pair(found["infrared"], found["color"], board, cameras)
    result = {
        "provenance": provenance(folder),
        "board": {"columns": board.columns, "rows": board.rows, "square_m": board.square_m},
        "pairs": len(frames),
        "cameras": results,
        "color_from_infrared": pair.second_from_first.tolist(),
        "pair_rms_px": pair.rms_px,
        "pair_errors_px": {name: list(errors) for name, errors in pair.errors_px.items()},
    }
    with whole_file(snakemake.output.calibration) as part:
        part.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def provenance(folder):
    """What recording.yaml says; without one people recorded it."""
    path = folder / "recording.yaml"
    return load_yaml(path)["provenance"] if path.is_file() else "recorded"


def grey(path):
    """Grey image of a calibration view."""
    return read_image(path, "mono8")


def described(calibration, missing):
    """One camera's calibration as JSON holds it."""
    camera = calibration.camera
    optics = {key: getattr(camera, key) for key in ("width_px", "height_px", "fx_px", "fy_px")}
    optics |= {"cx_px": camera.cx_px, "cy_px": camera.cy_px}
    return optics | {
        "distortion": list(camera.distortion),
        "standard_errors": dict(calibration.standard_errors),
        "rms_px": calibration.rms_px,
        "errors_px": dict(calibration.errors_px),
        "rejected": missing | dict(calibration.rejected),
        "camera_from_board": {
            name: np.asarray(pose).tolist() for name, pose in calibration.camera_from_board.items()
        },
    }


run(main, snakemake)
