"""A ROS 2 bag of an indentation that the lab recorded with a robot: TF, wrench, colour and depth.

python tools/robot_bag.py raw/foam_block/kinect_robot/08 bag
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palpate.capture.images import depth_of, read_samples
from palpate.capture.poses import POSES, read_poses
from palpate.capture.tables import force_columns, read_force, read_frames
from palpate.units import MILLIMETRES
from palpate.yaml_files import load_yaml
from scipy.spatial.transform import Rotation

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/capture"))
from bag_writing import NANOSECONDS, Messages, write_ros2  # noqa: E402

START_NS = 1_700_000_000 * NANOSECONDS
FLANGE, CAMERA, DEPTH = "tool0", "camera_color_optical_frame", "camera_depth_optical_frame"
# Where the robot's flange holds the probe: the target's frame in the flange's [m].
FLANGE_FROM_TARGET = np.array([[1, 0, 0, -0.03], [0, 1, 0, 0.05], [0, 0, 1, 0.12], [0, 0, 0, 1.0]])


def write_bag(capture: Path, bag: Path, sensor: Mapping, probe: Mapping) -> None:
    """Write a capture's folder as a bag, or a background's, of pictures alone.

    Parameters
    ----------
    capture : Path
        With pictures; a capture's with force.csv and probe_poses.csv.
    bag : Path
        Folder that is not there yet.
    sensor, probe : mapping
        The sensor's file, with ``base``, and the probe's, with ``tracked``.
    """
    frames, base = read_frames(capture), sensor["base"]["name"]
    messages, indented = Messages(ros1=False), (capture / POSES).is_file()

    def ns(time_s: float) -> int:
        return START_NS + round(time_s * NANOSECONDS)

    def tf(topic: str, time_s: float, transforms: Mapping[tuple[str, str], NDArray]) -> tuple:
        """Poses (4, 4) [m] of frames in others, by both names."""
        parts = [
            (*names, (Rotation.from_matrix(pose[:3, :3]).as_quat(), pose[:3, 3]))
            for names, pose in transforms.items()
        ]
        return topic, ns(time_s), messages.transforms(ns(time_s), parts)

    fixed = {
        (FLANGE, probe["tracked"]): FLANGE_FROM_TARGET,
        (base, CAMERA): np.linalg.inv(sensor["base"]["camera_from_base"]),
        (CAMERA, DEPTH): np.array(sensor["depth"]["color_from_depth"]),
    }
    found = [tf("/tf_static", -1.0, fixed)]
    if indented:
        force, poses = read_force(capture), read_poses(capture)
        flange = poses.base_from_tracked @ np.linalg.inv(FLANGE_FROM_TARGET)
        moving = zip(poses.time_s, flange, strict=True)
        found += [tf("/tf", s, {(base, FLANGE): pose}) for s, pose in moving]
        wrench = force[list(force_columns(force.columns, probe))].to_numpy()
        if "gauge" in probe:
            wrench = wrench @ np.transpose(probe["gauge"]["calibration"])
        rows = zip(map(ns, force["time_s"]), wrench, strict=True)
        found += [("/wrench", stamp, messages.wrench(row, stamp)) for stamp, row in rows]
    for kind, frame in (("color", CAMERA), ("depth", DEPTH)):
        spec = sensor[kind]
        size = spec["height_px"], spec["width_px"]
        optics = [spec[key] for key in ("fx_px", "fy_px", "cx_px", "cy_px")]
        for stamp, name in zip(map(ns, frames["time_s"]), frames[kind], strict=True):
            info = messages.info(size, optics, stamp, frame, spec["distortion"])
            pixels, encoding = read_samples(capture / name, spec["encoding"]), spec["encoding"]
            if kind == "depth":  # in millimetres, as drivers publish it
                depth_mm = np.round(MILLIMETRES * np.nan_to_num(depth_of(pixels, spec)))
                pixels, encoding = depth_mm.clip(0, 65535).astype(np.uint16), "16UC1"
            image = messages.image(pixels, stamp, frame, encoding)
            found.append((f"/camera/{kind}/camera_info", stamp, info))
            found.append((f"/camera/{kind}/image_raw", stamp, image))
    write_ros2(bag, found, messages)


if __name__ == "__main__":
    folder, to = map(Path, sys.argv[1:])
    of_sensor = load_yaml(ROOT / f"config/sensors/{folder.parent.name}.yaml")
    write_bag(folder, to, of_sensor, load_yaml(ROOT / "config/probes/nano25_sphere.yaml"))
