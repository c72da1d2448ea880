"""Recordings in bags: which topics are meant, and what their messages say."""

from array import array
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.capture.importing.bags import IMAGE, Bag, chosen, held, open_bag, stamp_ns
from palpate.capture.importing.optics import camera_block, rows
from palpate.capture.importing.pixels import METRES, Form, form_of, pixels_of, taken
from palpate.capture.importing.pose_files import rigid
from palpate.capture.importing.recording import (
    Content,
    ForceTable,
    Images,
    Request,
    force_table,
    named,
    progress,
    shown,
)
from palpate.capture.importing.transforms import STATIC, Tree, parts
from palpate.units import MILLIMETRES
from palpate.yaml_files import mismatch

COMPRESSED = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
WRENCH, WRENCH_STAMPED = "geometry_msgs/msg/Wrench", "geometry_msgs/msg/WrenchStamped"
TRANSFORM, KEY_VALUE = "geometry_msgs/msg/Transform", "diagnostic_msgs/msg/KeyValue"
NUMBERS = "std_msgs/msg/Float32", "std_msgs/msg/String"
REGISTERED = "--registered says that depth is registered to colour"
# image_transport puts these behind the name of the plain image.
CODECS = ("compressed", "compressedDepth")
# Layout of the RealSense SDK's recorder: <stream>/image/data, <stream>/image/metadata (pairs of
# names and values), <stream>/info/camera_info, <stream>/tf/<reference> and
# <sensor>/option/<name>/value. Names of ROS 2 have no blanks.
REALSENSE_DATA, REALSENSE_METADATA = "/image/data", "/image/metadata"
REALSENSE_INFO = "/info/camera_info"
REALSENSE_UNITS = ("/option/Depth Units/value", "/option/Depth_Units/value")
PAIRS_OF_A_FRAME = 100
COMPUTER_CLOCKS = "System Time", "Global Time"
SMALLEST_UNIT_M = 1e-6


class BagRecording:
    """A bag with one camera's colour and depth and, where it is asked for, a wrench."""

    def __init__(self, request: Request, *, force: bool) -> None:
        self._path, self._request = request.recording, request
        with open_bag(self._path) as bag:
            self._topics, self._forms = _image_topics(bag, request)
            self._wrench = _wrench_topic(bag, request) if force else None

    def survey(self) -> Content:
        """Look through the bag once; see `Recording`."""
        depth, wrench = self._topics["depth"], array("d")
        wanted = (*self._topics.values(), self._wrench)
        times_ns = {topic: array("q") for topic in wanted if topic}
        with open_bag(self._path) as bag:
            stated = sum(bag.topics()[topic].msgcount for topic in times_ns)
            messages = progress("looking", stated, bag.messages(times_ns))
            for topic, received_ns, message in messages:
                times_ns[topic].append(stamp_ns(message, received_ns))
                if topic == self._wrench:
                    wrench.extend(_wrench(message))
            if (count := sum(map(len, times_ns.values()))) != stated:
                raise mismatch(f"{self._path}: messages", f"{stated}, as the bag states", count)
            notes = _clock_notes(bag, self._topics["color"])
            cameras = None if self._request.trust_sensor_file else self._cameras(bag)
            frame = bag.first(self._topics["color"]).header.frame_id
            unit_m, said = self._request.depth_unit_m, "--depth-unit"
            if unit_m is None:
                with named(self._path, shown(depth)):
                    unit_m, said = _depth_unit_m(bag, depth, self._forms[depth])
        streams = (
            Images(shown(topic), self._forms[topic], np.array(times_ns[topic], dtype=np.int64))
            for topic in self._topics.values()
        )
        force, found = force_table(times_ns[self._wrench], wrench) if self._wrench else (None, ())
        return Content(*streams, unit_m, said, force, cameras, found + notes, frame)

    def pictures(self) -> Iterator[tuple[str, int, NDArray]]:
        """All images one by one; see `Recording`."""
        kinds, counts = {topic: kind for kind, topic in self._topics.items()}, Counter()
        with open_bag(self._path) as bag:
            for topic, _, message in bag.messages(kinds):
                with named(self._path, shown(topic)):
                    pixels = pixels_of(message, self._forms[topic])
                yield kinds[topic], counts[topic], pixels
                counts[topic] += 1

    def _cameras(self, bag: Bag) -> dict | None:
        """Camera blocks of the sensor's file, or None if the bag has no optics."""
        infos = {kind: _info_topic(bag, topic) for kind, topic in self._topics.items()}
        if None in infos.values():
            return None
        messages = {kind: bag.first(info) for kind, info in infos.items()}
        blocks = {}
        for kind, topic in self._topics.items():
            with named(self._path, shown(infos[kind])):
                blocks[kind] = camera_block(messages[kind], self._forms[topic], topic)
        blocks["depth"]["color_from_depth"] = rows(self._color_from_depth(bag, messages))
        return blocks

    def _color_from_depth(self, bag: Bag, infos: Mapping[str, Any]) -> NDArray:
        color, depth = (infos[kind].header.frame_id for kind in ("color", "depth"))
        realsense = self._topics["depth"].endswith(REALSENSE_DATA)
        if self._request.registered or (not realsense and color and color == depth):
            return np.eye(4)
        if realsense:
            with named(self._path, shown(self._topics["depth"])):
                return _realsense(bag, **self._topics)
        with named(self._path, STATIC):
            return Tree(bag, moving=False).path(color, depth, REGISTERED)[1][0]


def read_force_bag(path: Path, request: Request) -> ForceTable:
    """Table of force.csv and notes on it from a bag that holds a wrench."""
    times_ns, wrench = array("q"), array("d")
    with open_bag(path) as bag:
        topic = _wrench_topic(bag, request)
        for _, received_ns, message in bag.messages([topic]):
            times_ns.append(stamp_ns(message, received_ns))
            wrench.extend(_wrench(message))
        # Of fewer than are stated, the times say whether they are enough.
        if not times_ns:
            stated = bag.topics()[topic].msgcount
            expected = f"{stated}, as the bag states (record it again, or --force another file)"
            raise mismatch(f"{path}: {shown(topic)}: wrenches", expected, 0)
    return force_table(times_ns, wrench)


def _image_topics(bag: Bag, request: Request) -> tuple[dict[str, str], dict[str, Form]]:
    """Topic of the ``color`` and of the ``depth`` images, and the form of each topic's first."""
    forms, others, found = {}, [], {"color": [], "depth": []}
    for topic in bag.topics(IMAGE, COMPRESSED):
        message = bag.first(topic)
        try:
            forms[topic] = form_of(message)
            found[forms[topic].kind].append(topic)
        except ValueError as error:
            others.append(f"{shown(topic)} of {shown(str(error).rpartition('found ')[2])}")
    # Depth cameras often record their infrared image, which is grey, as well.
    coloured = [topic for topic in found["color"] if forms[topic].stored != "mono8"]
    if coloured and not request.color:
        found["color"] = coloured
    none = held(bag, others)
    topics = {
        kind: chosen(bag, kind, names, getattr(request, kind), taken(kind), none)
        for kind, names in found.items()
    }
    return topics, forms


def _wrench_topic(bag: Bag, request: Request) -> str:
    """Topic of the wrench, one with stamps where nothing else is said."""
    found = bag.topics(WRENCH_STAMPED, WRENCH)
    name = chosen(bag, "wrench", list(found), request.wrench, "WrenchStamped")
    if found[name].msgtype == WRENCH and not request.receive_clock:
        expected = f"{WRENCH_STAMPED} (--receive-clock takes the times of receipt)"
        raise mismatch(f"{bag.path}: {shown(name)}: type", expected, WRENCH)
    return name


def _info_topic(bag: Bag, image: str) -> str | None:
    """CameraInfo that belongs to an image topic by its name."""
    infos = bag.topics(CAMERA_INFO)
    parts = image.split("/")
    base = parts[:-1] if parts[-1] in CODECS else parts
    beside = "/".join([*base[:-1], "camera_info"])
    realsense = image.removesuffix(REALSENSE_DATA) + REALSENSE_INFO
    return next((name for name in (beside, realsense) if name in infos), None)


def _wrench(message: Any) -> list[float]:
    """Force and torque of a Wrench or a WrenchStamped."""
    plain = getattr(message, "wrench", message)
    return [getattr(part, axis) for part in (plain.force, plain.torque) for axis in "xyz"]


def _realsense(bag: Bag, color: str, depth: str) -> NDArray:
    """color_from_depth of a RealSense recording: each stream states itself from a reference."""
    found = []
    for image in (color, depth):
        stem = f"{image.removesuffix(REALSENSE_DATA)}/tf/"
        topics = [name for name in bag.topics(TRANSFORM) if name.startswith(stem)]
        stated = {name.removeprefix(stem): bag.first(name) for name in topics}
        values = {name: [parts(one.rotation, one.translation)] for name, one in stated.items()}
        found.append({name: rigid(np.array(one))[0] for name, one in values.items()})
    shared = sorted(found[0].keys() & found[1].keys())
    if not shared:
        raise mismatch("tf", "extrinsics of both streams", "none (see --registered)")
    color_from_shared, depth_from_shared = (one[shared[0]] for one in found)
    return color_from_shared @ np.linalg.inv(depth_from_shared)


def _depth_unit_m(bag: Bag, depth: str, form: Form) -> tuple[float, str]:
    """What one count of the depth images is [m], and who says so."""
    if form.encoding == METRES:
        return 1.0, f"{METRES} by REP 118: --depth-unit"
    stated = getattr(bag.first(depth), "depth_units", 0.0)
    if not stated and not depth.endswith(REALSENSE_DATA):
        said = f"{form.encoding} by REP 118, the recording states none: --depth-unit"
        return 1 / MILLIMETRES, said
    if not stated:
        sensor = depth.removesuffix(REALSENSE_DATA).rpartition("/")[0]
        options = [sensor + name for name in REALSENSE_UNITS]
        units = [name for name in options if name in bag.topics(*NUMBERS)]
        if not units:
            expected = "the recording or --depth-unit <metres> to state them"
            raise mismatch("depth units", expected, "none")
        stated = bag.first(units[0]).data
    try:
        unit_m = float(stated)
    except ValueError:
        unit_m = np.nan
    if not SMALLEST_UNIT_M <= unit_m <= 1:
        found = f"{shown(stated)} m"
        raise mismatch("depth units", "between a micrometre and a metre", found)
    # The bag has it as a float of 32 bits.
    return float(f"{unit_m:.6g}"), "as the recording states"


def _clock_notes(bag: Bag, image: str) -> tuple[str, ...]:
    """Say that stamps are of the camera's own clock, where a RealSense recording states it."""
    topic = f"{image.removesuffix(REALSENSE_DATA)}{REALSENSE_METADATA}"
    if not image.endswith(REALSENSE_DATA) or topic not in bag.topics(KEY_VALUE):
        return ()
    pairs = (message for _, _, message in islice(bag.messages([topic]), PAIRS_OF_A_FRAME))
    domain = next((pair.value for pair in pairs if pair.key == "timestamp_domain"), None)
    if domain in (None, *COMPUTER_CLOCKS):
        return ()
    return (f"{shown(image)}: stamps are of another clock than the computer's ({shown(domain)}):"
            " force of the computer's clock needs --force-offset",)  # fmt: skip
