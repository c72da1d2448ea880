"""The command ``palpate calibrate load``: what hangs on the force sensor, and how it sits."""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.capture.discover import BACKGROUND
from palpate.capture.tables import FRAMES
from palpate.commands.help import add_verb
from palpate.commands.rig import (
    add_film,
    board_file,
    check_output,
    film_table,
    needed,
    sensor_file,
    sure,
    write_json,
)
from palpate.config.model import FILL_IN
from palpate.units import MILLIMETRES, MILLINEWTONS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from palpate.vision.load import Load
    from palpate.vision.rests import Rests

ABOUT = """\
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
EXAMPLE = "palpate calibrate load poses.csv --up 0 -0.7 -0.7 --board probes/ball.yaml"


def _load(options: argparse.Namespace) -> None:
    """Print what was found, and write it."""
    from palpate.vision.load import find_load
    from palpate.vision.load_json import load_fields

    check_output(options.output, options.source)
    _check_source(options.source)
    probe = {} if options.board is None else board_file(options.board)
    up, rests = _up(options), _rests(options, probe)
    try:
        found = find_load(rests.turns, rests.wrench, up, rests.noise, rests.names)
    except ValueError as error:
        raise ValueError(f"{options.source}: {error}") from None
    print("\n".join([*_lines(options.source, found, rests.names, probe), *_blocks(found, probe)]))
    if options.output is not None:
        write_json(options.output, load_fields(found, rests.names, probe.get("probe")))


def _check_source(source: Path) -> None:
    """Refuse what is not there, before asking for what belongs to it."""
    if not source.exists():
        raise ValueError(f"{source}: source: expected a film or a table, found none")
    if source.is_dir() and not (source / FRAMES).is_file():
        raise ValueError(f"{source}: frames.csv: expected a film's, found none")


def _up(options: argparse.Namespace) -> "NDArray":
    import numpy as np

    from palpate.vision.clouds import table_of
    from palpate.vision.support_plane import read_plane
    from palpate.workflow.options import Config

    empty = options.source / BACKGROUND
    if options.up is None and options.plane is None and empty.is_dir():
        needed(options, "sensor")
        sensor, config = sensor_file(options.sensor), Config()
        return table_of(empty, sensor, config.support_plane, seed=config.seed)[:3]
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
    from palpate.capture.force_record import WRENCH_COLUMNS
    from palpate.capture.tables import columns_of, read_force, read_table
    from palpate.vision.pose_files import turns_of
    from palpate.vision.rests import Rests, film_rests

    source = options.source
    if not source.is_dir():
        table = read_table(source)
        try:
            rows = [f"row {k}" for k in range(1, len(table) + 1)]
            return Rests(rows, turns_of(table), columns_of(table, WRENCH_COLUMNS), None)
        except ValueError as error:
            raise ValueError(f"{source}: {error}") from None
    needed(options, "sensor", "board")
    table = film_table(source, sensor_file(options.sensor), probe["marker"], force=True)
    try:
        return film_rests(table, read_force(source), probe)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None


def _lines(source: Path, found: "Load", names: Sequence[str], probe: Mapping) -> Iterator[str]:
    import numpy as np
    from scipy.spatial.transform import Rotation

    from palpate.vision.load_json import left_out, verdict

    std = found.std
    centre = zip(found.centre_of_mass_m * MILLIMETRES, std[7:10] * MILLIMETRES, strict=True)
    forces = zip(found.bias[:3], std[4:7], strict=True)
    torques = zip(found.bias[3:] * MILLINEWTONS, std[10:] * MILLINEWTONS, strict=True)
    yield f"{source}: {len(names)} poses, {found.kept.sum()} count"
    yield f"  mass {sure(found.mass_kg * 1e3, std[0] * 1e3)} g"
    yield f"  centre of mass {', '.join(sure(*pair) for pair in centre)} mm in the sensor's frame"
    yield f"  zero {', '.join(sure(*pair) for pair in forces)} N"
    yield f"  zero {', '.join(sure(*pair) for pair in torques)} mNm"
    off = (
        np.sqrt((found.residuals[found.kept] ** 2).reshape(-1, 2, 3).mean(axis=(0, 2)))
        * MILLINEWTONS
    )
    yield f"  residual: {off[0]:.2g} mN, {off[1]:.2g} mNm (root mean square)"
    for name, (force_n, torque_nm) in left_out(found, names).items():
        off = f"{force_n * MILLINEWTONS:.1f} mN and {torque_nm * MILLINEWTONS:.2g} mNm off"
        yield f"  left out: {name}: {off}"
    if "marker_from_force" in probe:
        typed = np.array(probe["marker_from_force"], dtype=float)[:3, :3]
        apart = degrees(Rotation.from_matrix(found.marker_from_force.T @ typed).magnitude())
        yield f"  the sensor is turned by {apart:.2f} degrees against the file's marker_from_force"
    yield from (f"  {line}" for line in verdict(found))


def _blocks(found: "Load", probe: Mapping) -> Iterator[str]:
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


def add(parts: Any) -> None:
    """Add the part to the command's."""
    verb = add_verb(
        parts, "load", "what hangs on the force sensor", _load, about=ABOUT, example=EXAMPLE
    )
    add_film(verb)
    verb.add_argument(
        "--up", nargs=3, type=float, metavar=("X", "Y", "Z"), help="upwards, in the camera's frame"
    )
    verb.add_argument("--plane", type=Path, metavar="FILE", help="support_plane.json of the table")
    verb.add_argument("--output", type=Path, metavar="FILE", help="write load.json there too")
