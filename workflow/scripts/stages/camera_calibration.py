"""Optics of a sensor's two cameras, and the transform between them."""

from pathlib import Path

from palpate.capture.experiments import calibrated_streams, read_marker
from palpate.capture.files import write_json
from palpate.capture.images import read_image
from palpate.capture.tables import read_frames
from palpate.vision.board_pictures import board_in
from palpate.vision.calibration_report import pair_fields
from palpate.vision.marker import board_of
from palpate.vision.pair_calibration import calibrate_pair
from palpate.workflow.job import run
from palpate.yaml_files import load_yaml


def main(snakemake):
    """Write calibration.json."""
    folder = Path(snakemake.input.pairs)
    marker, frames = read_marker(folder), read_frames(folder)
    board, streams, seen = board_of(marker), calibrated_streams(frames.columns), {}
    for stream in streams:
        files = enumerate(frames[stream].astype(str))
        images = {f"{k:02d}": read_image(folder / file, "mono8") for k, file in files}
        seen[stream] = board_in(stream, images, board)
    corners = (own.corners for own in seen.values())
    missing = {stream: own.missing for stream, own in seen.items()}
    sizes_px = tuple(own.size_px for own in seen.values())
    pair = calibrate_pair(*corners, board, sizes_px, names=streams)
    described = folder / "recording.yaml"
    result = {
        # Without the file people recorded it.
        "provenance": load_yaml(described)["provenance"] if described.is_file() else "recorded",
        "board": marker,
        "pairs": len(frames),
        **pair_fields(pair, streams, missing),
    }
    write_json(snakemake.output.calibration, result)


run(main, snakemake)
