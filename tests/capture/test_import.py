"""Recordings of every kind become the same capture, frame by frame and sample by sample."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
import yaml
from bag_writing import (
    COLOR,
    COLOR_INFO,
    COLOR_POSE,
    DEPTH,
    DEPTH_FRAME,
    DEPTH_INFO,
    DEPTH_POSE,
    NANOSECONDS,
    WRENCH,
    Film,
    Messages,
    camera_messages,
    stand_in,
    write_realsense,
    write_ros1,
    write_ros2,
    write_tum,
)
from palpate.capture.__main__ import main
from palpate.capture.images import read_image
from palpate.capture.tables import GAUGE_COLUMNS, WRENCH_COLUMNS, read_force, read_frames
from palpate.vision.clouds import scene_points
from palpate.vision.depth import kinect_depth
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from scipy.spatial.transform import RigidTransform, Rotation

START_S = 1_700_000_000
RATE_HZ = 30
FRAMES = 5


@pytest.fixture(scope="module")
def film(root, probe):
    """Half of the sample's capture with the Kinect, as a camera of millimetres would have it."""
    sensor = yaml.safe_load((root / "tests/sample/sensors/kinect.yaml").read_text())
    folder = root / "tests/sample/raw/foam_block/kinect/08"
    frames, force = read_frames(folder).iloc[:FRAMES], read_force(folder).iloc[::4]
    volts = force[list(GAUGE_COLUMNS)].to_numpy()
    color = [read_image(folder / name, "bayer_rggb8") for name in frames["color"]]
    depth = [millimetres(folder / name, sensor["depth"]) for name in frames["depth"]]
    names = ("fx_px", "fy_px", "cx_px", "cy_px")
    stamps = nanoseconds(frames["time_s"])
    return Film(
        color,
        depth,
        stamps,
        stamps + 4_000_000,
        volts @ np.array(probe["gauge"]["calibration"]).T,
        nanoseconds(force["time_s"]),
        tuple(sensor["color"][name] for name in names),
        tuple(sensor["depth"][name] for name in names),
    )


def millimetres(path, spec):
    depth_m = kinect_depth(read_image(path, "kinect_disparity"), spec)
    return np.nan_to_num(np.rint(1000 * depth_m)).astype(np.uint16)


def nanoseconds(times_s):
    return START_S * NANOSECONDS + np.rint(times_s.to_numpy() * 1e9).astype(np.int64)


def ros1(path, film):
    messages = Messages(ros1=True)
    return write_ros1(path / "film.bag", camera_messages(film, messages), messages)


def ros1_lz4(path, film):
    messages, lz4 = Messages(ros1=True), Writer1.CompressionFormat.LZ4
    return write_ros1(path / "film.bag", camera_messages(film, messages), messages, lz4)


def sqlite3(path, film):
    messages = Messages(ros1=False)
    return write_ros2(path / "film", camera_messages(film, messages), messages)


def mcap_folder(path, film):
    messages, zstd = Messages(ros1=False), (CompressionMode.STORAGE, CompressionFormat.ZSTD)
    found = camera_messages(film, messages)
    return write_ros2(path / "film", found, messages, StoragePlugin.MCAP, zstd)


def mcap_file(path, film):
    return next(mcap_folder(path, film).glob("*.mcap"))


def db3_file(path, film):
    return next(sqlite3(path, film).glob("*.db3"))


def realsense(path, film):
    return write_realsense(path / "film.bag", film)


def realsense_of_old(path, film):
    return write_realsense(path / "film.bag", film, marked=False)


def tum(path, film):
    return write_tum(path / "film", film)


def bring(recording, target, *options, sensors=None):
    sensors = sensors or target.parents[3] / "sensors"
    return main(["import", str(recording), str(target), "--sensors", str(sensors), *options])


def wrench_file(path, film):
    """Wrenches for a recording that can't hold any."""
    table = pd.DataFrame(film.wrench, columns=list(WRENCH_COLUMNS))
    table.insert(0, "time_s", film.wrench_ns / NANOSECONDS)
    table.to_csv(path / "wrench.csv", index=False)
    return path / "wrench.csv"


def options_for(kind, path, film):
    if kind in (realsense, realsense_of_old):
        return ["--force", str(wrench_file(path, film))]
    return ["--intrinsics", *map(str, film.color_optics)] if kind is tum else []


def assert_same(folder, film):
    frames, force = read_frames(folder), read_force(folder)
    assert len(frames) == len(film.color)
    np.testing.assert_allclose(frames["time_s"], film.color_ns / NANOSECONDS, rtol=0, atol=1e-6)
    np.testing.assert_allclose(force["time_s"], film.wrench_ns / NANOSECONDS, rtol=0, atol=1e-6)
    found = force[list(WRENCH_COLUMNS)].to_numpy()
    np.testing.assert_allclose(found, film.wrench, rtol=1e-8, atol=1e-12)
    for row, color, depth in zip(frames.itertuples(), film.color, film.depth, strict=True):
        assert np.array_equal(read_image(folder / row.color, "rgb8"), color)
        assert np.array_equal(read_image(folder / row.depth, "millimetre"), depth)


KINDS = [ros1, ros1_lz4, sqlite3, db3_file, mcap_folder, mcap_file]
KINDS += [realsense, realsense_of_old, tum]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_film_comes_back(kind, tmp_path):
    film = stand_in()
    target = tmp_path / "raw/block/camera/08-a02"
    options = options_for(kind, tmp_path, film)
    assert bring(kind(tmp_path, film), target, *options) == 0
    assert_same(target, film)
    assert sorted(path.name for path in target.parent.iterdir()) == ["08-a02"]


@pytest.mark.parametrize("kind", [ros1, mcap_file, realsense, tum], ids=lambda kind: kind.__name__)
def test_the_samples_capture_passes_the_check(kind, film, root, tmp_path, capsys):
    block = tmp_path / "raw/foam_block"
    shutil.copytree(
        root / "tests/sample/raw/foam_block", block, ignore=shutil.ignore_patterns("kinect", "bum*")
    )
    described = block / "object.yaml"
    described.write_text(
        described.read_text().replace("provenance: simulated", "provenance: recorded")
    )
    sensors = tmp_path / "sensors"
    options = options_for(kind, tmp_path, film)
    recording = kind(tmp_path, film)
    assert bring(recording, block / "camera/08", *options, sensors=sensors) == 0
    assert bring(recording, block / "camera", "--background", sensors=sensors) == 0
    capsys.readouterr()
    probes = root / "config/probes"
    assert main(["check", str(block), "--sensors", str(sensors), "--probes", str(probes)]) == 0
    assert f"{block}: nothing wrong" in capsys.readouterr().out
    assert_same(block / "camera/08", film)
    assert not (block / "camera/background/force.csv").exists()


def test_the_sensors_file_is_what_the_drivers_said(tmp_path):
    film = stand_in()
    bring(mcap_file(tmp_path, film), tmp_path / "raw/block/camera/08")
    spec = yaml.safe_load((tmp_path / "sensors/camera.yaml").read_text())
    assert (spec["sensor"], spec["kind"], spec["frame_rate_hz"]) == ("camera", "depth", RATE_HZ)
    for kind in ("color", "depth"):
        found = [spec[kind][name] for name in ("fx_px", "fy_px", "cx_px", "cy_px")]
        assert tuple(found) == getattr(film, f"{kind}_optics")
        assert (spec[kind]["width_px"], spec[kind]["height_px"]) == (64, 48)
    assert spec["color"]["distortion"] == [0.02, -0.05, 0.001, -0.002, 0.01]
    body_from_color, body_from_depth = (
        RigidTransform.from_components(translation, Rotation.from_quat(quaternion))
        for quaternion, translation in (COLOR_POSE, DEPTH_POSE)
    )
    expected = (body_from_color.inv() * body_from_depth).as_matrix()
    np.testing.assert_allclose(spec["depth"]["color_from_depth"], expected, atol=1e-8)


def test_depth_in_the_colour_cameras_frame(tmp_path):
    film, messages = stand_in(), Messages(ros1=False)
    found = camera_messages(film, messages, registered=True)
    found = [item for item in found if item[0] != "/tf_static"]
    bring(write_ros2(tmp_path / "film", found, messages), tmp_path / "raw/block/camera/08")
    spec = yaml.safe_load((tmp_path / "sensors/camera.yaml").read_text())
    np.testing.assert_array_equal(spec["depth"]["color_from_depth"], np.eye(4))


@pytest.mark.parametrize("metres", [False, True])
def test_a_plane_is_where_it_stood(metres, tmp_path):
    """Depth of a tilted plane by the camera's model, back through file and images."""
    film, messages = stand_in(size=(96, 128)), Messages(ros1=True)
    fx, fy, cx, cy = film.depth_optics
    rows, columns = np.mgrid[:96, :128]
    rays = np.stack([(columns - cx) / fx, (rows - cy) / fy, np.ones((96, 128))], axis=-1)
    normal, distance_m = np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97]), 0.8
    depth_m = distance_m / (rays @ normal)
    depth_m[10:20, 10:20] = np.nan
    depth = depth_m.astype(np.float32) if metres else np.nan_to_num(np.rint(1000 * depth_m))
    if not metres:
        depth = depth.astype(np.uint16)
    depths = [depth.copy() for _ in film.depth]
    for k, image in enumerate(depths):
        image[0, :k] = 0
    film = replace(film, depth=depths)
    target = tmp_path / "raw/block/camera/08"
    bag = write_ros1(tmp_path / "film.bag", camera_messages(film, messages), messages)
    assert bring(bag, target) == 0
    spec = yaml.safe_load((tmp_path / "sensors/camera.yaml").read_text())
    image = read_image(target / "depth/000000.png", "millimetre")
    assert not image[10:20, 10:20].any()
    points = scene_points({"depth": image}, spec)
    assert len(points) == 96 * 128 - 100
    color_from_depth = np.array(spec["depth"]["color_from_depth"])
    turned = color_from_depth[:3, :3] @ normal
    off = points @ turned - distance_m - turned @ color_from_depth[:3, 3]
    # Half a millimetre along the optical axis is more or less along the normal.
    assert np.abs(off).max() < 0.0005 * (rays @ normal).max() + 1e-6
    assert 0.0001 < off.std() < 0.0004  # a millimetre over the root of twelve


def test_other_encodings(tmp_path):
    """BGR and JPEG become RGB; compressed depth stays what it was."""
    film, messages = stand_in(size=(96, 128)), Messages(ros1=False)
    smooth = [cv2.GaussianBlur(image, (0, 0), 12) for image in film.color]
    film = replace(film, color=smooth)
    found = [item for item in camera_messages(film, messages) if item[0] not in (COLOR, DEPTH)]
    for k, stamp in enumerate(film.color_ns):
        jpeg = cv2.imencode(".jpg", smooth[k][..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])[1]
        one = messages.compressed(jpeg.tobytes(), stamp, "", "rgb8; jpeg compressed bgr8")
        found.append((f"{COLOR}/compressed", stamp, one))
        png = cv2.imencode(".png", film.depth[k])[1].tobytes()
        kind = "16UC1; compressedDepth png"
        one = messages.compressed(bytes(12) + png, film.depth_ns[k], DEPTH_FRAME, kind)
        found.append((f"{DEPTH}/compressedDepth", stamp + 1, one))
    target = tmp_path / "raw/block/camera/08"
    assert bring(write_ros2(tmp_path / "film", found, messages), target) == 0
    for k in range(len(smooth)):
        color = read_image(target / f"color/{k:06d}.png", "rgb8").astype(int)
        assert np.abs(color - smooth[k]).mean() < 2
        depth = read_image(target / f"depth/{k:06d}.png", "millimetre")
        assert np.array_equal(depth, film.depth[k])


def test_mosaics_and_bgr_and_big_endian_depth(tmp_path):
    film, messages = stand_in(), Messages(ros1=True)
    found = []
    for topic, received_ns, message in camera_messages(film, messages):
        if topic == COLOR:
            message.encoding = "bgr8"
        if topic == DEPTH:
            message.data = message.data.view(np.uint16).byteswap().view(np.uint8)
            message.is_bigendian = 1
        found.append((topic, received_ns, message))
    target = tmp_path / "raw/block/camera/08"
    assert bring(write_ros1(tmp_path / "film.bag", found, messages), target) == 0
    assert_same(target, replace(film, color=[image[..., ::-1] for image in film.color]))


def test_images_without_a_partner_are_told(tmp_path, capsys):
    film = stand_in(frames=12)
    some = [k for k in range(12) if k not in (3, 7)]
    less = replace(film, depth=[film.depth[k] for k in some], depth_ns=film.depth_ns[some])
    target = tmp_path / "raw/block/camera/08"
    assert bring(sqlite3(tmp_path, less), target) == 0
    told = capsys.readouterr().out
    assert "2 of 12 images have no depth image within half a frame (16.7 ms), left out" in told
    kept = replace(less, color=[film.color[k] for k in some], color_ns=film.color_ns[some])
    assert_same(target, kept)


def test_frames_before_the_first_force_are_told(tmp_path, capsys):
    film = stand_in(frames=12)
    late = film.wrench_ns >= film.color_ns[2] - 1_000_000
    film = replace(film, wrench=film.wrench[late], wrench_ns=film.wrench_ns[late])
    target = tmp_path / "raw/block/camera/08"
    assert bring(ros1(tmp_path, film), target) == 0
    told = "frames: 2 before the first and 0 after the last force sample, left out"
    assert told in capsys.readouterr().out
    assert len(read_frames(target)) == 10


def test_the_clock_is_the_headers(tmp_path):
    """Messages that were written down late, and not in the order of their stamps."""
    film, messages = stand_in(), Messages(ros1=True)
    random = np.random.default_rng(5)
    found = [
        (topic, received_ns + int(random.integers(0, 200_000_000)), message)
        for topic, received_ns, message in camera_messages(film, messages)
    ]
    found.sort(key=lambda item: item[1])
    target = tmp_path / "raw/block/camera/08"
    assert bring(write_ros1(tmp_path / "film.bag", found, messages), target) == 0
    assert_same(target, film)


def test_depth_units_of_a_realsense(tmp_path, capsys):
    film = stand_in()
    bag = write_realsense(tmp_path / "film.bag", film, unit_m=0.0001)
    options = ["--force", str(wrench_file(tmp_path, film))]
    assert bring(bag, tmp_path / "raw/block/camera/08", *options) == 0
    assert "100 um were rounded to whole millimetres" in capsys.readouterr().out
    depth = read_image(tmp_path / "raw/block/camera/08/depth/000000.png", "millimetre")
    assert np.array_equal(depth, np.rint(film.depth[0] / 10))


def realsense_of_ros2(path, film, unit):
    """What the SDK writes where names have no blanks and options are texts."""
    messages = Messages(ros1=False)
    stems = {COLOR: "/device_0/sensor_1/Color_0", DEPTH: "/device_0/sensor_0/Depth_0"}
    infos = {COLOR_INFO: stems[COLOR], DEPTH_INFO: stems[DEPTH]}
    names = {topic: f"{stem}/image/data" for topic, stem in stems.items()}
    names |= {topic: f"{stem}/info/camera_info" for topic, stem in infos.items()}
    found = [
        (names.get(topic, topic), time, message)
        for topic, time, message in camera_messages(film, messages)
        if topic != "/tf_static"
    ]
    if unit:
        text = messages.make("std_msgs/msg/String", data=unit)
        found.append(("/device_0/sensor_0/option/Depth_Units/value", found[-1][1], text))
    return write_ros2(path / "film", found, messages)


@pytest.mark.parametrize("unit", ["0.0001", None, "mm"])
def test_depth_units_of_a_realsense_in_ros2(unit, tmp_path, capsys):
    film = stand_in()
    bag, target = realsense_of_ros2(tmp_path, film, unit), tmp_path / "raw/block/camera/08"
    status = bring(bag, target, "--registered")
    if unit != "0.0001":
        assert status == 1
        expected = "between a micrometre" if unit else "the recording or --depth-unit <metres>"
        line = capsys.readouterr().err
        assert f"Depth_0/image/data: depth units: expected {expected}" in line
        assert bring(bag, target, "--registered", "--depth-unit", "0.0001") == 0
    depth = read_image(target / "depth/000000.png", "millimetre")
    assert np.array_equal(depth, np.rint(film.depth[0] / 10))


@pytest.mark.parametrize("marked", [False, True])
def test_depth_units_of_a_realsense_without_the_option(marked, tmp_path, capsys):
    film = stand_in()
    bag = write_realsense(tmp_path / "film.bag", film, unit_m=0.0005, marked=marked, option=None)
    target = tmp_path / "raw/block/camera/08"
    options = ["--force", str(wrench_file(tmp_path, film))]
    status = bring(bag, target, *options)
    if not marked:
        assert status == 1
        assert "depth units: expected the recording or --depth-unit" in capsys.readouterr().err
        assert bring(bag, target, *options, "--depth-unit", "0.0005") == 0
    depth = read_image(target / "depth/000000.png", "millimetre")
    assert np.array_equal(depth, np.rint(film.depth[0] / 2))


@pytest.mark.parametrize("clock", ["Hardware Clock", "Global Time"])
def test_force_of_another_clock(clock, tmp_path, capsys):
    film = stand_in()
    bag = write_realsense(tmp_path / "film.bag", film, clock=clock)
    late = replace(film, wrench_ns=film.wrench_ns + 5 * 10**8)
    options = ["--force", str(wrench_file(tmp_path, late)), "--force-offset", "-0.5"]
    assert bring(bag, tmp_path / "raw/block/camera/08", *options) == 0
    assert_same(tmp_path / "raw/block/camera/08", film)
    told = "another clock than the computer's (Hardware Clock): force of the computer's clock needs"
    assert (told in capsys.readouterr().out) == (clock == "Hardware Clock")


@pytest.mark.parametrize("kind", [ros1, tum], ids=lambda kind: kind.__name__)
def test_images_that_repeat_the_one_before_are_left_out(kind, tmp_path, capsys):
    film = stand_in(frames=9)
    color, depth = list(film.color), list(film.depth)
    color[3] = color[4] = color[2]
    depth[6] = depth[5]
    target = tmp_path / "raw/block/camera/08"
    options = options_for(kind, tmp_path, film)
    assert bring(kind(tmp_path, replace(film, color=color, depth=depth)), target, *options) == 0
    told = "frames: 3 of 9 repeat an image of the frame before, left out, the first (color) at"
    assert f"{told} {film.color_ns[3] / NANOSECONDS:.3f} s" in capsys.readouterr().out
    kept = [0, 1, 2, 5, 7, 8]
    images = {name: [getattr(film, name)[k] for k in kept] for name in ("color", "depth")}
    assert_same(target, replace(film, **images, color_ns=film.color_ns[kept]))
    assert len(list(target.rglob("*.png"))) == 2 * len(kept)


def test_depth_too_far_for_the_file_is_told(tmp_path, capsys):
    film, messages = stand_in(), Messages(ros1=True)
    depth = [image.astype(np.float32) / 1000 for image in film.depth]
    depth[0][:2, :3] = 70.0
    depth[1][0, :3] = np.inf, -np.inf, -1.0
    film = replace(film, depth=depth)
    bag = write_ros1(tmp_path / "film.bag", camera_messages(film, messages), messages)
    assert bring(bag, tmp_path / "raw/block/camera/08") == 0
    assert "depth: 6 pixels beyond 65.535 m, left out (0)" in capsys.readouterr().out
    image = read_image(tmp_path / "raw/block/camera/08/depth/000001.png", "millimetre")
    assert not image[0, :3].any() and image[1:].all()


def test_the_same_bytes_twice(tmp_path):
    bag = mcap_file(tmp_path, stand_in())
    for name in ("08", "09"):
        bring(bag, tmp_path / f"raw/block/camera/{name}")
    folders = [tmp_path / "raw/block/camera" / name for name in ("08", "09")]
    files = [sorted(path for path in folder.rglob("*") if path.is_file()) for folder in folders]
    assert len(files[0]) == 14
    for one, other in zip(*files, strict=True):
        assert one.read_bytes() == other.read_bytes()


# Not getrusage: its peak begins with that of the process that started this one.
MEASURED = """
import sys
from pathlib import Path
from palpate.capture.__main__ import main
assert main(sys.argv[1:]) == 0
lines = Path("/proc/self/status").read_text().splitlines()
print(next(line.split()[1] for line in lines if line.startswith("VmHWM")))
"""


def peak_kb(recording, target, root):
    """Largest memory of an import, in a process of its own."""
    command = [sys.executable, "-c", MEASURED, "import", str(recording), str(target)]
    command += ["--sensors", str(target.parents[3] / "sensors")]
    environment = {"PYTHONPATH": str(root / "workflow/scripts"), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return int(done.stdout.split()[-1])


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="needs Linux's /proc")
def test_memory_does_not_grow_with_the_film(root, tmp_path):
    peaks = {}
    for frames in (5, 120):
        folder = tmp_path / str(frames)
        folder.mkdir()
        bag = ros1(folder, stand_in(frames, (360, 480), plain=True))
        peaks[frames] = peak_kb(bag, folder / "raw/block/camera/08", root)
    # What the long film holds would be seen: it is nearly as large as all libraries together.
    assert bag.stat().st_size > 100e6
    assert peaks[5] < 250e3
    assert peaks[120] < 1.15 * peaks[5]


def test_wrenches_without_stamps_can_take_the_receipts(tmp_path, capsys):
    film, messages = stand_in(), Messages(ros1=True)
    found = [item for item in camera_messages(film, messages) if item[0] != WRENCH]
    for values, stamp in zip(film.wrench, film.wrench_ns, strict=True):
        found.append((WRENCH, stamp, messages.wrench(values)))
    found.sort(key=lambda item: item[1])
    bag = write_ros1(tmp_path / "film.bag", found, messages)
    target = tmp_path / "raw/block/camera/08"
    assert bring(bag, target) == 1
    assert "--receive-clock" in capsys.readouterr().err
    assert bring(bag, target, "--receive-clock") == 0
    assert_same(target, film)


def test_rectified_images_have_the_optics_of_the_projection(tmp_path):
    film, messages = stand_in(), Messages(ros1=True)
    found = []
    for topic, received_ns, message in camera_messages(film, messages):
        if topic == COLOR_INFO:
            message.P = message.P * 1.1
        renamed = "/camera/color/image_rect_color" if topic == COLOR else topic
        found.append((renamed, received_ns, message))
    bag = write_ros1(tmp_path / "film.bag", found, messages)
    assert bring(bag, tmp_path / "raw/block/camera/08") == 0
    color = yaml.safe_load((tmp_path / "sensors/camera.yaml").read_text())["color"]
    assert color["distortion"] == [0, 0, 0, 0, 0]
    assert color["fx_px"] == pytest.approx(1.1 * film.color_optics[0])
