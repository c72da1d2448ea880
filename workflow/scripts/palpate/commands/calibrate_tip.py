"""The command ``palpate calibrate tip``: where the ball is, of a handle turned about it."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.tables import FRAMES
from palpate.commands.help import add_verb
from palpate.commands.rig import (
    TRANSFORMS,
    add_film,
    check_output,
    poses_of,
    sensor_file,
    sure,
    write_json,
)
from palpate.units import MILLIMETRES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from palpate.vision.pivot import Pivot

ABOUT = """\
Find where the centre of the ball is in the frame of the probe's board: rest the ball in a dimple,
film the board, and lean the handle by 30 degrees to all sides, for 200 frames.
It takes a film (a folder with frames.csv) with the files of the sensor and of the board or probe;
a table of poses as probe_pose.csv has them (marker_qx, marker_qy, marker_qz, marker_qw,
marker_x_m, marker_y_m, marker_z_m, camera from board); or a folder of text files with a matrix of
4 x 4 numbers in each. Frames that are off are named and left out.
"""
EXAMPLE = "palpate calibrate tip pivot --sensor sensors/d435.yaml --board probes/ball.yaml"


def _tip(options: argparse.Namespace) -> None:
    """Print what was found, and write it."""
    from palpate.vision.pivot_json import force_from_tip, pivot_fields

    check_output(options.output, options.source)
    _check_unit(options)
    names, poses, lost, probe = poses_of(options)
    try:
        found = _found(options, names, poses, probe)
    except ValueError as error:
        raise ValueError(f"{options.source}: {error}") from None
    print("\n".join([*_lines(options.source, found, names, lost), *_doubts(found, probe)]))
    if "marker_from_force" in probe:
        print("\n".join(_blocks(found, force_from_tip(probe["marker_from_force"], found.tip_m))))
    if options.output is not None:
        write_json(options.output, pivot_fields(found, names, probe.get("probe")))


def _check_unit(options: argparse.Namespace) -> None:
    """Refuse a unit of what states its own."""
    film = (options.source / FRAMES).is_file()
    if options.unit != "m" and (film or options.source.is_file()):
        expected = "one for text files alone (a table's columns say theirs, a film has metres)"
        raise ValueError(f"--unit: expected {expected}, found {options.unit}")


def _found(
    options: argparse.Namespace, names: Sequence[str], poses: "NDArray", probe: Mapping
) -> "Pivot":
    """The tip; of poses that others found nothing is known of their optics."""
    from palpate.vision.filmed_pivot import filmed_pivot
    from palpate.vision.marker import board_of
    from palpate.vision.pivot import find_pivot

    if not (options.source / FRAMES).is_file():
        return find_pivot(poses, names)
    return filmed_pivot(
        poses, names, board_of(probe["marker"]), sensor_file(options.sensor)["color"]
    )


def _lines(
    source: Path, found: "Pivot", names: Sequence[str], lost: Sequence[str]
) -> Iterator[str]:
    from palpate.vision.pivot_json import left_out, optics_std_m, verdict

    turn = ", ".join(f"{value:.1f}" for value in found.turn_deg)
    pairs = zip(found.tip_m * MILLIMETRES, found.std_m * MILLIMETRES, strict=True)
    yield f"{source}: {len(names)} poses, {found.kept.sum()} count"
    yield f"  tip {', '.join(sure(*pair) for pair in pairs)} mm in the board's frame"
    yield f"  turned by {turn} degrees (root mean square, of three directions)"
    yield f"  residual: {found.rms_m * MILLIMETRES:.3f} mm (root mean square)"
    if found.optics_covariance is None:
        yield "  not in the deviations: what the camera's optics are wrong by, which no pose tells"
    else:
        optics_mm = optics_std_m(found) * MILLIMETRES
        yield f"  of the deviations, what the camera's optics are wrong by: {optics_mm:.2g} mm"
    if lost:
        yield f"  left out, since the tracker lost its target: {', '.join(lost)}"
    for name, off_m in left_out(found, names).items():
        yield f"  left out: {name}: {off_m * MILLIMETRES:.1f} mm off"
    yield f"  {verdict(found)}"


def _doubts(found: "Pivot", probe: Mapping) -> Iterator[str]:
    """Where the probe's file has the tip elsewhere."""
    import numpy as np

    from palpate.vision.pivot_json import FARTHEST_M
    from palpate.vision.probe import marker_from_tip

    if not all(key in probe for key in TRANSFORMS):
        return
    away_m = float(np.linalg.norm(found.tip_m - marker_from_tip(probe)[:3, 3]))
    if away_m > FARTHEST_M:
        yield (
            f"  doubtful: {away_m * MILLIMETRES:.0f} mm from where the file has it"
            " (force_from_tip): another probe's file or board, or poses of another frame?"
        )


def _blocks(found: "Pivot", transform: Sequence) -> Iterator[str]:
    """Blocks for the probe's file."""
    yield "force_from_tip:"
    yield from (f"  - [{', '.join(f'{value:.6f}' for value in row)}]" for row in transform)
    yield "tip_covariance_m2:"
    yield from (f"  - [{', '.join(f'{value:.4e}' for value in row)}]" for row in found.covariance)


def add(parts: Any) -> None:
    """Add the part to the command's."""
    verb = add_verb(
        parts, "tip", "where the ball is on the probe", _tip, about=ABOUT, example=EXAMPLE
    )
    add_film(verb)
    verb.add_argument("--unit", choices=("m", "cm", "mm"), default="m", help="of text files")
    verb.add_argument("--output", type=Path, metavar="FILE", help="write tip.json there too")
