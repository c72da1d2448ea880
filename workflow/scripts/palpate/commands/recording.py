"""The command ``palpate import``: captures made of recordings of other software."""

import argparse
import re
from collections.abc import Mapping
from dataclasses import replace
from math import inf, isfinite
from pathlib import Path
from typing import Any

from palpate.capture.check_capture import check_numbers
from palpate.capture.devices import PLACES, add_devices, found_folder
from palpate.capture.discover import (
    BACKGROUND,
    CAPTURE_NAME,
    CAPTURE_WORDS,
    NOT_OBJECTS,
    object_fault,
    sensor_fault,
)
from palpate.capture.importing.bags import ENDINGS
from palpate.capture.importing.pose_files import Poses, read_pose_file
from palpate.capture.importing.recording import ForceTable, Recording, Request, shown
from palpate.capture.importing.ros import SMALLEST_UNIT_M, BagRecording, read_force_bag
from palpate.capture.importing.transforms import bag_poses
from palpate.capture.importing.tum import COLOR_LIST, DEPTH_LIST, TumRecording, is_tum
from palpate.capture.importing.write import import_recording
from palpate.capture.tables import FORCE, GAUGE_COLUMNS, WRENCH_COLUMNS, read_table
from palpate.commands.help import add_verb
from palpate.config.model import FILL_IN
from palpate.config.probe import PARTS
from palpate.config.sensor import HAND_EYE
from palpate.yaml_files import load_yaml, mismatch

# Recordings about a sensor, raw/sensors/<sensor>/<name>, and whether they have a force.
OF_SENSORS = NOT_OBJECTS[0]
WITH_FORCE = {part.recording: part.force for part in PARTS}
WITH_FORCE |= {HAND_EYE: False, "rest": True, "plate": False}
RAW = "raw"
OF_FOLDERS = ("intrinsics", "distortion")  # with rgb.txt
ABOUT = """\
Make a capture of a recording: a ROS bag, a RealSense recording, or a folder with rgb.txt and
depth.txt (docs/importing.md).
"""


def _import(options: argparse.Namespace) -> None:
    """Import a recording, and print lines on what was written."""
    folder, sensor, with_force = _place(options)
    described = folder.parent.parent / "object.yaml"
    # The virtual lab may make its objects again.
    if _stated(described).get("provenance") == "simulated":
        found = "simulated (the virtual lab's object: name yours differently)"
        raise mismatch(f"{described}: provenance", "recorded", found)
    source, own_force = options.force, with_force and options.force is None
    if source is not None and not with_force:
        of = "with --background" if options.background else f"for {folder}"
        raise mismatch("--force", f"none {of}", source)
    for name in ("force", "poses"):
        if not isfinite(offset_s := getattr(options, f"{name}_offset_s")):
            raise mismatch(f"--{name}-offset", "seconds", offset_s)
    if options.pairing_ms is not None and not 0 < options.pairing_ms < inf:
        raise mismatch("--pairing-ms", "milliseconds above 0", f"{options.pairing_ms:g}")
    sensors = found_folder("sensors", options.sensors, folder) or PLACES["sensors"]
    options.folder, options.sensor_file = folder, sensors / f"{sensor}.yaml"
    with_poses = _with_frames(options)
    recording = _recording(options, force=own_force)
    if own_force and isinstance(recording, TumRecording):
        source = options.recording / FORCE
        if not source.is_file():
            raise mismatch(f"{source}: file", "force.csv (--force <file> will do)", "nothing")
    force = None if source is None else _force(source, options)
    poses = _poses(options) if with_poses and not options.background else None
    print("\n".join(import_recording(recording, options, force, poses)))


def _with_frames(request: Request) -> bool:
    """Whether poses count; their frames are named as the probe's and the sensor's files do."""
    name = _stated(request.folder.parents[1] / "object.yaml").get("probe")
    probes = found_folder("probes", None, request.folder) or PLACES["probes"]
    path, placed = probes / f"{name}.yaml", _stated(request.sensor_file).get("base")
    probe = _stated(path)
    asked = request.poses or request.base or request.tracked or request.folder.name == HAND_EYE
    if request.base is None and isinstance(placed, Mapping) and placed.get("name") != FILL_IN:
        request.base = placed.get("name")
    request.tracked = request.tracked or probe.get("tracked")
    with_poses = bool(asked or ("tracked" in probe and "marker" not in probe))
    if request.tracked == FILL_IN and with_poses and not request.background:
        expected = "the frame of the probe as the recording names it"
        raise mismatch(f"{path}: tracked", expected, "nothing filled in yet")
    return with_poses


def _stated(path: Path) -> Mapping:
    """What a file states, if it is there."""
    content = load_yaml(path) if path.is_file() else None
    return content if isinstance(content, Mapping) else {}


def _poses(request: Request) -> Poses:
    """Poses of a file beside the recording, of another bag, or of the recording itself."""
    path, topic = request.recording, request.poses
    if topic and Path(topic).exists():
        path, topic = Path(topic), None
    if topic is None and path.suffix not in ENDINGS and path.is_file():
        poses = read_pose_file(path, request)
    elif is_tum(path):
        raise mismatch("--poses", "a file of poses beside rgb.txt", shown(topic) or "none")
    else:
        poses = bag_poses(path, topic, request)
    time_s = poses.record.time_s + request.poses_offset_s
    return replace(poses, record=replace(poses.record, time_s=time_s))


def _place(options: argparse.Namespace) -> tuple[Path, str, bool]:
    """Folder of the capture, name of its sensor, and whether it has a force."""
    folder = options.target
    if options.background and folder.name != BACKGROUND:
        folder = folder / BACKGROUND
    if folder.name == BACKGROUND and not options.background:
        raise mismatch(f"{folder}: capture", "--background for this name", "no option")
    own = folder.parent if folder.name == BACKGROUND else folder
    about = own.parent.parent.name == OF_SENSORS and own.name in WITH_FORCE
    sensor, subject = (own if about else folder).parent.name, folder.parent.parent.name
    no_sensor = subject == RAW or (folder.parent / "object.yaml").exists()
    if not about and (not subject or not sensor or no_sensor):
        expected = "raw/<object>/<sensor>/<capture>, like raw/red_sponge/d435/08"
        raise mismatch(f"{options.target}: target", expected, options.target)
    faults = {"sensor": sensor_fault(sensor), "object": None if about else object_fault(subject)}
    for name, fault in faults.items():
        if fault:
            raise ValueError(f"{options.target}: {name}: {fault}")
    if not (about or folder.name == BACKGROUND or CAPTURE_NAME.fullmatch(folder.name)):
        raise mismatch(f"{folder}: capture", CAPTURE_WORDS, folder.name)
    return folder, sensor, (not about or WITH_FORCE[own.name]) and not options.background


def _recording(request: Request, *, force: bool) -> Recording:
    unit_m = request.depth_unit_m
    if unit_m is not None and not SMALLEST_UNIT_M <= unit_m <= 1:
        raise mismatch("--depth-unit", "between a micrometre and a metre", f"{unit_m:g} m")
    if is_tum(request.recording):
        return TumRecording(request)
    for name in OF_FOLDERS:
        if getattr(request, name) is not None:
            expected = f"a folder with {COLOR_LIST} and {DEPTH_LIST}"
            raise mismatch(f"--{name}", expected, request.recording)
    return BagRecording(request, force=force)


def _force(path: Path, request: Request) -> ForceTable:
    """Table of force.csv and notes on it from a file beside the recording."""
    if path.suffix != ".csv":
        return read_force_bag(path, request)
    table = read_table(path)
    if "time_s" not in table.columns or not len(table):
        raise mismatch(f"{path}: columns", "time_s and samples", "none")
    used = [one for one in ("time_s", *WRENCH_COLUMNS, *GAUGE_COLUMNS) if one in table.columns]
    if lines := check_numbers(path, table, used):
        raise ValueError(lines[0])
    return table, ()


def add(commands: Any) -> None:
    """Add the command to a parser's."""
    short, example = "make a capture of a recording", "palpate import press.bag raw/sponge/d435/08"
    parser = add_verb(commands, "import", short, _import, about=ABOUT, example=example)
    # Coefficients of a lens are often as small as -5e-05, which argparse takes for an option.
    parser._negative_number_matcher = re.compile(r"-\.?[0-9]")
    add = parser.add_argument
    add("recording", type=Path, help="a .bag, .mcap or .db3, a ROS 2 folder, or one with rgb.txt")
    add("target", type=Path, help="raw/<object>/<sensor>/<capture>, or load, pivot,"
        " stiffness, hand_eye, rest, plate in raw/sensors/<sensor>; must not exist")  # fmt: skip
    add("--background", action="store_true", help="frames without object and probe, and no force")
    add_devices(parser, "sensors")
    add("--force", type=Path, metavar="FILE",
        help="force, by the images' clock: a force.csv or a bag")  # fmt: skip
    add("--force-offset", dest="force_offset_s", type=float, metavar="SECONDS", default=0.0,
        help="added to the force's times, where its clock is another")  # fmt: skip
    add("--poses", metavar="TOPIC_OR_FILE",
        help="of the probe: topic (/tf, PoseStamped), tracker's export or bag")  # fmt: skip
    add("--base", metavar="FRAME", help="base frame of poses (of the sensor's file, or the root)")
    add("--tracked", metavar="FRAME", help="tracked frame or tool (of the probe's file)")
    add("--poses-offset", dest="poses_offset_s", type=float, metavar="SECONDS", default=0.0,
        help="added to the poses' times, where their clock is another")  # fmt: skip
    add("--poses-rate", dest="poses_rate_hz", type=float, metavar="HZ",
        help="of an export that counts frames")  # fmt: skip
    add("--pairing-ms", type=float, metavar="MS",
        help="how far apart a frame's images may be (half a frame if not given)")  # fmt: skip
    for name in ("color", "depth", "wrench"):
        add(f"--{name}", metavar="TOPIC", help=f"topic of {name}, where it is not plain by itself")
    add("--registered", action="store_true", help="depth lies in the colour camera's frame")
    add("--receive-clock", action="store_true", help="a Wrench without stamp: time of receipt")
    add("--trust-sensor-file", action="store_true", help="an existing file's optics are right")
    add("--depth-unit", dest="depth_unit_m", type=float, metavar="METRES",
        help="what one count of depth is [m]; of rgb.txt 0.0002 if not given")  # fmt: skip
    add("--intrinsics", type=float, nargs=4, metavar=("FX", "FY", "CX", "CY"),
        help="rgb.txt: of the colour camera [px], depth registered to it")  # fmt: skip
    add("--distortion", type=float, nargs=5, metavar=("K1", "K2", "P1", "P2", "K3"),
        help="rgb.txt: of the same camera, in OpenCV's order")  # fmt: skip
