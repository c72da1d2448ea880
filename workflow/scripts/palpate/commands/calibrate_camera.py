"""The command ``palpate calibrate camera``: optics from a board's pictures, or another's file."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from palpate.commands.help import add_verb, sure
from palpate.units import MILLIMETRES

if TYPE_CHECKING:
    from palpate.vision.board import FlatBoard
    from palpate.vision.board_pictures import BoardPictures
    from palpate.vision.calibration import Calibration
    from palpate.vision.camera import PinholeCamera
    from palpate.vision.pair_calibration import PairCalibration

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
DEGREES = degrees(1)


class _Found(NamedTuple):
    """What is printed and written; the cameras are those of the pictures, before rectification."""

    report: list[str]
    blocks: dict
    cameras: Sequence["PinholeCamera"]
    second_from_first: Any = None


def _camera(options: argparse.Namespace) -> None:
    """Print what was found, and print or write the blocks."""
    import yaml

    if len(options.sources) > 2:
        raise ValueError(f"sources: expected one or two, found {len(options.sources)}")
    for path in options.sources:
        if not path.exists():
            raise ValueError(f"{path}: source: expected a folder of pictures or a file, found none")
    _check_outputs(options)
    folders = [path.is_dir() for path in options.sources]
    if len(set(folders)) > 1:
        raise ValueError("sources: expected two folders or two files, found one of each")
    found = _of_pictures(options) if folders[0] else _of_files(options)
    report, blocks = found.report, found.blocks
    if options.opencv is not None:
        _write_opencv(options.opencv, found)
    head = {} if options.sensor is None else {"sensor": options.sensor}
    head |= {"kind": options.kind} if "depth" in blocks or "stereo" in blocks else {}
    text = yaml.safe_dump(head | blocks, sort_keys=False, default_flow_style=None, width=100)
    if options.output is None:
        print("\n".join(f"# {line}" for line in report) + f"\n{text}", end="")
        return
    from palpate.capture.files import write_text

    write_text(options.output, "".join(f"# {line}\n" for line in report) + text)
    print("\n".join([*report, f"written: {options.output}"]))


def _check_outputs(options: argparse.Namespace) -> None:
    """Refuse to write over what is read, over a folder, or two things into one file."""
    places = {source.resolve() for source in options.sources}
    if options.board is not None:
        places.add(options.board.resolve())
    for name in ("output", "opencv"):
        path = getattr(options, name)
        if path is None:
            continue
        if path.is_dir() or not path.parent.is_dir():
            found = "a folder" if path.is_dir() else "a folder that is not there"
            raise ValueError(f"--{name}: expected a file, found {found}: {path}")
        if path.resolve() in places:
            raise ValueError(f"--{name}: expected a file of its own, found {path} in use already")
        places.add(path.resolve())


def _of_pictures(options: argparse.Namespace) -> _Found:
    from palpate.vision.board_pictures import read_pictures

    board = _board(options)
    if len(options.sources) == 2 and options.kind is None:
        raise ValueError("--kind: expected stereo or depth for two cameras, found none")
    if len(options.sources) == 1 and options.kind is not None:
        raise ValueError(f"--kind: expected none for one camera, found {options.kind}")
    seen = read_pictures(options.sources, board)
    return (_one if len(seen) == 1 else _two)(seen, board, options.kind)


def _one(seen: Sequence["BoardPictures"], board: "FlatBoard", kind: str | None) -> _Found:
    from palpate.vision.calibration import calibrate_camera
    from palpate.vision.calibration_verdict import camera_verdict
    from palpate.vision.camera import camera_block
    from palpate.vision.next_view import next_view

    (own,) = seen
    found = calibrate_camera(own.corners, board, own.size_px, name=str(own.folder))
    report = [*_lines(own, found), *_told(camera_verdict(found, board).lines)]
    report.append(f"next: {next_view(found, board)}")
    blocks = {"color": camera_block(found.camera, _encoding(own))}
    return _Found(report, blocks, [found.camera])


def _two(seen: Sequence["BoardPictures"], board: "FlatBoard", kind: str) -> _Found:
    from palpate.vision.calibration_verdict import camera_verdict, pair_verdict
    from palpate.vision.next_view import next_view
    from palpate.vision.pair_calibration import calibrate_pair

    pair = calibrate_pair(
        *(own.corners for own in seen),
        board,
        tuple(own.size_px for own in seen),
        names=tuple(str(own.folder) for own in seen),
    )
    report = []
    for own, found in zip(seen, pair.cameras, strict=True):
        report += [*_lines(own, found), *_told(camera_verdict(found, board).lines)]
    report += [*_pair_lines(pair), *_told(pair_verdict(pair).lines)]
    report.append(f"next: {next_view(pair, board)}")
    cameras = [found.camera for found in pair.cameras]
    lines, blocks = _blocks(cameras, pair.second_from_first, kind, _encoding(seen[0]))
    return _Found(report + lines, blocks, cameras, pair.second_from_first)


def _of_files(options: argparse.Namespace) -> _Found:
    """Blocks of another program's files, which state no standard errors."""
    from palpate.capture.importing.optics_files import read_optics
    from palpate.vision.camera import camera_block, camera_from_spec, stereo_blocks

    stated = read_optics(options.sources, options.size)
    names = ", ".join(map(str, options.sources))
    report = [f"{names}: as stated; standard errors are not"]
    cameras = [camera_from_spec(block) for block in stated.cameras]
    kind = options.kind
    if len(cameras) == 1:
        if kind is not None:
            raise ValueError(f"--kind: expected none for the one camera of {names}, found {kind}")
        return _Found(report, {"color": camera_block(cameras[0], "rgb8")}, cameras)
    if kind is None:
        raise ValueError("--kind: expected stereo or depth for two cameras, found none")
    if stated.rectified and kind == "stereo":
        block, baseline_m = stated.rectified
        camera = camera_from_spec(block)
        blocks = stereo_blocks(camera, baseline_m, "rgb8")
        return _Found([*report, _rectified_line()], blocks, cameras)
    if stated.second_from_first is None:
        raise ValueError(f"{names}: transform: expected one for --kind depth, found none")
    lines, blocks = _blocks(cameras, stated.second_from_first, kind, "rgb8")
    return _Found(report + lines, blocks, cameras, stated.second_from_first)


def _blocks(cameras: Sequence, second_from_first: Any, kind: str, encoding: str) -> tuple:
    from palpate.vision.camera import depth_blocks, rectified, stereo_blocks

    if kind == "depth":
        return [], depth_blocks(cameras, second_from_first, (encoding, "millimetre"))
    camera, baseline_m = rectified(cameras, second_from_first)
    return [_rectified_line()], stereo_blocks(camera, baseline_m, encoding)


def _rectified_line() -> str:
    return (
        "below is the camera of the rectified pictures (cv2.stereoRectify, alpha 0), which captures"
        " must hold: left and right have it alike, without distortion"
    )


def _write_opencv(path: Path, found: _Found) -> None:
    from palpate.capture.files import write_text
    from palpate.vision.camera import opencv_text

    if found.second_from_first is None:
        raise ValueError("--opencv: expected two cameras and their transform, found none")
    write_text(path, opencv_text(found.cameras, found.second_from_first))


def _board(options: argparse.Namespace) -> "FlatBoard":
    from palpate.vision.board import Board

    if options.board is not None:
        return _described(options)
    if options.inner_corners is None or options.square_mm is None:
        missing = "--inner-corners" if options.inner_corners is None else "--square-mm"
        raise ValueError(f"{missing}: expected the board's, found none")
    columns, rows = options.inner_corners
    if min(columns, rows) < 3:
        raise ValueError(f"--inner-corners: expected 3x3 or more, found {columns}x{rows}")
    if not 0 < options.square_mm <= MILLIMETRES:
        expected = f"above 0 and at most {MILLIMETRES:g}"
        raise ValueError(f"--square-mm: expected {expected}, found {options.square_mm:g}")
    return Board(columns, rows, options.square_mm / MILLIMETRES)


def _described(options: argparse.Namespace) -> "FlatBoard":
    """Board of a file with a block ``marker``."""
    from palpate.config.probe import TargetFile
    from palpate.vision.marker import board_of
    from palpate.yaml_files import load_yaml

    if options.inner_corners is not None or options.square_mm is not None:
        raise ValueError("--board: expected it alone, found --inner-corners or --square-mm beside")
    content = load_yaml(options.board)
    if isinstance(content, Mapping) and "marker" in content:
        content = {"marker": content["marker"]}
    TargetFile.read(content, str(options.board))
    return board_of(TargetFile.plain(content)["marker"])


def _encoding(own: "BoardPictures") -> str:
    return "rgb8" if own.coloured else "mono8"


def _lines(own: "BoardPictures", found: "Calibration") -> Iterator[str]:
    """What was found of one camera."""
    width, height = own.size_px
    views, pictures = len(found.errors_px), len(own.corners) + len(own.missing)
    yield f"{own.folder}: {width} x {height} pixels, {views} of {pictures} pictures count"
    optics = {name: getattr(found.camera, name) for name in ("fx_px", "fy_px", "cx_px", "cy_px")}
    yield f"  {', '.join(_value(n, v, found.standard_errors) for n, v in optics.items())} px"
    lens = dict(zip(("k1", "k2", "p1", "p2", "k3"), found.camera.distortion, strict=True))
    told = [_value(name, lens[name], found.standard_errors) for name in found.terms]
    yield f"  distortion: {', '.join(told) or 'none that the corners tell'}"
    yield f"  residual: {found.rms_px:.3f} px (root mean square)"
    for view, places in found.rejected_corners.items():
        numbers = ", ".join(str(place + 1) for place in places)
        some = f"{len(places)} corner{'s' * (len(places) > 1)}"
        yield f"  left out: {view}: {some} (number {numbers})"
    for view, reason in {**own.missing, **found.rejected}.items():
        yield f"  left out: {view}: {reason}"


def _value(name: str, value: float, errors: Mapping[str, float]) -> str:
    return f"{name.removesuffix('_px')} {sure(value, errors[name])}"


def _pair_lines(pair: "PairCalibration") -> Iterator[str]:
    """What was found of the transform."""
    from scipy.spatial.transform import Rotation

    known = pair.standard_errors
    turn = Rotation.from_matrix(pair.second_from_first[:3, :3]).as_rotvec()
    rows = {
        "baseline": ([pair.baseline_m], [pair.baseline_error_m], MILLIMETRES, "mm"),
        "translation": (
            pair.second_from_first[:3, 3], known["translation_m"], MILLIMETRES, "mm",
        ),
        "rotation": (turn, known["rotation_rad"], DEGREES, "degrees"),
    }  # fmt: skip
    yield f"second camera from the first, by {len(pair.errors_px)} pairs"
    for name, (values, errors, scale, unit) in rows.items():
        pairs = zip(values, errors, strict=True)
        yield f"  {name} {', '.join(sure(v * scale, e * scale) for v, e in pairs)} {unit}"
    yield f"  residual: {pair.rms_px:.3f} px (root mean square)"
    for view, reason in pair.rejected.items():
        yield f"  not of one moment: {view}: {reason}"


def _told(lines: Sequence[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)


def _sides(text: str) -> tuple[int, int]:
    """Two whole numbers as 9x6."""
    try:
        first, second = map(int, text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected two numbers as 9x6, found {text}") from None
    return first, second


def add(parts: Any) -> None:
    """Add the part to the command's."""
    verb = add_verb(
        parts, "camera", "optics of one camera or two", _camera, about=ABOUT, example=EXAMPLE
    )
    verb.add_argument("sources", nargs="+", type=Path, metavar="FOLDER", help="or a file")
    verb.add_argument("--inner-corners", type=_sides, metavar="9x6", help="of the checkerboard")
    verb.add_argument("--square-mm", type=float, help="side of its squares")
    verb.add_argument(
        "--board",
        type=Path,
        help="YAML with a block marker, as palpate board prints or a probe's file has",
    )
    verb.add_argument("--kind", choices=KINDS, help="of two cameras: what the second is for")
    verb.add_argument("--sensor", metavar="NAME", help="begin the file with this name")
    verb.add_argument("--size", type=_sides, metavar="640x480", help="of OpenCV files without one")
    verb.add_argument(
        "--opencv", type=Path, metavar="FILE", help="write a pair's M1 D1 M2 D2 R T, to rectify by"
    )
    verb.add_argument("--output", type=Path, metavar="FILE", help="write there, else print")
