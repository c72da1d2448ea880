"""The commands ``palpate calibrate tip``, ``load`` and ``stiffness``: the probe by itself."""

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import degrees, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from palpate.capture.discover import BACKGROUND
from palpate.capture.tables import FRAMES
from palpate.commands.help import add_columns, add_verb, sure
from palpate.config.model import FILL_IN
from palpate.units import MILLIMETRES, MILLINEWTONS

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from pandas import DataFrame

    from palpate.vision.bending import Bending
    from palpate.vision.load import Load
    from palpate.vision.pivot import Pivot
    from palpate.vision.rests import Rests

TIP = """\
Find where the centre of the ball is in the frame of the probe's board: rest the ball in a dimple,
film the board, and lean the handle by 30 degrees to all sides, for 200 frames.
It takes a film (a folder with frames.csv) with the files of the sensor and of the board or probe;
a table of poses as probe_pose.csv has them (marker_qx, marker_qy, marker_qz, marker_qw,
marker_x_m, marker_y_m, marker_z_m, camera from board); or a folder of text files with a matrix of
4 x 4 numbers in each. Frames that are off are named and left out.
"""
LOAD = """\
Find mass and centre of mass of what hangs on the force sensor, its zeros, and how it is turned
against the probe's board: hold the probe free in the air for two seconds each in twelve poses, tip
down, up, level to four sides and between, and film the board. A pose in which something else
touches the probe is named and left out.
It takes a film (a folder with frames.csv and force.csv) with the files of sensor and probe, or a
table with a row for each pose: the board's rotation as probe_pose.csv has it (marker_qx,
marker_qy, marker_qz, marker_qw) and the mean wrench (fx_n, fy_n, fz_n, tx_nm, ty_nm, tz_nm).
The vertical is the table's that a film's background/ shows or a support_plane.json states
(--plane), or given in the camera's frame (--up), whose x points right, y down and z away.
"""
STIFFNESS = """\
Find what the probe gives way by between its board and its ball, along its axis: press the ball on
something rigid, a steel block on a table, slowly to 5 N and back within ten seconds.
It takes a film (a folder with frames.csv and force.csv) with the files of sensor and probe, or a
table in the order of time, as palpate hertz reads curves: how far the tip went along the probe's
axis by the board's poses (depth_m, growing in the press, from any zero), and the force along it
(force_n), at the same moments. Units stand in the names of the columns, or are said.
"""
# Of a probe's file, beside its board.
TRANSFORMS = ("marker_from_force", "force_from_tip")
Found = TypeVar("Found")


def _tip(options: argparse.Namespace) -> None:
    """Print where the tip is, and write it."""
    from palpate.vision.filmed_pivot import filmed_pivot
    from palpate.vision.marker import board_of
    from palpate.vision.pivot import find_pivot
    from palpate.vision.pivot_json import force_from_tip, pivot_fields
    from palpate.vision.pose_files import read_poses
    from palpate.vision.probe import marker_transforms

    _check_output(options)
    source, lost = options.source, []
    film = (source / FRAMES).is_file()
    if options.unit != "m" and (film or source.is_file()):
        expected = "one for text files alone (a table's columns say theirs, a film has metres)"
        raise ValueError(f"--unit: expected {expected}, found {options.unit}")
    _check_source(source, "a film, a table or a folder")
    probe = _probe(options)
    if film:
        table, sensor = _film(options, probe, force=False)
        names, poses = [f"frame {k}" for k in table["frame"]], marker_transforms(table)
        board = board_of(probe["marker"])
        found = _named(source, lambda: filmed_pivot(poses, names, board, sensor["color"]))
    else:
        names, poses, lost = read_poses(source, options.unit)
        found = _named(source, lambda: find_pivot(poses, names))
    lines = [*_tip_lines(source, found, names, lost), *_tip_doubts(found, probe)]
    if "marker_from_force" in probe:
        transform = force_from_tip(probe["marker_from_force"], found.tip_m)
        lines += _rows("force_from_tip:", transform, ".6f")
        lines += _rows("tip_covariance_m2:", found.covariance, ".4e")
    _tell(options, lines, pivot_fields(found, names, probe.get("probe")))


def _load(options: argparse.Namespace) -> None:
    """Print what hangs on the sensor and how it sits, and write it."""
    from palpate.vision.load import find_load
    from palpate.vision.load_json import load_fields

    _check_output(options)
    _check_source(options.source, "a film or a table")
    probe = _probe(options)
    up, rests = _up(options), _rests(options, probe)
    found = _named(
        options.source,
        lambda: find_load(rests.turns, rests.wrench, up, rests.noise, rests.names),
    )
    lines = [*_load_lines(options.source, found, rests.names, probe), *_load_blocks(found, probe)]
    _tell(options, lines, load_fields(found, rests.names, probe.get("probe")))


def _stiffness(options: argparse.Namespace) -> None:
    """Print what the probe gives way by, and write it."""
    from palpate.vision.bending import find_bending
    from palpate.vision.bending_json import bending_fields, digits

    _check_output(options)
    if not (isfinite(options.contact_n) and options.contact_n >= 0):
        raise ValueError(f"--contact-n: expected 0 or more, found {options.contact_n:g}")
    _check_source(options.source, "a film or a table")
    probe = _probe(options)
    of_film = options.source.is_dir()
    read, doubts, columns = _press(options, probe) if of_film else _columns(options)
    found = _named(options.source, lambda: find_bending(*columns, contact_n=options.contact_n))
    lines = [*_stiffness_lines(options.source, read, found)]
    lines += [f"  doubtful: {line}" for line in doubts]
    # Of a probe that is stiffer than is told the deviation alone.
    lines += [f"stiffness_n_m: {digits(found.stiffness_n_m, 3)}"] if found.told else []
    lines.append(f"compliance_std_m_n: {found.file_std_m_n:.1e}")
    _tell(options, lines, bending_fields(found, probe.get("probe")))


def _named(source: Path, work: Callable[[], Found]) -> Found:
    """Name the source in what is wrong with it."""
    try:
        return work()
    except ValueError as error:
        said = str(error).startswith(str(source))
        raise ValueError(f"{'' if said else f'{source}: '}{error}") from None


def _tell(options: argparse.Namespace, lines: Sequence[str], fields: Mapping[str, Any]) -> None:
    """Print what was found; write a JSON file whole or not at all, and say so."""
    from palpate.capture.files import write_text

    print("\n".join(lines))
    if options.output is not None:
        write_text(options.output, json.dumps(fields, indent=1) + "\n")
        print(f"written: {options.output}")


def _check_output(options: argparse.Namespace) -> None:
    """Reject what would be written over what is read, or over a folder."""
    output = options.output
    if output is None:
        return
    if output.is_dir() or not output.parent.is_dir():
        found = "a folder" if output.is_dir() else "a folder that is not there"
        raise ValueError(f"--output: expected a file, found {found}: {output}")
    if output.resolve() == options.source.resolve():
        raise ValueError(f"--output: expected a file of its own, found {output} in use already")


def _check_source(source: Path, expected: str) -> None:
    """Reject what is not there, before asking for what belongs to it."""
    if not source.exists():
        raise ValueError(f"{source}: source: expected {expected}, found none")
    if "folder" not in expected and source.is_dir() and not (source / FRAMES).is_file():
        raise ValueError(f"{source}: frames.csv: expected a film's, found none")


def _probe(options: argparse.Namespace) -> Mapping:
    """A file with a block ``marker``; name, transforms and ``gauge`` where filled in."""
    from palpate.config.model import blank_fields, problems
    from palpate.config.probe import ProbeSpec, TargetFile
    from palpate.workflow.options import partly
    from palpate.yaml_files import load_yaml

    path = options.board
    if path is None:
        return {}
    content = load_yaml(path)
    if not isinstance(content, Mapping):
        raise ValueError(f"{path}: content: expected a block marker, found none")
    board = {"marker": content["marker"]} if "marker" in content else dict(content)
    TargetFile.read(board, str(path))
    filled = {
        key: content[key]
        for key in ("probe", *TRANSFORMS, "gauge")
        if key in content and not blank_fields(content[key])
    }
    if lines := problems(partly(ProbeSpec), filled, str(path)):
        raise ValueError("\n".join(lines))
    return TargetFile.plain(board) | filled


def _sensor(options: argparse.Namespace) -> Mapping:
    """The sensor of a film, whose optics are stated."""
    from palpate.capture.devices import read_device

    path = options.sensor
    if path is None:
        expected = f"the file of what {options.source} shows"
        raise ValueError(f"--sensor: expected {expected}, found none")
    spec, wrong = read_device(path, "sensors")
    if wrong:
        raise ValueError("\n".join(wrong))
    if spec.get("optics") == "calibration":
        expected = "stated optics (a run calibrates them and the tip together)"
        raise ValueError(f"{path}: optics: expected {expected}, found calibration")
    return spec


def _film(
    options: argparse.Namespace, probe: Mapping, *, force: bool
) -> tuple["DataFrame", Mapping]:
    """Poses of the board in the frames of a film that show it, and the sensor's file."""
    from palpate.capture.check_capture import check_capture
    from palpate.capture.experiments import check_film
    from palpate.vision.follow import board_followed
    from palpate.vision.options import ProbePose

    source, sensor = options.source, _sensor(options)
    if not probe:
        raise ValueError(f"--board: expected the file of what {source} shows, found none")
    if lines := (check_capture if force else check_film)(source, sensor):
        raise ValueError("\n".join(lines))
    work = lambda: board_followed(source, sensor, probe["marker"], ProbePose())  # noqa: E731
    return _named(source, work), sensor


def _up(options: argparse.Namespace) -> "NDArray":
    """Upwards, camera frame, (3,)."""
    import numpy as np

    from palpate.vision.clouds import table_of
    from palpate.vision.support_plane import read_plane
    from palpate.workflow.options import Config

    empty = options.source / BACKGROUND
    if options.up is None and options.plane is None and empty.is_dir():
        config = Config()
        return table_of(empty, _sensor(options), config.support_plane, seed=config.seed)[:3]
    if (options.up is None) == (options.plane is None):
        found = "none" if options.up is None else "both"
        raise ValueError(f"--up: expected it or --plane, found {found}")
    if options.plane is not None:
        if not options.plane.is_file():
            raise ValueError(f"--plane: expected a file, found nothing at {options.plane}")
        return read_plane(options.plane)[:3]
    up = np.array(options.up)
    if not (np.isfinite(up).all() and np.linalg.norm(up) > 0):
        raise ValueError(f"--up: expected a direction, found {options.up}")
    return up


def _rests(options: argparse.Namespace, probe: Mapping) -> "Rests":
    """Poses at rest of a film, or the rows of a table."""
    from palpate.capture.tables import WRENCH_COLUMNS, columns_of, read_force, read_table
    from palpate.vision.pose_files import turns_of
    from palpate.vision.rests import Rests, film_rests

    source = options.source
    if source.is_dir():
        table, _ = _film(options, probe, force=True)
        return _named(source, lambda: film_rests(table, read_force(source), probe))
    table = read_table(source)
    rows = [f"row {k}" for k in range(1, len(table) + 1)]
    return _named(
        source, lambda: Rests(rows, turns_of(table), columns_of(table, WRENCH_COLUMNS), None)
    )


def _press(
    options: argparse.Namespace, probe: Mapping
) -> tuple[str, tuple[str, ...], Sequence["NDArray"]]:
    """What was read of a film, no doubts, way [m] and force [N]."""
    from palpate.capture.tables import read_force
    from palpate.vision.options import Force
    from palpate.vision.rigid_press import way_and_force

    for key in TRANSFORMS if probe else ():
        if key not in probe:
            raise ValueError(f"{options.board}: {key}: expected the probe's, found none")
    source, contact = options.source, {"contact_n": options.contact_n}
    table, _ = _film(options, probe, force=True)
    columns = _named(
        source, lambda: way_and_force(table, read_force(source), probe, Force(), **contact)
    )
    return f"{len(table)} frames that show the board", (), columns


def _columns(options: argparse.Namespace) -> tuple[str, tuple[str, ...], Sequence["NDArray"]]:
    """How the table was read, doubts of that, way [m] and force [N] with the table's signs.

    A curve's signs are found by its shape; a way that is all noise has none.
    """
    from palpate.capture.curves.columns import DEPTH, FORCE, column_of, numbers_of
    from palpate.capture.curves.export import read_export

    export = read_export(options.source)
    way = column_of(export, DEPTH, options.depth_column, options.depth_unit)
    force = column_of(export, FORCE, options.force_column, options.force_unit)
    columns, left_out = numbers_of([way.values, force.values])
    read = [*export.read, way.text, force.text]
    read += [f"{left_out} rows without a number left out"] if left_out else []
    return ", ".join(read), (*export.doubts, *way.doubts, *force.doubts), columns


def _tip_lines(
    source: Path, found: "Pivot", names: Sequence[str], lost: Sequence[str]
) -> Iterator[str]:
    from palpate.vision.pivot_json import left_out, optics_std_m, verdict

    turn = ", ".join(f"{value:.1f}" for value in found.turn_deg)
    yield f"{source}: {len(names)} poses, {found.kept.sum()} count"
    yield f"  tip {_sure(found.tip_m, found.std_m, MILLIMETRES)} mm in the board's frame"
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


def _tip_doubts(found: "Pivot", probe: Mapping) -> Iterator[str]:
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


def _load_lines(source: Path, found: "Load", names: Sequence[str], probe: Mapping) -> Iterator[str]:
    import numpy as np
    from scipy.spatial.transform import Rotation

    from palpate.vision.load_json import left_out, verdict

    std = found.std
    yield f"{source}: {len(names)} poses, {found.kept.sum()} count"
    yield f"  mass {sure(found.mass_kg * 1e3, std[0] * 1e3)} g"
    centre = _sure(found.centre_of_mass_m, std[7:10], MILLIMETRES)
    yield f"  centre of mass {centre} mm in the sensor's frame"
    yield f"  zero {_sure(found.bias[:3], std[4:7], 1)} N"
    yield f"  zero {_sure(found.bias[3:], std[10:], MILLINEWTONS)} mNm"
    square = (found.residuals[found.kept] ** 2).reshape(-1, 2, 3)
    off = np.sqrt(square.mean(axis=(0, 2))) * MILLINEWTONS
    yield f"  residual: {off[0]:.2g} mN, {off[1]:.2g} mNm (root mean square)"
    for name, (force_n, torque_nm) in left_out(found, names).items():
        off = f"{force_n * MILLINEWTONS:.1f} mN and {torque_nm * MILLINEWTONS:.2g} mNm off"
        yield f"  left out: {name}: {off}"
    if "marker_from_force" in probe:
        typed = np.array(probe["marker_from_force"], dtype=float)[:3, :3]
        apart = degrees(Rotation.from_matrix(found.marker_from_force.T @ typed).magnitude())
        yield f"  the sensor is turned by {apart:.2f} degrees against the file's marker_from_force"
    yield from (f"  {line}" for line in verdict(found))


def _load_blocks(found: "Load", probe: Mapping) -> Iterator[str]:
    """Blocks for the probe's file."""
    from palpate.vision.load_json import axes_std_rad

    centre = ", ".join(f"{value:.5f}" for value in found.centre_of_mass_m)
    yield from ("load:", f"  mass_kg: {found.mass_kg:.5f}", f"  mass_std_kg: {found.std[0]:.1e}")
    yield f"  centre_of_mass_m: [{centre}]"
    typed = probe.get("marker_from_force")
    places = [FILL_IN] * 3 if typed is None else [f"{row[3]:.9f}" for row in typed[:3]]
    yield "marker_from_force: # the rotation is found, the last column is the sensor's place"
    for row, place in zip(found.marker_from_force, places, strict=True):
        yield f"  - [{', '.join(f'{value:.9f}' for value in row)}, {place}]"
    yield "  - [0.0, 0.0, 0.0, 1.0]"
    yield f"axes_std_rad: {axes_std_rad(found):.1e} # the table is level to 0.5 degrees"


def _stiffness_lines(source: Path, read: str, found: "Bending") -> Iterator[str]:
    from palpate.vision.bending_json import verdict

    per_newton = found.compliance_m_n * MILLIMETRES, found.compliance_std_m_n * MILLIMETRES
    low, high = found.force_n
    yield f"{source}: {found.samples} samples in contact, {low:.2g} to {high:.2g} N"
    yield f"  read: {read}"
    yield f"  gives way by {sure(*per_newton)} mm per newton"
    yield f"  bows by {_sure(found.bow_m[:1], found.bow_m[1:], MILLIMETRES)} mm"
    if isfinite(found.gap_m[0]):
        gap = _sure(found.gap_m[:1], found.gap_m[1:], MILLIMETRES)
        yield f"  unloading lies {gap} mm from loading"
    else:
        yield "  loading or unloading alone: whether they are alike is not told"
    residual_mm = round(found.rms_m * MILLIMETRES, 5)
    yield f"  residual: {residual_mm:.2g} mm (root mean square)"
    yield f"  {verdict(found)}"


def _sure(values: Sequence[float], errors: Sequence[float], scale: float) -> str:
    pairs = zip(values, errors, strict=True)
    return ", ".join(sure(value * scale, error * scale) for value, error in pairs)


def _rows(name: str, matrix: Sequence, digits: str) -> Iterator[str]:
    """A matrix as a block of the probe's file."""
    yield name
    yield from (f"  - [{', '.join(f'{value:{digits}}' for value in row)}]" for row in matrix)


def add(parts: Any) -> None:
    """Add the parts to the command's."""
    tip = _part(parts, "tip", "where the ball is on the probe", _tip, TIP,
        "pivot --sensor sensors/d435.yaml --board probes/ball.yaml")  # fmt: skip
    tip.add_argument("--unit", choices=("m", "cm", "mm"), default="m", help="of text files")
    load = _part(parts, "load", "what hangs on the force sensor", _load, LOAD,
        "poses.csv --up 0 -0.7 -0.7 --board probes/ball.yaml")  # fmt: skip
    up = "upwards, in the camera's frame"
    load.add_argument("--up", nargs=3, type=float, metavar=("X", "Y", "Z"), help=up)
    load.add_argument("--plane", type=Path, metavar="FILE", help="support_plane.json of the table")
    stiffness = _part(
        parts, "stiffness", "what the probe gives way by", _stiffness, STIFFNESS, "press.csv"
    )
    least = "forces above it count (0.5)"
    stiffness.add_argument("--contact-n", type=float, default=0.5, metavar="N", help=least)
    add_columns(stiffness)


def _part(
    parts: Any, name: str, short: str, work: Callable, about: str, example: str
) -> argparse.ArgumentParser:
    verb = add_verb(
        parts, name, short, work, about=about, example=f"palpate calibrate {name} {example}"
    )
    verb.add_argument("source", type=Path, metavar="SOURCE", help="film, table or folder")
    verb.add_argument("--sensor", type=Path, metavar="FILE", help="of a film: the sensor's YAML")
    board = "YAML with a block marker, as palpate board prints or a probe's file has"
    verb.add_argument("--board", type=Path, metavar="FILE", help=board)
    written = f"write {name}.json there too"
    verb.add_argument("--output", type=Path, metavar="FILE", help=written)
    return verb
