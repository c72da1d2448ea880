"""Bags of ROS 1 and ROS 2, read message by message; nothing that they state is believed unchecked.

Messages are read as the types that ROS itself defines, never as the bag defines them: a bag's own
definitions would become code.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import yaml
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

IMAGE = "sensor_msgs/msg/Image"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
WRENCH = "geometry_msgs/msg/Wrench"
WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
TRANSFORM = "geometry_msgs/msg/Transform"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
FLOAT = "std_msgs/msg/Float32"
TEXT = "std_msgs/msg/String"
KEY_VALUE = "diagnostic_msgs/msg/KeyValue"
# A message must fit into memory.
LARGEST_BYTES = 2**28
LARGEST_METADATA_BYTES = 2**24
# Recordings of the RealSense SDK mark the header and put the depth's unit behind the pixels, under
# the name and digest of the plain type.
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
ROS1_TYPES = (
    (REALSENSE_FIELDS, REALSENSE_IMAGE),
    ("geometry_msgs/TransformStamped[] transforms", TRANSFORMS),
)
REALSENSE_MARK = slice(12, 17), b"\x01\x00\x00\x001"
EXTENSIONS = {".bag": "ROS 1", ".mcap": "ROS 2", ".db3": "ROS 2"}
LONGEST_NAME = 100


@dataclass(frozen=True)
class Topic:
    """A topic of a bag: its name, the type of its messages, and how many there are."""

    name: str
    type: str
    count: int


class Bag:
    """An open bag; `open_bag` makes it.

    Parameters
    ----------
    path : Path
        File or folder, for messages.
    reader : rosbags reader
        Open.
    ros1 : bool
        Whether messages are serialised as in ROS 1.
    """

    def __init__(self, path: Path, reader: Any, *, ros1: bool) -> None:
        self.path, self._reader, self._ros1 = path, reader, ros1
        self._store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        if ros1:
            for fields, name in ROS1_TYPES:
                self._store.register(get_types_from_msg(fields, name))

    def topics(self, *types: str) -> dict[str, Topic]:
        """Topics that hold messages of some types (of any, if none is given), by name."""
        found: dict[str, Topic] = {}
        for connection in sorted(self._reader.connections, key=lambda one: one.topic):
            if connection.msgcount and (not types or connection.msgtype in types):
                before = found.get(connection.topic)
                count = connection.msgcount + (before.count if before else 0)
                found[connection.topic] = Topic(connection.topic, connection.msgtype, count)
        return found

    def first(self, topic: str) -> Any:
        """First message of a topic.

        Raises
        ------
        ValueError
            If it can't be read.
        """
        for _, _, message in islice(self.messages([topic]), 1):
            return message
        raise ValueError(f"{self.path}: {shown(topic)}: expected a message, found none")

    def messages(self, topics: Iterable[str]) -> Iterator[tuple[str, int, Any]]:
        """Messages of some topics in the order in which they were received.

        Parameters
        ----------
        topics : iterable of str

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
        stream = iter(self._reader.messages(connections=connections)) if connections else iter(())
        while True:
            with _readable(self.path):
                item = next(stream, None)
                if item is None:
                    return
                connection, received_ns, data = item
                message = self._message(connection, data)
            yield connection.topic, received_ns, message

    def _message(self, connection: Any, data: bytes) -> Any:
        if len(data) > LARGEST_BYTES:
            expected = f"at most {LARGEST_BYTES} bytes"
            found = f"{len(data)} bytes of {shown(connection.topic)}"
            raise ValueError(f"{self.path}: message: expected {expected}, found {found}")
        if not self._ros1:
            return self._store.deserialize_cdr(data, connection.msgtype)
        place, mark = REALSENSE_MARK
        marked = connection.msgtype == IMAGE and bytes(data[place]) == mark
        return self._store.deserialize_ros1(data, REALSENSE_IMAGE if marked else connection.msgtype)

    def _check_type(self, connection: Any) -> None:
        """Refuse a type that goes by a known name and is another: its fields would be misread."""
        name, digest = connection.msgtype, connection.digest
        if name not in self._store.fielddefs:
            line = f"type: expected one that ROS defines, found {shown(name)}"
            raise ValueError(f"{self.path}: {shown(connection.topic)}: {line}")
        known = (
            self._store.generate_msgdef(name)[1] if self._ros1 else self._store.hash_rihs01(name)
        )
        if digest and digest != "*" and digest != known:
            line = f"type: expected {name} {known}, found {shown(digest)}"
            raise ValueError(f"{self.path}: {shown(connection.topic)}: {line}")


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a bag.

    Parameters
    ----------
    path : path
        A ``.bag`` of ROS 1, a folder of ROS 2 with ``metadata.yaml``, or one ``.mcap`` or ``.db3``.

    Yields
    ------
    Bag

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
        yield Bag(path, reader, ros1=ros1)
    finally:
        reader.close()


def shown(text: object) -> str:
    """A name out of a bag as it can be printed: nothing that steers the terminal, and no novel."""
    plain = "".join(letter if letter.isprintable() else "?" for letter in str(text))
    return plain if len(plain) <= LONGEST_NAME else plain[:LONGEST_NAME] + "..."


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
        raise ValueError(f"{path}: content: expected a whole bag, found {reason}") from error


def _check_ros2(path: Path) -> None:
    """Refuse what is no bag, and compression that would unpack to any size before it is seen."""
    if path.is_file() and path.suffix in EXTENSIONS:
        return
    metadata = path / "metadata.yaml"
    if not metadata.is_file():
        known = "a .bag, .mcap or .db3 file, a folder with metadata.yaml, or one with rgb.txt"
        found = "a folder without them" if path.is_dir() else "another file"
        found = found if path.exists() else "nothing"
        raise ValueError(f"{path}: recording: expected {known}, found {found}")
    if metadata.stat().st_size > LARGEST_METADATA_BYTES:
        size = metadata.stat().st_size
        raise ValueError(
            f"{metadata}: size: expected at most {LARGEST_METADATA_BYTES} bytes, found {size}"
        )
    with _readable(metadata):
        stated = yaml.safe_load(metadata.read_text(encoding="utf-8"))
        mode = stated["rosbag2_bagfile_information"].get("compression_mode") or "none"
    if str(mode).lower() not in ("none", "storage"):
        expected = "none (ros2 bag convert makes such a bag)"
        raise ValueError(f"{metadata}: compression_mode: expected {expected}, found {shown(mode)}")
