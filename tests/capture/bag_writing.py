"""Recordings as other software would have written them, made of one short film."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

COLOR, DEPTH, WRENCH = "/camera/color/image_raw", "/camera/depth/image_raw", "/ft_sensor/wrench"
COLOR_INFO, DEPTH_INFO = "/camera/color/camera_info", "/camera/depth/camera_info"
COLOR_FRAME, DEPTH_FRAME, BODY_FRAME = "color_optical", "depth_optical", "camera_link"
DISTORTION = (0.02, -0.05, 0.001, -0.002, 0.01)
NANOSECONDS = 10**9
ENCODINGS = {"uint8": "rgb8", "uint16": "16UC1", "float32": "32FC1"}
# Quaternion and translation [m] of each camera in the camera's body.
COLOR_POSE = (0.5, -0.5, 0.5, -0.5), (0.01, 0.02, 0.03)
DEPTH_POSE = (0.49, -0.51, 0.49, -0.5097058), (0.01, 0.045, 0.028)
CAMERAS = (BODY_FRAME, COLOR_FRAME, COLOR_POSE), (BODY_FRAME, DEPTH_FRAME, DEPTH_POSE)


@dataclass(frozen=True)
class Film:
    """Images, wrenches and their stamps [ns]; optics as (fx, fy, cx, cy) [px]."""

    color: list[NDArray]
    depth: list[NDArray]
    color_ns: NDArray
    depth_ns: NDArray
    wrench: NDArray
    wrench_ns: NDArray
    color_optics: tuple
    depth_optics: tuple


def stand_in(frames=6, size=(48, 64), *, rate_hz=30, start_s=1_700_000_000, plain=False):
    """A small film of noise (or of a grey for each frame) with a wrench of 1 kHz around it."""
    random = np.random.default_rng(3)
    if plain:
        color = [np.broadcast_to(np.uint8(k), (*size, 3)) for k in range(frames)]
        depth = [np.broadcast_to(np.uint16(700 + k), size) for k in range(frames)]
    else:
        color = [random.integers(0, 255, (*size, 3), dtype=np.uint8) for _ in range(frames)]
        depth = [random.integers(400, 900, size, dtype=np.uint16) for _ in range(frames)]
    step = NANOSECONDS // rate_hz
    color_ns = start_s * NANOSECONDS + np.arange(frames) * step
    wrench_ns = np.arange(color_ns[0] - 10**8, color_ns[-1] + 10**8, 10**6)
    wrench = random.normal(size=(len(wrench_ns), 6))
    optics = (60.5, 61.25, 31.0, 23.5), (70.5, 71.25, 32.0, 24.5)
    return Film(color, depth, color_ns, color_ns + step // 10, wrench, wrench_ns, *optics)


class Messages:
    """Messages of one ROS."""

    def __init__(self, *, ros1):
        self.ros1 = ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
        if ros1:
            fields = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(fields, "tf2_msgs/msg/TFMessage"))

    def make(self, name, **fields):
        return self.store.types[name](**fields)

    def header(self, stamp_ns, frame):
        seconds, rest = divmod(int(stamp_ns), NANOSECONDS)
        stamp = self.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        extra = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **extra)

    def image(self, pixels, stamp_ns, frame, encoding=None):
        pixels = np.ascontiguousarray(pixels)
        rest = {"encoding": encoding or ENCODINGS[pixels.dtype.name], "is_bigendian": 0}
        rest |= {"height": pixels.shape[0], "width": pixels.shape[1], "step": pixels.strides[0]}
        data = np.frombuffer(pixels.tobytes(), np.uint8)
        header = self.header(stamp_ns, frame)
        return self.make("sensor_msgs/msg/Image", header=header, data=data, **rest)

    def compressed(self, data, stamp_ns, frame, kind):
        header = self.header(stamp_ns, frame)
        data = np.frombuffer(data, np.uint8)
        return self.make("sensor_msgs/msg/CompressedImage", header=header, format=kind, data=data)

    def info(self, size, optics, stamp_ns, frame, distortion=(), model="plumb_bob"):
        fx, fy, cx, cy = optics
        K = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], float)
        P = np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], float)
        arrays = {"D": np.array(distortion, float), "K": K, "R": np.eye(3).ravel(), "P": P}
        if not self.ros1:
            arrays = {name.lower(): value for name, value in arrays.items()}
        sides = dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0)
        roi = self.make("sensor_msgs/msg/RegionOfInterest", **sides, do_rectify=False)
        header = self.header(stamp_ns, frame)
        size = {"height": size[0], "width": size[1]}
        rest = {"distortion_model": model, "binning_x": 0, "binning_y": 0, "roi": roi}
        return self.make("sensor_msgs/msg/CameraInfo", header=header, **size, **rest, **arrays)

    def wrench(self, values, stamp_ns):
        force, torque = (self.vector(part) for part in (values[:3], values[3:]))
        plain = self.make("geometry_msgs/msg/Wrench", force=force, torque=torque)
        header = self.header(stamp_ns, "tool")
        return self.make("geometry_msgs/msg/WrenchStamped", header=header, wrench=plain)

    def vector(self, values):
        names = dict(zip("xyz", map(float, values), strict=True))
        return self.make("geometry_msgs/msg/Vector3", **names)

    def transform(self, pose):
        quaternion = dict(zip("xyzw", map(float, pose[0]), strict=True))
        both = {"rotation": self.make("geometry_msgs/msg/Quaternion", **quaternion)}
        both["translation"] = self.vector(pose[1])
        return self.make("geometry_msgs/msg/Transform", **both)

    def transforms(self, stamp_ns, frames=CAMERAS):
        stamped, name = [], "geometry_msgs/msg/TransformStamped"
        for parent, child, pose in frames:
            place = {"child_frame_id": child, "transform": self.transform(pose)}
            stamped.append(self.make(name, header=self.header(stamp_ns, parent), **place))
        return self.make("tf2_msgs/msg/TFMessage", transforms=stamped)


def camera_messages(film, messages):
    """(topic, received [ns], message) of a camera driver and a force sensor's driver."""
    start = int(film.wrench_ns[0])
    size, depth_size = film.color[0].shape[:2], film.depth[0].shape
    color = messages.info(size, film.color_optics, start, COLOR_FRAME, DISTORTION)
    depth = messages.info(depth_size, film.depth_optics, start, DEPTH_FRAME, [0.0] * 5)
    found = [(COLOR_INFO, start, color), (DEPTH_INFO, start, depth)]
    found.append(("/tf_static", start, messages.transforms(start)))
    for image, stamp in zip(film.color, film.color_ns, strict=True):
        found.append((COLOR, stamp + 5_000_000, messages.image(image, stamp, COLOR_FRAME)))
    for image, stamp in zip(film.depth, film.depth_ns, strict=True):
        found.append((DEPTH, stamp + 9_000_000, messages.image(image, stamp, DEPTH_FRAME)))
    for values, stamp in zip(film.wrench, film.wrench_ns, strict=True):
        found.append((WRENCH, stamp + 100_000, messages.wrench(values, stamp)))
    return found


def write_bag(writer, found, store, serialise):
    with writer as bag:
        topics = {}
        for topic, received_ns, message in sorted(found, key=lambda item: item[1]):
            name = message.__msgtype__
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, name, typestore=store)
            bag.write(topics[topic], int(received_ns), serialise(message, name))


def write_ros1(path, found, messages, compression=None):
    """A bag of ROS 1."""
    writer = rosbag1.Writer(path)
    if compression:
        writer.set_compression(compression)
    write_bag(writer, found, messages.store, messages.store.serialize_ros1)
    return path


def write_ros2(path, found, messages, plugin=StoragePlugin.SQLITE3, compression=None):
    """A bag of ROS 2, a folder."""
    writer = rosbag2.Writer(path, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(*compression)
    write_bag(writer, found, messages.store, messages.store.serialize_cdr)
    return path


def write_realsense(path, film, *, unit_m=0.001, marked=True, option="Depth Units", clock=None):
    """A recording of the RealSense SDK: newer ones mark headers and append the depth's unit."""
    messages = Messages(ros1=True)
    streams = {
        "/device_0/sensor_1/Color_0": (film.color, film.color_ns, "rgb8", film.color_optics, 0.0),
        "/device_0/sensor_0/Depth_0": (film.depth, film.depth_ns, "mono16", film.depth_optics, 1.0),
        "/device_0/sensor_0/Infrared_1": (film.depth, film.depth_ns, "8UC1", film.depth_optics, 0),
    }
    shifts = {"Color_0": (0.015, 0.0, 0.0), "Depth_0": (0.0, 0.0, 0.0)}
    found, tails = [], {}
    if option:
        unit = messages.make("std_msgs/msg/Float32", data=unit_m)
        found.append((f"/device_0/sensor_0/option/{option}/value", 1, unit))
    for stem, (images, stamps, encoding, optics, counted) in streams.items():
        info = messages.info(images[0].shape[:2], optics, 0, "", [0.0] * 5, "Brown Conrady")
        found.append((f"{stem}/info/camera_info", 1, info))
        if shift := shifts.get(stem.rpartition("/")[2]):
            found.append((f"{stem}/tf/0", 1, messages.transform(((0.0, 0.0, 0.0, 1.0), shift))))
        if clock:
            pair = {"key": "timestamp_domain", "value": clock}
            pair = messages.make("diagnostic_msgs/msg/KeyValue", **pair)
            found.append((f"{stem}/image/metadata", 2, pair))
        for image, stamp in zip(images, stamps, strict=True):
            pixels = image.astype(np.uint8) if encoding == "8UC1" else image
            one = messages.image(pixels, stamp, "1" if marked else "0", encoding)
            tails[id(one)] = np.float32(counted * unit_m).tobytes() if marked else b""
            # The recorder's own clock starts at zero.
            found.append((f"{stem}/image/data", int(stamp - stamps[0]) + 2, one))

    def serialise(message, name):
        return bytes(messages.store.serialize_ros1(message, name)) + tails.get(id(message), b"")

    write_bag(rosbag1.Writer(path), found, messages.store, serialise)
    return path


def write_tum(folder, film, *, factor=5000, wrench=True):
    """A folder as the benchmark of the TU Munich lays it out."""
    folder = Path(folder)
    color = [image[..., ::-1] for image in film.color]
    depth = [image * np.uint16(factor // 1000) for image in film.depth]
    for kind, images, stamps in (("rgb", color, film.color_ns), ("depth", depth, film.depth_ns)):
        (folder / kind).mkdir(parents=True)
        files = [f"{kind}/{seconds(stamp)}.png" for stamp in stamps]
        for image, file in zip(images, files, strict=True):
            cv2.imwrite(str(folder / file), image)
        lines = [f"{seconds(stamp)} {file}" for stamp, file in zip(stamps, files, strict=True)]
        (folder / f"{kind}.txt").write_text("\n".join(["# timestamp filename", *lines]) + "\n")
    if wrench:
        write_wrenches(folder / "force.csv", film)
    return folder


def write_wrenches(path, film):
    """Of a film, as a table."""
    rows = zip(film.wrench_ns, film.wrench, strict=True)
    lines = [f"{seconds(stamp)},{','.join(map(repr, map(float, row)))}" for stamp, row in rows]
    head = "time_s,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm"
    path.write_text("\n".join([head, *lines]) + "\n")
    return path


def seconds(stamp_ns):
    """A stamp as text [s], exact."""
    return f"{int(stamp_ns) // NANOSECONDS}.{int(stamp_ns) % NANOSECONDS:09d}"
