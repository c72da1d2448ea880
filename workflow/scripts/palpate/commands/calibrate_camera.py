"""The command ``palpate calibrate camera``: optics from a board's pictures, or another's file."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from numpy.typing import NDArray

from palpate.capture.files import write_text
from palpate.capture.importing.optics_files import read_optics
from palpate.commands.help import add_verb, all_sure, check_outputs, counts, stage, sure
from palpate.config.probe import SIDE, TargetFile
from palpate.units import MILLIMETRES
from palpate.vision.board import Board, FlatBoard
from palpate.vision.board_pictures import BoardPictures, read_pictures
from palpate.vision.calibration import Calibration, calibrate_camera
from palpate.vision.calibration_problem import PARAMETERS
from palpate.vision.calibration_report import camera_verdict, pair_verdict
from palpate.vision.camera import (
    OPTICS,
    PinholeCamera,
    camera_block,
    camera_from_spec,
    depth_blocks,
    opencv_text,
    rectified,
    stereo_blocks,
)
from palpate.vision.marker import board_of
from palpate.vision.pair_calibration import PairCalibration, calibrate_pair
from palpate.yaml_files import load_yaml

ABOUT = """\
Find the optics of one camera, or of two and the transform between them, from pictures of a
checkerboard, or of a board with tags (--board): a folder of PNG, TIFF or JPEG for each camera, the
reference (colour, left) first.
Pictures of two folders are pairs by equal names, or else in the order of their names.
In place of folders it takes files of other programs: Kalibr's camchain.yaml, OpenCV's YAML, ROS's
camera_info. What comes out are the blocks of the sensor's file; what was found stands before it.
"""
EXAMPLE = "palpate calibrate camera color infrared --inner-corners 9x6 --square-mm 30 --kind depth"
KINDS = ("stereo", "depth")
BOARD_HELP = "YAML with a block marker, as palpate board prints or a probe's file has"
DEGREES = degrees(1)
RECTIFIED = (
    "below is the camera of the rectified pictures (cv2.stereoRectify, alpha 0), which captures"
    " must hold: left and right have it alike, without distortion"
)


class _Found(NamedTuple):
    """What is printed and written; the cameras are those of the pictures, before rectification."""

    report: list[str]
    blocks: dict
    cameras: Sequence[PinholeCamera]
    second_from_first: NDArray | None = None


def _camera(options: argparse.Namespace) -> None:
    """Print what was found, and print or write the blocks."""
    if len(options.sources) > 2:
        raise ValueError(f"sources: expected one or two, found {len(options.sources)}")
    for path in options.sources:
        if not path.exists():
            raise ValueError(f"{path}: source: expected a folder of pictures or a file, found none")
    read = [*options.sources, *filter(None, [options.board])]
    check_outputs({"output": options.output, "opencv": options.opencv}, read)
    folders = [path.is_dir() for path in options.sources]
    if len(set(folders)) > 1:
        raise ValueError("sources: expected two folders or two files, found one of each")
    with stage("corners and optics"):
        found = _of_pictures(options) if folders[0] else _of_files(options)
    blocks = found.blocks
    report = found.report + [RECTIFIED] * ("stereo" in blocks)
    if options.opencv is not None:
        if found.second_from_first is None:
            raise ValueError("--opencv: expected two cameras and their transform, found none")
        write_text(options.opencv, opencv_text(found.cameras, found.second_from_first))
    head = {} if options.sensor is None else {"sensor": options.sensor}
    head |= {"kind": options.kind} if "depth" in blocks or "stereo" in blocks else {}
    text = yaml.safe_dump(head | blocks, sort_keys=False, default_flow_style=None, width=100)
    text = "".join(f"# {line}\n" for line in report) + text
    if options.output is None:
        print(text, end="")
    else:
        write_text(options.output, text)
        print("\n".join([*report, f"written: {options.output}"]))


def _check_kind(kind: str | None, count: int, one: str) -> None:
    """Reject a kind of one camera, and two cameras without it."""
    if count == 1 and kind is not None:
        raise ValueError(f"--kind: expected none for {one}, found {kind}")
    if count == 2 and kind is None:
        raise ValueError("--kind: expected stereo or depth for two cameras, found none")


def _of_pictures(options: argparse.Namespace) -> _Found:
    """Cameras by what their pictures show."""
    board = _board(options)
    _check_kind(options.kind, len(options.sources), "one camera")
    seen = read_pictures(options.sources, board)
    corners, sizes = [own.corners for own in seen], tuple(own.size_px for own in seen)
    names, transform = tuple(str(own.folder) for own in seen), None
    if len(seen) == 1:
        found = calibrate_camera(*corners, board, *sizes, name=names[0])
        cameras, lines = [found], []
    else:
        found = calibrate_pair(*corners, board, sizes, names=names)
        cameras, transform, lines = found.cameras, found.second_from_first, _pair_lines(found)
    report = [line for pair in zip(seen, cameras, strict=True) for line in _lines(*pair)]
    report += lines
    optics, encoding = [one.camera for one in cameras], "rgb8" if seen[0].coloured else "mono8"
    return _Found(report, _blocks(optics, transform, options.kind, encoding), optics, transform)


def _of_files(options: argparse.Namespace) -> _Found:
    """Cameras of another program's files, which state no standard errors."""
    stated, kind = read_optics(options.sources, options.size), options.kind
    names, transform = ", ".join(map(str, options.sources)), stated.second_from_first
    report = [f"{names}: as stated; standard errors are not"]
    cameras = [camera_from_spec(block) for block in stated.cameras]
    _check_kind(kind, len(cameras), f"the one camera of {names}")
    if stated.rectified and kind == "stereo":
        block, baseline_m = stated.rectified
        blocks = stereo_blocks(camera_from_spec(block), baseline_m, "rgb8")
        return _Found(report, blocks, cameras)
    if len(cameras) == 2 and transform is None:
        raise ValueError(f"{names}: transform: expected one for --kind depth, found none")
    return _Found(report, _blocks(cameras, transform, kind, "rgb8"), cameras, transform)


def _blocks(cameras: Sequence, second_from_first: NDArray | None, kind: str, encoding: str) -> dict:
    """Blocks of a sensor's file; of one camera there is no kind."""
    if kind is None:
        return {"color": camera_block(cameras[0], encoding)}
    if kind == "depth":
        return depth_blocks(cameras, second_from_first, (encoding, "millimetre"))
    return stereo_blocks(*rectified(cameras, second_from_first), encoding)


def _board(options: argparse.Namespace) -> FlatBoard:
    """The checkerboard of the options, or what a file with a block ``marker`` describes."""
    corners, square_mm = options.inner_corners, options.square_mm
    if options.board is not None:
        if corners is not None or square_mm is not None:
            found = "--inner-corners or --square-mm beside"
            raise ValueError(f"--board: expected it alone, found {found}")
        return board_of(target_of(load_yaml(options.board), options.board)["marker"])
    if corners is None or square_mm is None:
        missing = "--inner-corners" if corners is None else "--square-mm"
        raise ValueError(f"{missing}: expected the board's, found none")
    if min(corners) < 3:
        raise ValueError(f"--inner-corners: expected 3x3 or more, found {corners[0]}x{corners[1]}")
    least, most = (MILLIMETRES * SIDE[end] for end in ("ge", "le"))
    if not least <= square_mm <= most:
        found = f"{square_mm:g}{' (metres?)' if 0 < square_mm < least else ''}"
        raise ValueError(f"--square-mm: expected {least:g} to {most:g} millimetres, found {found}")
    return Board(*corners, square_mm / MILLIMETRES)


def target_of(content: Any, path: Path) -> dict:
    """Block ``marker`` alone of a file that holds one; a `ValueError` with what is wrong in it."""
    if isinstance(content, Mapping) and "marker" in content:
        content = {"marker": content["marker"]}
    TargetFile.read(content, str(path))
    return TargetFile.plain(content)


def _lines(own: BoardPictures, found: Calibration) -> Iterator[str]:
    """What was found of one camera."""
    (width, height), errors = own.size_px, found.standard_errors
    views, pictures = len(found.fit.names), len(own.corners) + len(own.missing)
    yield f"{own.folder}: {width} x {height} pixels, {views} of {pictures} pictures count"
    lens = dict(zip(PARAMETERS, found.fit.shared, strict=True))
    known = [f"{name.removesuffix('_px')} {sure(lens[name], errors[name])}" for name in errors]
    yield f"  {', '.join(known[: len(OPTICS)])} px"
    yield f"  distortion: {', '.join(known[len(OPTICS) :]) or 'none that the corners determine'}"
    yield f"  residual: {found.rms_px:.3f} px (root mean square)"
    for view, places in found.rejected_corners.items():
        numbers = ", ".join(str(place + 1) for place in places)
        some = f"{len(places)} corner{'s' * (len(places) > 1)}"
        yield f"  left out: {view}: {some} (number {numbers})"
    for view, reason in {**own.missing, **found.rejected}.items():
        yield f"  left out: {view}: {reason}"
    yield from (f"  {line}" for line in camera_verdict(found).lines)


def _pair_lines(pair: PairCalibration) -> Iterator[str]:
    """What was found of the transform."""
    errors, (turn, shift) = pair.standard_errors, pair.fit.transform.reshape(2, 3)
    rows = {
        "baseline": ([pair.baseline_m], [pair.baseline_error_m], MILLIMETRES, "mm"),
        "translation": (shift, errors["translation_m"], MILLIMETRES, "mm"),
        "rotation": (turn, errors["rotation_rad"], DEGREES, "degrees"),
    }
    yield f"second camera from the first, by {len(pair.errors_px)} pairs"
    for name, (values, stds, scale, unit) in rows.items():
        yield f"  {name} {all_sure(values, stds, scale)} {unit}"
    yield f"  residual: {pair.rms_px:.3f} px (root mean square)"
    for view, reason in pair.rejected.items():
        yield f"  left out of the pairs: {view}: {reason}"
    yield from (f"  {line}" for line in pair_verdict(pair).lines)


def add(parts: Any) -> None:
    """Add the part to the command's."""
    short = "optics of one camera or two"
    verb = add_verb(parts, "camera", short, _camera, about=ABOUT, example=EXAMPLE)
    verb.add_argument("sources", nargs="+", type=Path, metavar="FOLDER", help="or a file")
    verb.add_argument("--inner-corners", type=counts, metavar="9x6", help="of the checkerboard")
    verb.add_argument("--square-mm", type=float, help="side of its squares")
    verb.add_argument("--board", type=Path, help=BOARD_HELP)
    verb.add_argument("--kind", choices=KINDS, help="of two cameras: what the second is for")
    verb.add_argument("--sensor", metavar="NAME", help="begin the file with this name")
    verb.add_argument("--size", type=counts, metavar="640x480", help="of OpenCV files without one")
    text = "write a pair's M1 D1 M2 D2 R T, to rectify by"
    verb.add_argument("--opencv", type=Path, metavar="FILE", help=text)
    verb.add_argument("--output", type=Path, metavar="FILE", help="write there, else print")
