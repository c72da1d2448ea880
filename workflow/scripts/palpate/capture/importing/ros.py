"""Recordings in bags: what their messages say."""

from array import array
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from palpate.capture.importing import optics
from palpate.capture.importing.bags import (
    FLOAT,
    KEY_VALUE,
    TEXT,
    TRANSFORM,
    TRANSFORMS,
    Bag,
    open_bag,
    shown,
)
from palpate.capture.importing.pixels import METRES, MILLIMETRES, Form, pixels_of
from palpate.capture.importing.recording import (
    NANOSECONDS,
    Content,
    Picture,
    Progress,
    Stream,
    force_table,
)
from palpate.capture.importing.topics import (
    REALSENSE_DATA,
    Names,
    color_topic,
    depth_topic,
    image_forms,
    info_topic,
    wrench_topic,
)

# In recordings of the RealSense SDK: <stream>/tf/<reference>, <sensor>/option/<name>/value.
# Names of ROS 2 have no blanks.
REALSENSE_UNITS = ("/option/Depth Units/value", "/option/Depth_Units/value")
STATIC = "tf_static"
# Beside its images it keeps what it knows of each: pairs of names and values.
REALSENSE_METADATA = "/image/metadata"
PAIRS_OF_A_FRAME = 100
COMPUTER_CLOCKS = "System Time", "Global Time"
SMALLEST_UNIT_M = 1e-6


class BagRecording:
    """A bag with one camera's colour and depth and, but for a background, a wrench.

    Parameters
    ----------
    path : Path
        The bag.
    names : Names
    force : bool
        Whether it is to have a wrench.
    stated_optics : bool, optional
        Whether what it says of its cameras is to be read.
    """

    def __init__(
        self, path: Path, names: Names, *, force: bool, stated_optics: bool = True
    ) -> None:
        self.path, self._names, self._stated_optics = path, names, stated_optics
        with open_bag(path) as bag:
            forms, others = image_forms(bag)
            self._color = color_topic(bag, forms, names.color, others)
            self._depth = depth_topic(bag, forms, names.depth, others)
            self._wrench = wrench_topic(bag, names) if force else None
            counts = bag.topics()
        self._forms = {name: forms[name] for name in (self._color, self._depth)}
        self._count = sum(counts[name].count for name in self._wanted())

    def messages(self) -> int:
        """Number of messages that `survey` reads."""
        return self._count

    def survey(self, tick: Progress) -> Content:
        """Look through the bag once; see `Recording`."""
        stamps = {name: array("q") for name in self._forms}
        samples, count = Samples(self._names), 0
        with open_bag(self.path) as bag:
            for topic, received_ns, message in bag.messages(self._wanted()):
                if topic in stamps:
                    stamps[topic].append(stamp_ns(message.header))
                else:
                    samples.add(message, received_ns)
                count += 1
                tick()
            if count != self._count:
                expected = f"{self._count}, as the bag states"
                raise ValueError(f"{self.path}: messages: expected {expected}, found {count}")
            clock_notes = _clock_notes(bag, self._color)
            cameras = self._cameras(bag) if self._stated_optics else None
            unit_m, said = self._names.depth_unit_m, "--depth-unit"
            if unit_m is None:
                unit_m, said = _depth_unit_m(bag, self._depth, self._forms[self._depth])
        color, depth = (
            Stream(shown(name), self._forms[name], np.array(times, dtype=np.int64))
            for name, times in stamps.items()
        )
        force, notes = samples.table() if self._wrench else (None, ())
        notes += clock_notes
        return Content(color, depth, unit_m, said, force, cameras, notes)

    def pictures(self) -> Iterator[Picture]:
        """All images one by one."""
        counts = dict.fromkeys(self._forms, 0)
        streams = {self._color: "color", self._depth: "depth"}
        with open_bag(self.path) as bag:
            for topic, _, message in bag.messages(self._forms):
                pixels = _told(bag, topic, lambda m=message, t=topic: pixels_of(m, self._forms[t]))
                yield Picture(streams[topic], counts[topic], pixels)
                counts[topic] += 1

    def _wanted(self) -> list[str]:
        return [name for name in (self._color, self._depth, self._wrench) if name]

    def _cameras(self, bag: Bag) -> dict | None:
        """Camera blocks of the sensor's file, or None if the bag has no optics."""
        infos = {
            "color": info_topic(bag, self._color, self._names.color_info),
            "depth": info_topic(bag, self._depth, self._names.depth_info),
        }
        if None in infos.values():
            return None
        messages = {kind: bag.first(name) for kind, name in infos.items()}
        blocks = {}
        for kind, image in (("color", self._color), ("depth", self._depth)):
            rectified = optics.is_rectified(image)
            arguments = messages[kind], self._forms[image]
            blocks[kind] = _told(
                bag,
                infos[kind],
                lambda a=arguments, r=rectified: optics.camera_block(*a, rectified=r),
            )
        transform = self._color_from_depth(bag, messages)
        blocks["depth"]["color_from_depth"] = optics.rows(transform)
        return blocks

    def _color_from_depth(self, bag: Bag, infos: Mapping[str, Any]) -> np.ndarray:
        if self._names.registered:
            return np.eye(4)
        if self._depth.endswith(REALSENSE_DATA):
            return _told(bag, self._depth, lambda: _realsense(bag, self._color, self._depth))
        color, depth = (infos[kind].header.frame_id for kind in ("color", "depth"))
        if color and color == depth:
            return np.eye(4)
        topics = [name for name in bag.topics(TRANSFORMS) if name.endswith(STATIC)]
        found = [one for _, _, message in bag.messages(topics) for one in message.transforms]
        return _told(bag, STATIC, lambda: optics.chained(found, color, depth))


class Samples:
    """Wrenches as they come in; `table` puts them in order."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self._times_ns, self._values = array("q"), array("d")

    def add(self, message: Any, received_ns: int) -> None:
        """Take one message of type WrenchStamped, or Wrench with its time of receipt."""
        stamped = hasattr(message, "wrench")
        self._times_ns.append(stamp_ns(message.header) if stamped else received_ns)
        wrench = message.wrench if stamped else message
        force, torque = wrench.force, wrench.torque
        self._values.extend((force.x, force.y, force.z, torque.x, torque.y, torque.z))

    def table(self) -> tuple:
        """Table of force.csv and notes on it; see `force_table`."""
        times_ns = np.array(self._times_ns, dtype=np.int64)
        return force_table(times_ns, np.array(self._values, dtype=float).reshape(-1, 6))


def read_force_bag(path: Path, names: Names) -> tuple:
    """Table of force.csv and notes on it from a bag that holds a wrench."""
    samples = Samples(names)
    with open_bag(path) as bag:
        for _, received_ns, message in bag.messages([wrench_topic(bag, names)]):
            samples.add(message, received_ns)
    return samples.table()


def stamp_ns(header: Any) -> int:
    """Stamp of a header [ns]."""
    return int(header.stamp.sec) * NANOSECONDS + int(header.stamp.nanosec)


def _realsense(bag: Bag, color: str, depth: str) -> np.ndarray:
    """color_from_depth of a RealSense recording: each stream states itself from a reference."""
    found: dict[str, dict[str, np.ndarray]] = {}
    for image in (color, depth):
        stem = f"{image.removesuffix(REALSENSE_DATA)}/tf/"
        topics = [name for name in bag.topics(TRANSFORM) if name.startswith(stem)]
        found[image] = {name[len(stem) :]: optics.matrix(bag.first(name)) for name in topics}
    shared = sorted(found[color].keys() & found[depth].keys())
    if not shared:
        raise ValueError("tf: expected extrinsics of both streams, found none (see --registered)")
    return found[color][shared[0]] @ np.linalg.inv(found[depth][shared[0]])


def _depth_unit_m(bag: Bag, depth: str, form: Form) -> tuple[float, str]:
    """What one count of the depth images is [m], and who says so."""
    stated = "as the recording states"
    if form.encoding == METRES:
        return 1.0, f"{METRES} by REP 118: --depth-unit"
    message = bag.first(depth)
    if unit_m := getattr(message, "depth_units", 0.0):
        return _checked_unit(bag, depth, unit_m), stated
    if not depth.endswith(REALSENSE_DATA):
        return (
            1 / MILLIMETRES,
            f"{form.encoding} by REP 118, the recording states none: --depth-unit",
        )
    sensor = depth.removesuffix(REALSENSE_DATA).rpartition("/")[0]
    options = bag.topics(FLOAT, TEXT)
    for name in (sensor + option for option in REALSENSE_UNITS):
        if name in options:
            return _checked_unit(bag, depth, bag.first(name).data), stated
    expected = "the recording or --depth-unit <metres> to state them"
    raise ValueError(f"{bag.path}: {shown(depth)}: depth units: expected {expected}, found none")


def _checked_unit(bag: Bag, depth: str, stated: float | str) -> float:
    try:
        unit_m = float(stated)
    except ValueError:
        unit_m = np.nan
    if not SMALLEST_UNIT_M <= unit_m <= 1:
        expected = "between a micrometre and a metre"
        raise ValueError(f"{bag.path}: {shown(depth)}: depth units: expected {expected},"
                         f" found {shown(stated)} m")  # fmt: skip
    # The bag has it as a float of 32 bits.
    return float(f"{unit_m:.6g}")


def _clock_notes(bag: Bag, image: str) -> tuple[str, ...]:
    """Tell of stamps that a RealSense recording states to be of the camera's own clock."""
    topic = f"{image.removesuffix(REALSENSE_DATA)}{REALSENSE_METADATA}"
    if not image.endswith(REALSENSE_DATA) or topic not in bag.topics(KEY_VALUE):
        return ()
    pairs = (message for _, _, message in islice(bag.messages([topic]), PAIRS_OF_A_FRAME))
    domain = next((pair.value for pair in pairs if pair.key == "timestamp_domain"), None)
    if domain in (None, *COMPUTER_CLOCKS):
        return ()
    return (f"{shown(image)}: stamps are of another clock than the computer's ({shown(domain)}):"
            " force of the computer's clock needs --force-offset",)  # fmt: skip


def _told(bag: Bag, topic: str, work: Callable[[], Any]) -> Any:
    """Name bag and topic in what goes wrong."""
    try:
        return work()
    except ValueError as error:
        if str(error).startswith(f"{bag.path}: "):
            raise
        raise ValueError(f"{bag.path}: {shown(topic)}: {error}") from None
