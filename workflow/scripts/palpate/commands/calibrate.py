"""The command ``palpate calibrate``: the rig's cameras, and the probe by itself."""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import degrees, isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from palpate.capture.curves.columns import DEPTH, FORCE, column_of, numbers_of
from palpate.capture.curves.export import read_export
from palpate.capture.devices import read_device
from palpate.capture.discover import BACKGROUND
from palpate.capture.experiments import check_hand_eye, check_pivot, check_with_force, read_marker
from palpate.capture.files import write_json
from palpate.capture.poses import POSES
from palpate.capture.tables import FRAMES, read_force
from palpate.commands import calibrate_camera
from palpate.commands.help import add_columns, add_verb, all_sure, check_outputs, stage, sure
from palpate.config.model import FILL_IN, blank_fields
from palpate.config.probe import ProbeSpec
from palpate.units import MILLIMETRES, MILLINEWTONS
from palpate.vision import probe_recordings
from palpate.vision.calibrated_probe import FARTHEST_M, with_tip_at
from palpate.vision.compliance import Compliance, digits, find_compliance, recorded_press
from palpate.vision.follow import board_followed
from palpate.vision.hand_eye import recorded_hand_eye
from palpate.vision.marker import board_of
from palpate.vision.options import Force, ProbePose
from palpate.vision.payload import BIAS_N, BIAS_NM, CENTRE, Payload, find_payload
from palpate.vision.pivot import Pivot, find_pivot
from palpate.vision.probe import marker_from_tip, marker_transforms
from palpate.yaml_files import load_yaml

TIP = """\
Find where the centre of the ball is in the frame of the probe's target: rest the ball in a dimple,
record the target, and tilt the handle by 30 degrees to all sides, for 200 frames.
It takes a recording (a folder with frames.csv, and --sensor and --board; or with probe_poses.csv of
a robot or a tracker, which needs neither), a table of poses (marker_qx, marker_qy, marker_qz,
marker_qw, marker_x_m, marker_y_m, marker_z_m: camera from target), or a folder of text files with a
matrix of 4 x 4 numbers in each, likewise. Frames that are off are named and left out.
"""
LOAD = """\
Find mass and centre of mass of the force sensor's payload, its offsets, and how it is turned
against the probe's target: hold the probe free in the air for two seconds each in twelve poses, tip
down, up, level to four sides and between. A pose in which something else touches the probe is
named and left out.
It takes a recording (a folder with frames.csv or probe_poses.csv, and force.csv), or a table with a
row for each pose: marker_qx, marker_qy, marker_qz, marker_qw and fx_n, fy_n, fz_n, tx_nm, ty_nm,
tz_nm. The vertical is that of the table that a recording's background/ shows, z of the base frame
of probe_poses.csv, or --up.
"""
STIFFNESS = """\
Find the probe's compliance between target and ball, along its axis: press the ball on something
rigid, a steel block on a table, slowly to 5 N and back within ten seconds.
It takes a recording (a folder with frames.csv or probe_poses.csv, and force.csv), or a table in the
order of time, as palpate hertz reads curves: how far the tip went along the probe's axis by the
target's poses (depth_m, growing in the indentation, from any offset), and the force along it
(force_n) at the same moments.
"""
HAND_EYE = """\
Find where a camera that stands is in the base frame of a robot or a tracker: fix a target to the
flange or to what is tracked, and record it in twelve poses or more, at rest or moving slowly, that
tilt by 30 degrees to all sides. It takes a recording with frames.csv, images and probe_poses.csv,
and the files of the sensor and of the target (target.yaml in the recording, or --board).
"""
# Of a probe's file, beside its target.
TRANSFORMS = ("marker_from_force", "force_from_tip")
# What is printed after the source's name, and what is written.
Found = tuple[list[str], dict]


def _calibrate(part: Callable[..., Found], options: argparse.Namespace) -> None:
    """Print what was found of a part; write a JSON file whole or not at all, and say so."""
    output, source = options.output, options.source
    check_outputs({"output": output}, [source])
    if not source.exists():
        expected = "a recording, a table or a folder" if part is _tip else "a recording or a table"
        raise ValueError(f"{source}: source: expected {expected}, found none")
    recorded = any((source / name).is_file() for name in (FRAMES, POSES))
    if part is not _tip and source.is_dir() and not recorded:
        raise ValueError(f"{source}: frames.csv: expected a recording's, found none")
    files = [str(value) for value in vars(options).values() if isinstance(value, Path)]
    try:
        with stage(f"{source}: poses and fit"):
            lines, fields = part(options, _probe(options))
    except ValueError as error:
        # What begins with an option or a file is named already.
        if str(error).startswith(("--", *(f"{file}{mark}" for file in files for mark in ":/"))):
            raise
        raise ValueError(f"{source}: {error}") from None
    print(f"{source}: " + "\n".join(lines))
    if output is not None:
        write_json(output, fields)
        print(f"written: {output}")


def _tip(options: argparse.Namespace, probe: Mapping) -> Found:
    source, lost, optics = options.source, [], ()
    tracked = (source / POSES).is_file()
    recorded = tracked or (source / FRAMES).is_file()
    if options.unit != "m" and (recorded or source.is_file()):
        expected = "one for text files alone (a table's columns say theirs, a recording has metres)"
        raise ValueError(f"--unit: expected {expected}, found {options.unit}")
    if recorded:
        table = _recording(options, probe, check_pivot)
        names, poses = [f"frame {k}" for k in table["frame"]], marker_transforms(table)
        optics = () if tracked else (board_of(probe["marker"]), _sensor(options)["color"])
    else:
        names, poses, lost = probe_recordings.stated_poses(source, options.unit)
    found = find_pivot(poses, names, *optics, by_camera=not tracked)
    return [*_tip_report(names, lost, found, probe)], found.fields(names, probe.get("probe"))


def _tip_report(names: Sequence, lost: Sequence, found: Pivot, probe: Mapping) -> Iterator[str]:
    """What was found; a warning where the probe's file has the tip elsewhere; blocks for it."""
    turn = ", ".join(f"{value:.1f}" for value in found.turn_deg)
    yield f"{len(names)} poses, {found.kept.sum()} count"
    yield f"  tip {all_sure(found.tip_m, found.std_m, MILLIMETRES)} mm in the board's frame"
    yield f"  turned by {turn} degrees (root mean square, of three directions)"
    yield f"  residual: {found.rms_m * MILLIMETRES:.3f} mm (root mean square)"
    if found.optics_covariance is None:
        yield "  not in the deviations: errors of the camera's optics, which no pose determines"
    else:
        optics_mm = found.optics_std_m * MILLIMETRES
        yield f"  of the deviations, what the camera's optics are wrong by: {optics_mm:.2g} mm"
    if lost:
        yield f"  left out, since the tracker lost its target: {', '.join(lost)}"
    for name, off_m in found.left_out(names).items():
        yield f"  left out: {name}: {off_m * MILLIMETRES:.1f} mm off"
    yield f"  {found.verdict}"
    if all(key in probe for key in TRANSFORMS):
        away_m = float(np.linalg.norm(found.tip_m - marker_from_tip(probe)[:3, 3]))
        if away_m > FARTHEST_M:
            away = f"{away_m * MILLIMETRES:.0f} mm from where the file has it (force_from_tip)"
            hint = "another probe's file or board, or poses of another frame?"
            yield f"  warning: {away}: {hint}"
    if "marker_from_force" in probe:
        transform = with_tip_at(probe | {"force_from_tip": np.eye(4)}, found.tip_m)
        yield from _block("force_from_tip", transform["force_from_tip"], ".6f")
        yield from _block("tip_covariance_m2", found.covariance, ".4e")


def _load(options: argparse.Namespace, probe: Mapping) -> Found:
    source, up = options.source, _up(options)
    if source.is_dir():
        table = _recording(options, probe, check_with_force)
        poses = probe_recordings.static_poses(table, read_force(source), probe)
    else:
        poses = probe_recordings.stated_static_poses(source)
    found = find_payload(poses, up)
    lines = [*_load_report(poses.names, found, probe.get("marker_from_force"))]
    return lines, found.fields(poses.names, probe.get("probe"))


def _load_report(names: Sequence, found: Payload, stated: Sequence | None) -> Iterator[str]:
    """What was found; blocks for the probe's file, whose transform has the sensor's place."""
    std, bias = found.std, found.bias
    centre = all_sure(found.centre_of_mass_m, std[CENTRE], MILLIMETRES)
    yield f"{len(names)} poses, {found.kept.sum()} count"
    yield f"  mass {sure(found.mass_kg * 1e3, std[0] * 1e3)} g"
    yield f"  centre of mass {centre} mm in the sensor's frame"
    yield f"  zero {all_sure(bias[:3], std[BIAS_N], 1)} N"
    yield f"  zero {all_sure(bias[3:], std[BIAS_NM], MILLINEWTONS)} mNm"
    square = (found.residuals[found.kept] ** 2).reshape(-1, 2, 3)
    off = np.sqrt(square.mean(axis=(0, 2))) * MILLINEWTONS
    yield f"  residual: {off[0]:.2g} mN, {off[1]:.2g} mNm (root mean square)"
    for name, (force_n, torque_nm) in found.left_out(names).items():
        off = f"{force_n * MILLINEWTONS:.1f} mN and {torque_nm * MILLINEWTONS:.2g} mNm off"
        yield f"  left out: {name}: {off}"
    if stated is not None:
        turn = found.marker_from_force.T @ np.array(stated, dtype=float)[:3, :3]
        apart = f"{degrees(Rotation.from_matrix(turn).magnitude()):.2f} degrees"
        yield f"  the sensor is turned by {apart} against the file's marker_from_force"
    yield from (f"  {line}" for line in found.verdict)
    centre = ", ".join(f"{value:.5f}" for value in found.centre_of_mass_m)
    yield from ("load:", f"  mass_kg: {found.mass_kg:.5f}", f"  mass_std_kg: {std[0]:.1e}")
    yield f"  centre_of_mass_m: [{centre}]"
    yield "marker_from_force: # the rotation is found, the last column is the sensor's place"
    places = [FILL_IN] * 3 if stated is None else [f"{row[3]:.9f}" for row in stated[:3]]
    for row, place in zip(found.marker_from_force, places, strict=True):
        yield f"  - [{', '.join(f'{value:.9f}' for value in row)}, {place}]"
    yield "  - [0.0, 0.0, 0.0, 1.0]"
    yield f"axes_std_rad: {found.axes_std_rad:.1e} # the table is level to 0.5 degrees"


def _hand_eye(options: argparse.Namespace, probe: Mapping) -> Found:
    source, sensor = options.source, _sensor(options)
    if lines := check_hand_eye(source, sensor, has_target="marker" not in probe):
        raise ValueError("\n".join(lines))
    found = recorded_hand_eye(source, sensor, probe.get("marker") or read_marker(source))
    clock = sure(found.clock_offset_s * 1e3, found.clock_offset_std_s * 1e3)
    std_m = np.sqrt(np.diag(found.covariance)[3:])
    shift = all_sure(found.camera_from_base[:3, 3], std_m, MILLIMETRES)
    turn = ", ".join(f"{value:.1f}" for value in found.turn_deg)
    lines = [
        f"{found.poses} poses, {found.poses - len(found.left_out_m)} count",
        f"  base {shift} mm in the camera's frame",
        f"  turned by {turn} degrees (root mean square, of three directions)",
        f"  residual: {found.residual_px:.2f} px (root mean square, errors of the poses included)",
        f"  the poses' clock is {clock} ms ahead of the camera's",
        *(f"  left out: {k}: {v * MILLIMETRES:.1f} mm off" for k, v in found.left_out_m.items()),
        *(f"  warning: {line}" for line in found.warnings),
        f"  {found.verdict}",
        "base:",
        *_block("camera_from_base", found.camera_from_base, ".9f", "  "),
        *_block("covariance", found.covariance, ".4e", "  "),
    ]
    return lines, found.fields(sensor["sensor"])


def _stiffness(options: argparse.Namespace, probe: Mapping) -> Found:
    source, warned = options.source, ()
    if source.is_dir():
        if missing := [key for key in TRANSFORMS if probe and key not in probe]:
            raise ValueError(f"{options.board}: {missing[0]}: expected the probe's, found none")
        table = _recording(options, probe, check_with_force)
        read = f"{len(table)} poses"
        columns = recorded_press(table, read_force(source), probe, Force())
    else:
        # A curve's signs are found by its shape; a way that is all noise has none.
        export = read_export(source)
        way = column_of(export, DEPTH, options.depth_column, options.depth_unit)
        force = column_of(export, FORCE, options.force_column, options.force_unit)
        columns, left_out = numbers_of([way.values, force.values])
        read = ", ".join([*export.read, way.text, force.text])
        read += f", {left_out} rows without a number left out" if left_out else ""
        warned = (*export.warnings, *way.warnings, *force.warnings)
    found = find_compliance(*columns)
    return [*_stiffness_report(read, warned, found)], found.fields(probe.get("probe"))


def _stiffness_report(read: str, warned: Sequence[str], found: Compliance) -> Iterator[str]:
    low, high = found.force_n
    yield f"{found.samples} samples in contact, {low:.2g} to {high:.2g} N"
    yield f"  read: {read}"
    pairs = (found.compliance_m_n, found.compliance_std_m_n), found.bow_m, found.gap_m
    way, bow, gap = (sure(value * MILLIMETRES, error * MILLIMETRES) for value, error in pairs)
    yield f"  gives way by {way} mm per newton"
    yield f"  bows by {bow} mm"
    alone = "  loading or unloading alone: whether they are alike is not determined"
    yield f"  unloading lies {gap} mm from loading" if isfinite(found.gap_m[0]) else alone
    yield f"  residual: {round(found.rms_m * MILLIMETRES, 5):.2g} mm (root mean square)"
    yield f"  {found.verdict}"
    yield from (f"  warning: {line}" for line in warned)
    # Of a probe that is stiffer than is determined the deviation alone.
    if found.determined:
        yield f"stiffness_n_m: {digits(found.stiffness_n_m, 3)}"
    yield f"compliance_std_m_n: {found.file_std_m_n:.1e}"


def _probe(options: argparse.Namespace) -> Mapping:
    """A file with a block ``marker`` or ``tracked``; name, transforms, ``gauge`` if filled in."""
    from palpate.workflow.options import partly

    if (path := options.board) is None:
        return {}
    if not isinstance(content := load_yaml(path), Mapping):
        raise ValueError(f"{path}: content: expected a block marker, found none")
    known = ("probe", "tracked", *TRANSFORMS, "gauge")
    filled = {k: content[k] for k in known if k in content and not blank_fields(content[k])}
    shown = "marker" in content or "tracked" not in content
    target = calibrate_camera.target_of(content, path) if shown else {}
    partly(ProbeSpec).read(filled, str(path))
    return target | filled


def _sensor(options: argparse.Namespace) -> Mapping:
    """The sensor of a recording, whose optics are stated."""
    if (path := options.sensor) is None:
        raise ValueError(f"--sensor: expected the file of what {options.source} shows, found none")
    spec, wrong = read_device(path, "sensors")
    if not wrong and spec.get("optics") == "calibration":
        expected = "stated optics (a run calibrates them and the tip together)"
        wrong = [f"{path}: optics: expected {expected}, found calibration"]
    if wrong:
        raise ValueError("\n".join(wrong))
    return spec


def _recording(options: argparse.Namespace, probe: Mapping, check: Callable) -> pd.DataFrame:
    """Poses of the target in a recording's frames that show it, or those of a robot's record."""
    source, tracked = options.source, (options.source / POSES).is_file()
    sensor = {} if tracked else _sensor(options)
    if not tracked and "marker" not in probe:
        raise ValueError(f"--board: expected the file of what {source} shows, found none")
    if lines := check(source, sensor):
        raise ValueError("\n".join(lines))
    if tracked:
        return probe_recordings.tracked_table(source, probe)
    return board_followed(source, sensor, probe["marker"], ProbePose())


def _up(options: argparse.Namespace) -> NDArray:
    """Upwards, in the frame of the poses: the camera's, or their base, (3,)."""
    if (up := options.up) is not None:
        if not (np.isfinite(up).all() and np.linalg.norm(up) > 0):
            raise ValueError(f"--up: expected a direction, found {up}")
        return np.array(up)
    if (options.source / POSES).is_file():
        return probe_recordings.BASE_UP
    empty = options.source / BACKGROUND
    if not empty.is_dir():
        raise ValueError("--up: expected it, or a recording with background/, found none")
    from palpate.vision.clouds import table_of
    from palpate.workflow.options import Config

    config = Config()
    return table_of(empty, _sensor(options), config.support_plane, seed=config.seed)[:3]


def _block(name: str, matrix: Sequence, form: str, indent: str = "") -> Iterator[str]:
    """A matrix as YAML, row by row."""
    yield f"{indent}{name}:"
    yield from (f"{indent}  - [{', '.join(f'{x:{form}}' for x in row)}]" for row in matrix)


def add(commands: Any) -> None:
    """Add the command to a parser's, its parts in the order in which a person needs them."""
    about = "Measure the rig itself: its cameras, the probe's tip, its load and stiffness."
    short = "measure the rig: cameras, probe"
    verb = commands.add_parser("calibrate", help=short, description=about)
    parts = verb.add_subparsers(required=True, metavar="part", title="parts")
    calibrate_camera.add(parts)
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("source", type=Path, metavar="SOURCE", help="recording, table or folder")
    shared.add_argument("--sensor", type=Path, metavar="FILE", help="sensor's YAML, for images")
    shared.add_argument("--board", type=Path, metavar="FILE", help=calibrate_camera.BOARD_HELP)
    shared.add_argument("--output", type=Path, metavar="FILE", help="write a JSON file there too")
    part = partial(add_verb, parts, parents=[shared])
    tip = part("tip", "where the ball is on the probe", partial(_calibrate, _tip), about=TIP,
        example="palpate calibrate tip pivot --sensor sensors/d435.yaml --board probes/ball.yaml",
    )  # fmt: skip
    tip.add_argument("--unit", choices=("m", "cm", "mm"), default="m", help="of text files")
    load = part("load", "payload of the force sensor", partial(_calibrate, _load), about=LOAD,
        example="palpate calibrate load poses.csv --up 0 -0.7 -0.7 --board probes/ball.yaml",
    )  # fmt: skip
    up = "upwards, in the camera's frame (x right, y down, z away) or that of probe_poses.csv"
    load.add_argument("--up", nargs=3, type=float, metavar=("X", "Y", "Z"), help=up)
    part("hand-eye", "a camera in a robot's base frame", partial(_calibrate, _hand_eye),
        about=HAND_EYE, example="palpate calibrate hand-eye hand_eye --sensor sensors/d435.yaml",
    )  # fmt: skip
    stiffness = part("stiffness", "what the probe gives way by", partial(_calibrate, _stiffness),
        about=STIFFNESS, example="palpate calibrate stiffness press.csv")  # fmt: skip
    add_columns(stiffness)
