"""Options of ``palpate import <recording> <capture>``, and what they ask for."""

import argparse
import re
from collections.abc import Mapping
from math import inf, isfinite
from pathlib import Path

from palpate.capture.check_capture import check_numbers
from palpate.capture.devices import PARTS, PLACES, add_devices, found_folder
from palpate.capture.discover import (
    BACKGROUND,
    CAPTURE_NAME,
    CAPTURE_WORDS,
    NOT_OBJECTS,
    object_fault,
    sensor_fault,
)
from palpate.capture.importing.recording import Recording
from palpate.capture.importing.ros import (
    SMALLEST_UNIT_M,
    BagRecording,
    Names,
    read_force_bag,
)
from palpate.capture.importing.sensor_file import RANGE_M
from palpate.capture.importing.tum import (
    COLOR_LIST,
    DEPTH_FACTOR,
    DEPTH_LIST,
    WRENCH_LIST,
    TumRecording,
    is_tum,
    read_wrenches,
)
from palpate.capture.importing.write import Target, import_recording
from palpate.capture.tables import FORCE, GAUGE_COLUMNS, WRENCH_COLUMNS, read_table
from palpate.yaml_files import load_yaml

# Films of a probe by itself, raw/sensors/<sensor>/<film>.
OF_SENSORS, FILMS = NOT_OBJECTS[0], {part.film: part for part in PARTS}
RAW = "raw"
USED = ("time_s", *WRENCH_COLUMNS)
# Options for folders with rgb.txt, and what they are if not given.
OF_FOLDERS = {"intrinsics": None, "distortion": None, "depth_factor": DEPTH_FACTOR}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the import."""
    # Coefficients of a lens are often as small as -5e-05, which argparse takes for an option.
    parser._negative_number_matcher = re.compile(r"-\.?[0-9]")
    add = parser.add_argument
    add("recording", type=Path, help="a .bag, .mcap or .db3, a ROS 2 folder, or one with rgb.txt")
    add("target", type=Path, help="raw/<object>/<sensor>/<capture>, or a film of the probe,"
        " raw/sensors/<sensor>/load, pivot or stiffness; must not exist yet")  # fmt: skip
    add("--background", action="store_true", help="frames without object and probe, and no force")
    add_devices(parser, "sensors")
    add(
        "--force",
        type=Path,
        metavar="FILE",
        help="force, by the images' clock: .csv, .txt or a bag",
    )
    add("--force-offset", type=float, metavar="SECONDS", default=0.0,
        help="added to the force's times, where its clock is another")  # fmt: skip
    add("--pairing-ms", type=float, metavar="MS",
        help="how far apart a frame's images may be (half a frame if not given)")  # fmt: skip
    for name in ("color", "depth", "wrench", "color-info", "depth-info"):
        add(f"--{name}", metavar="TOPIC", help=f"topic of {name}, where it is not plain by itself")
    add("--registered", action="store_true", help="depth lies in the colour camera's frame")
    add("--receive-clock", action="store_true", help="a Wrench without stamp: time of receipt")
    add("--trust-sensor-file", action="store_true", help="an existing file's optics are right")
    add("--range", type=float, nargs=2, metavar=("NEAR_M", "FAR_M"), default=RANGE_M,
        help="of a new sensor file [m]")  # fmt: skip
    add("--depth-unit", type=float, metavar="METRES", help="bags: what one count of depth is [m]")
    add("--depth-factor", type=float, default=DEPTH_FACTOR, help="rgb.txt: counts in a metre")
    add("--intrinsics", type=float, nargs=4, metavar=("FX", "FY", "CX", "CY"),
        help="rgb.txt: of the colour camera [px], depth registered to it")  # fmt: skip
    add("--distortion", type=float, nargs=5, metavar=("K1", "K2", "P1", "P2", "K3"),
        help="rgb.txt: of the same camera, in OpenCV's order")  # fmt: skip


def run(options: argparse.Namespace) -> list[str]:
    """Import a recording: lines on what was written.

    Raises
    ------
    ValueError
        If the recording, the target or an option is wrong.
    """
    target = _target(options)
    _require_recorded(target.folder)
    own_force = options.force is None and not target.background
    if target.background and options.force is not None:
        of = "with --background" if options.background else f"for {target.folder}"
        raise ValueError(f"--force: expected none {of}, found {options.force}")
    if not isfinite(options.force_offset):
        raise ValueError(f"--force-offset: expected seconds, found {options.force_offset}")
    if options.pairing_ms is not None and not 0 < options.pairing_ms < inf:
        found = f"{options.pairing_ms:g}"
        raise ValueError(f"--pairing-ms: expected milliseconds above 0, found {found}")
    recording = _recording(options, force=own_force)
    force = None
    if options.force is not None:
        force = _force(options.force, _names(options))
    elif own_force and isinstance(recording, TumRecording):
        beside = options.recording / FORCE
        force = _force(beside if beside.is_file() else options.recording / WRENCH_LIST, Names())
    return import_recording(
        recording,
        target,
        force=force,
        force_offset_s=options.force_offset,
        pairing_ms=options.pairing_ms,
    )


def _target(options: argparse.Namespace) -> Target:
    folder = options.target
    if options.background and folder.name != BACKGROUND:
        folder = folder / BACKGROUND
    name, sensor = folder.name, folder.parent.name
    if name == BACKGROUND and not options.background:
        raise ValueError(f"{folder}: capture: expected --background for this name, found no option")
    film = folder.parent if name == BACKGROUND else folder
    part = FILMS.get(film.name) if film.parent.parent.name == OF_SENSORS else None
    if part is None:
        _require_target(options.target, folder)
        if name != BACKGROUND and not CAPTURE_NAME.fullmatch(name):
            raise ValueError(f"{folder}: capture: expected {CAPTURE_WORDS}, found {name}")
    elif fault := sensor_fault(sensor := film.parent.name):
        raise ValueError(f"{options.target}: sensor: {fault}")
    sensors = found_folder("sensors", options.sensors, folder) or PLACES["sensors"]
    no_force = options.background or (part is not None and not part.force)
    sensor_file = sensors / f"{sensor}.yaml"
    return Target(folder, sensor_file, no_force, tuple(options.range), options.trust_sensor_file)


def _require_target(target: Path, folder: Path) -> None:
    """Hold the folders above a capture to names that an object and a sensor can have."""
    sensor, subject = folder.parent.name, folder.parent.parent.name
    no_sensor = subject == RAW or (folder.parent / "object.yaml").exists()
    if not subject or not sensor or no_sensor:
        expected = "raw/<object>/<sensor>/<capture>, like raw/red_sponge/d435/08"
        raise ValueError(f"{target}: target: expected {expected}, found {target}")
    if fault := sensor_fault(sensor):
        raise ValueError(f"{target}: sensor: {fault}")
    if fault := object_fault(subject):
        raise ValueError(f"{target}: object: {fault}")


def _require_recorded(folder: Path) -> None:
    """Keep recordings out of an object that the virtual lab makes, and may make again."""
    path = folder.parent.parent / "object.yaml"
    if not path.exists():
        return
    spec = load_yaml(path)
    if isinstance(spec, Mapping) and spec.get("provenance") == "simulated":
        raise ValueError(f"{path}: provenance: expected recorded, found simulated (the virtual"
                         " lab's object: name yours differently)")  # fmt: skip


def _recording(options: argparse.Namespace, *, force: bool) -> Recording:
    if is_tum(options.recording):
        if options.depth_unit is not None:
            expected = "--depth-factor for rgb.txt"
            raise ValueError(f"--depth-unit: expected {expected}, found {options.depth_unit:g}")
        return TumRecording(
            options.recording,
            depth_factor=options.depth_factor,
            intrinsics_px=options.intrinsics,
            distortion=options.distortion,
        )
    for name, default in OF_FOLDERS.items():
        if getattr(options, name) != default:
            option = f"--{name.replace('_', '-')}"
            expected = f"a folder with {COLOR_LIST} and {DEPTH_LIST}"
            raise ValueError(f"{option}: expected {expected}, found {options.recording}")
    if options.depth_unit is not None and not SMALLEST_UNIT_M <= options.depth_unit <= 1:
        expected = "between a micrometre and a metre"
        raise ValueError(f"--depth-unit: expected {expected}, found {options.depth_unit:g} m")
    stated = not options.trust_sensor_file
    return BagRecording(options.recording, _names(options), force=force, stated_optics=stated)


def _names(options: argparse.Namespace) -> Names:
    return Names(
        color=options.color,
        depth=options.depth,
        wrench=options.wrench,
        color_info=options.color_info,
        depth_info=options.depth_info,
        registered=options.registered,
        receive_clock=options.receive_clock,
        depth_unit_m=options.depth_unit,
    )


def _force(path: Path, names: Names) -> tuple:
    """Table of force.csv and notes on it from a file beside the recording."""
    if path.suffix == ".csv":
        table = read_table(path)
        if "time_s" not in table.columns or not len(table):
            raise ValueError(f"{path}: columns: expected time_s and samples, found none")
        used = [name for name in (*USED, *GAUGE_COLUMNS) if name in table.columns]
        if lines := check_numbers(path, table, used):
            raise ValueError(lines[0])
        return table, ()
    return read_wrenches(path) if path.suffix == ".txt" else read_force_bag(path, names)
