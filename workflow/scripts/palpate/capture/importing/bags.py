"""Bags of ROS 1 and ROS 2, read message by message; nothing that they state is believed unchecked.

Messages are read as the types that ROS itself defines, never as the bag defines them: a bag's own
definitions would become code.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import Connection, TopicInfo
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from palpate.capture.importing.recording import NANOSECONDS, shown
from palpate.yaml_files import mismatch

IMAGE = "sensor_msgs/msg/Image"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
# A message must fit into memory.
LARGEST_BYTES, LARGEST_METADATA_BYTES = 2**28, 2**24
# Recordings of the RealSense SDK mark the header and put the depth's unit behind the pixels, under
# the name and digest of the plain type.
REALSENSE_MARK = slice(12, 17), b"\x01\x00\x00\x001"
REALSENSE_IMAGE = "realsense_recording/msg/Image"
REALSENSE_FIELDS = """std_msgs/Header header
uint32 height
uint32 width
string encoding
uint8 is_bigendian
uint32 step
uint8[] data
float32 depth_units"""
# What ROS 1 defines outside of its common messages.
ROS1_TYPES = {
    REALSENSE_IMAGE: REALSENSE_FIELDS,
    TRANSFORMS: "geometry_msgs/TransformStamped[] transforms",
}
ENDINGS = (".bag", ".mcap", ".db3")
MOST_SHOWN = 8


class Bag:
    """An open bag; `open_bag` makes it."""

    def __init__(self, path: Path, reader: Any, *, ros1: bool) -> None:
        self.path, self._reader, self._ros1 = path, reader, ros1
        self._topics = reader.topics
        self._store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        for name, fields in ROS1_TYPES.items() if ros1 else ():
            self._store.register(get_types_from_msg(fields, name))

    def topics(self, *types: str) -> dict[str, TopicInfo]:
        """Topics that hold messages of some types (of any, if none is given), by name."""
        return {
            name: topic
            for name, topic in self._topics.items()
            if topic.msgcount and (not types or topic.msgtype in types)
        }

    def first(self, topic: str) -> Any:
        """First message of a topic; see `messages`."""
        for _, _, message in self.messages([topic]):
            return message
        raise mismatch(f"{self.path}: {shown(topic)}", "a message", "none")

    def messages(self, topics: Iterable[str]) -> Iterator[tuple[str, int, Any]]:
        """Messages of some topics in the order in which they were received.

        Yields
        ------
        topic : str
        received_ns : int
            When it was written down, by the recorder's clock [ns].
        message
            With the fields that ROS gives its type.

        Raises
        ------
        ValueError
            If the bag is damaged, was cut short, or holds another type under a known name.
        """
        wanted = set(topics)
        connections = [one for one in self._reader.connections if one.topic in wanted]
        for connection in connections:
            self._check_type(connection)
        with _readable(self.path):
            # Without connections a reader gives all messages.
            stream = self._reader.messages(connections=connections) if connections else ()
            for connection, received_ns, data in stream:
                yield connection.topic, received_ns, self._message(connection, data)

    def _message(self, connection: Connection, data: bytes) -> Any:
        if len(data) > LARGEST_BYTES:
            found = f"{len(data)} bytes of {shown(connection.topic)}"
            raise mismatch(f"{self.path}: message", f"at most {LARGEST_BYTES} bytes", found)
        if not self._ros1:
            return self._store.deserialize_cdr(data, connection.msgtype)
        place, mark = REALSENSE_MARK
        marked = connection.msgtype == IMAGE and bytes(data[place]) == mark
        return self._store.deserialize_ros1(data, REALSENSE_IMAGE if marked else connection.msgtype)

    def _check_type(self, connection: Connection) -> None:
        """Reject a type that goes by a known name and is another: its fields would be misread."""
        name, digest = connection.msgtype, connection.digest
        place = f"{self.path}: {shown(connection.topic)}: type"
        if name not in self._store.fielddefs:
            raise mismatch(place, "one that ROS defines", shown(name))
        store = self._store
        known = store.generate_msgdef(name)[1] if self._ros1 else store.hash_rihs01(name)
        if digest and digest not in ("*", known):
            raise mismatch(place, f"{name} {known}", shown(digest))


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a ``.bag`` of ROS 1, a folder of ROS 2 with ``metadata.yaml``, a ``.mcap`` or ``.db3``.

    Raises
    ------
    ValueError
        If there is no such bag, it is damaged or cut short, or states sizes beyond all reason.
    """
    path = Path(path)
    ros1 = path.suffix == ".bag" and path.is_file()
    if not ros1:
        _check_ros2(path)
    with _readable(path):
        reader = rosbag1.Reader(path) if ros1 else rosbag2.Reader(path)
        reader.open()
    try:
        with _readable(path):
            bag = Bag(path, reader, ros1=ros1)
        yield bag
    finally:
        reader.close()


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Say in one line what the reader finds wrong.

    A damaged bag raises whatever its bytes lead to, from assertions to lack of memory.
    """
    try:
        yield
    except Exception as error:
        if isinstance(error, ValueError) and str(error).startswith(f"{path}: "):
            raise
        reason = shown(" ".join(str(error).split()) or type(error).__name__)
        raise mismatch(f"{path}: content", "a whole bag", reason) from error


def _check_ros2(path: Path) -> None:
    """Reject what is no bag, and compression that would unpack to any size before it is seen."""
    if path.is_file() and path.suffix in ENDINGS:
        return
    metadata = path / "metadata.yaml"
    if not metadata.is_file():
        known = "a .bag, .mcap or .db3 file, a folder with metadata.yaml, or one with rgb.txt"
        found = "a folder without them" if path.is_dir() else "another file"
        found = found if path.exists() else "nothing"
        raise mismatch(f"{path}: recording", known, found)
    if (size := metadata.stat().st_size) > LARGEST_METADATA_BYTES:
        raise mismatch(f"{metadata}: size", f"at most {LARGEST_METADATA_BYTES} bytes", size)
    with _readable(metadata):
        stated = yaml.safe_load(metadata.read_text(encoding="utf-8"))
        mode = stated["rosbag2_bagfile_information"].get("compression_mode") or "none"
    if str(mode).lower() not in ("none", "storage"):
        expected = "none (ros2 bag convert makes such a bag)"
        raise mismatch(f"{metadata}: compression_mode", expected, shown(mode))


def held(bag: Bag, others: Sequence[str] = ()) -> str:
    """What is found where there is no such image: others, or topics of other types."""
    if others:
        return f"none but {others[0]}"
    held = [f"{shown(name)} of {shown(topic.msgtype)}" for name, topic in bag.topics().items()]
    more = len(held) - MOST_SHOWN
    rest = f" and {more} other{'s' if more > 1 else ''}" if more > 0 else ""
    return f"none (it holds {', '.join(held[:MOST_SHOWN]) or 'no messages'}{rest})"


def chosen(
    bag: Bag, what: str, found: list[str], asked: str | None, kind: str, none: str = "none"
) -> str:
    """The topic that was asked for, or the only one."""
    if asked in found or (not asked and len(found) == 1):
        return asked or found[0]
    listed = ", ".join(map(shown, found)) or none
    if asked:
        held = bag.topics().get(asked)
        here = f"{held.msgtype} that can't serve" if held else "no such topic"
        raise mismatch(f"{bag.path}: --{what} {shown(asked)}", f"a topic of {kind}: {listed}", here)
    which = f", named by --{what}" if found else ""
    raise mismatch(f"{bag.path}: {what}", f"one topic of {kind}{which}", listed)


def stamp_ns(message: Any, received_ns: int) -> int:
    """Stamp of a message [ns]; of one without a header, its time of receipt."""
    if not hasattr(message, "header"):
        return received_ns
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)
