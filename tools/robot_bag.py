"""A ROS 2 bag of an indentation that the lab recorded with a robot: TF, wrench, colour and depth.

python tools/robot_bag.py raw/foam_block/kinect_robot/08 bag
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from palpate.capture.images import depth_of
from palpate.capture.poses import read_poses
from palpate.capture.tables import GAUGE_COLUMNS, read_force, read_frames
from palpate.yaml_files import load_yaml
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = {name.rpartition("/")[2]: kind for name, kind in STORE.types.items()}
START_S, VERSION = 1_700_000_000, 9
FLANGE, CAMERA, DEPTH = "tool0", "camera_color_optical_frame", "camera_depth_optical_frame"
# Where the robot's flange holds the probe: the target's frame in the flange's.
FLANGE_FROM_TARGET = np.array([[1, 0, 0, -0.03], [0, 1, 0, 0.05], [0, 0, 1, 0.12], [0, 0, 0, 1.0]])


def write_bag(capture: Path, bag: Path, sensor: dict, probe: dict) -> None:
    """Write a capture's folder as a bag.

    Parameters
    ----------
    capture : Path
        With pictures, force.csv and probe_poses.csv.
    bag : Path
        Folder that is not there yet.
    sensor, probe : mapping
        The sensor's file, with ``base``, and the probe's, with ``tracked`` and ``gauge``.
    """
    frames, force, poses = read_frames(capture), read_force(capture), read_poses(capture)
    base, tracked = sensor["base"]["name"], probe["tracked"]
    base_from_camera = np.linalg.inv(sensor["base"]["camera_from_base"])
    fixed = {
        (FLANGE, tracked): FLANGE_FROM_TARGET,
        (base, CAMERA): base_from_camera,
        (CAMERA, DEPTH): np.array(sensor["depth"]["color_from_depth"]),
    }
    flange = poses.base_from_tracked @ np.linalg.inv(FLANGE_FROM_TARGET)
    wrench = force[list(GAUGE_COLUMNS)].to_numpy() @ np.transpose(probe["gauge"]["calibration"])
    first_s = min(force["time_s"].min(), poses.time_s[0])
    events = [(first_s, "/tf_static", lambda s: _tf(s, fixed))]
    events += [
        (s, "/tf", lambda s, pose=pose: _tf(s, {(base, FLANGE): pose}))
        for s, pose in zip(poses.time_s, flange, strict=True)
    ]
    events += [
        (s, "/wrench", lambda s, row=row: _wrench(s, row))
        for s, row in zip(force["time_s"], wrench, strict=True)
    ]
    for kind, frame in (("color", CAMERA), ("depth", DEPTH)):
        topic, spec = f"/camera/{kind}", sensor[kind]
        for s, name in zip(frames["time_s"], frames[kind], strict=True):
            how = (capture / name, spec, frame)
            events.append((s, f"{topic}/camera_info", lambda s, how=how: _info(s, *how[1:])))
            events.append((s, f"{topic}/image_raw", lambda s, how=how: _image(s, *how)))
    with Writer(bag, version=VERSION) as writer:
        known = {}
        for s, topic, message in sorted(events, key=lambda event: event[0]):
            content = message(s)
            kind = content.__msgtype__
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(known[topic], _ns(s), STORE.serialize_cdr(content, kind))


def _ns(time_s: float) -> int:
    return START_S * 10**9 + round(time_s * 1e9)


def _header(time_s: float, frame: str) -> object:
    seconds, rest = divmod(_ns(time_s), 10**9)
    return TYPES["Header"](stamp=TYPES["Time"](sec=seconds, nanosec=rest), frame_id=frame)


def _tf(time_s: float, transforms: dict[tuple[str, str], NDArray]) -> object:
    found = []
    for (parent, child), pose in transforms.items():
        x, y, z, w = map(float, Rotation.from_matrix(pose[:3, :3]).as_quat())
        shift = TYPES["Vector3"](*map(float, pose[:3, 3]))
        transform = TYPES["Transform"](shift, TYPES["Quaternion"](x, y, z, w))
        found.append(TYPES["TransformStamped"](_header(time_s, parent), child, transform))
    return TYPES["TFMessage"](found)


def _wrench(time_s: float, row: NDArray) -> object:
    force, torque = (TYPES["Vector3"](*map(float, part)) for part in (row[:3], row[3:]))
    return TYPES["WrenchStamped"](_header(time_s, "ft_sensor"), TYPES["Wrench"](force, torque))


def _info(time_s: float, spec: dict, frame: str) -> object:
    fx, fy, cx, cy = (spec[key] for key in ("fx_px", "fy_px", "cx_px", "cy_px"))
    K = np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0])
    P = np.insert(K, [3, 6, 9], 0.0)
    size = spec["height_px"], spec["width_px"]
    whole = TYPES["RegionOfInterest"](0, 0, 0, 0, False)
    lens = "plumb_bob", np.array(spec["distortion"], dtype=float), K, np.eye(3).ravel(), P
    return TYPES["CameraInfo"](_header(time_s, frame), *size, *lens, 0, 0, whole)


def _image(time_s: float, path: Path, spec: dict, frame: str) -> object:
    """Pictures as they are; depth in millimetres, as drivers publish it."""
    pixels, encoding = cv2.imread(str(path), cv2.IMREAD_UNCHANGED), spec["encoding"]
    pixels = pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB)
    if pixels.dtype == np.uint16:
        depth_mm = np.round(1000 * np.nan_to_num(depth_of(pixels, spec)))
        pixels, encoding = depth_mm.clip(0, 65535).astype("<u2"), "16UC1"
    height, width = pixels.shape[:2]
    step, data = pixels.nbytes // height, np.frombuffer(pixels.tobytes(), dtype=np.uint8)
    how = height, width, encoding, 0, step, data
    return TYPES["Image"](_header(time_s, frame), *how)


if __name__ == "__main__":
    folder, to = map(Path, sys.argv[1:])
    of_sensor = load_yaml(f"config/sensors/{folder.parent.name}.yaml")
    write_bag(folder, to, of_sensor, load_yaml("config/probes/nano25_sphere.yaml"))
