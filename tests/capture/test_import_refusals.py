"""What makes no capture is refused in one line, and nothing is left behind."""

import bz2
import re
import struct
from dataclasses import replace

import cv2
import lz4.frame
import numpy as np
import pytest
import yaml
from backports import zstd
from bag_writing import (
    COLOR,
    COLOR_INFO,
    DEPTH,
    DEPTH_INFO,
    WRENCH,
    Messages,
    camera_messages,
    stand_in,
    write_realsense,
    write_ros1,
    write_ros2,
    write_tum,
)
from palpate.capture.__main__ import main
from palpate.capture.importing import bag_bounds, bags
from palpate.capture.importing.lens import five_coefficients
from palpate.capture.importing.optics import chained, matrix
from palpate.capture.importing.pairing import paired
from palpate.capture.importing.pixels import Form, file_form, form_of, millimetres
from palpate.capture.tables import read_frames
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

FORM = Form(1280, 720, "rgb8")
K = np.array([640.0, 0, 645, 0, 640, 361, 0, 0, 1])


@pytest.fixture
def film():
    return stand_in()


def bag_of(path, film, change=None, *, ros1=True, **options):
    """A bag with each (topic, time, message) changed, or left out where nothing comes back."""
    messages = Messages(ros1=ros1)
    found = camera_messages(film, messages)
    if change:
        changed = (change(*item, messages) for item in found)
        found = [item for item in changed if item is not None]
    write = write_ros1 if ros1 else write_ros2
    return write(path / ("film.bag" if ros1 else "film"), found, messages, **options)


def without(*topics):
    return lambda topic, time, message, _: None if topic in topics else (topic, time, message)


def with_message(wanted, work):
    def change(topic, time, message, messages):
        return (topic, time, work(message, messages) if topic == wanted else message)

    return change


def attributes(**values):
    def work(message, _):
        for name, value in values.items():
            setattr(message, name, value)
        return message

    return work


def refused(capsys, tmp_path, recording, *options, target="raw/block/camera/08"):
    """The one line of a refused import, after which nothing stands where nothing stood."""
    before = sorted(tmp_path.rglob("*"))
    arguments = ["import", str(recording), str(tmp_path / target), *options]
    capsys.readouterr()
    assert main([*arguments, "--sensors", str(tmp_path / "sensors")]) == 1
    said = capsys.readouterr()
    assert not said.out
    lines = said.err.strip().splitlines()
    assert len(lines) == 1
    assert sorted(tmp_path.rglob("*")) == before
    return lines[0]


def turned_round(message, _):
    message.data = message.data[: len(message.data) // 2]
    return message


CHANGES = {
    "no wrench": (without(WRENCH), [], "wrench: expected one topic of WrenchStamped, found none"),
    "no depth": (without(DEPTH), [], "depth: expected one topic of .* found none"),
    "no colour": (without(COLOR), [], "color: expected one topic of .* found none"),
    "no optics": (without(COLOR_INFO), [], "camera.yaml: file: expected a sensor file, or optics"),
    "no transform": (
        without("/tf_static"),
        [],
        "tf_static: expected a way from frame depth_optical",
    ),
    "size of the optics": (
        with_message(COLOR_INFO, attributes(width=65)),
        [],
        "/camera/color/camera_info: camera_info: expected 64 x 48 pixels .* found 65 x 48",
    ),
    "no focal length": (
        with_message(DEPTH_INFO, attributes(K=np.zeros(9))),
        [],
        "depth/camera_info: camera_info: K: expected focal lengths above 0, found 0.0",
    ),
    "fisheye": (
        with_message(COLOR_INFO, attributes(distortion_model="equidistant")),
        [],
        "distortion_model: expected one of .* found equidistant with 5",
    ),
    "encoding": (
        with_message(COLOR, attributes(encoding="yuv422")),
        [],
        "color: expected one topic of .* found none but /camera/color/image_raw of yuv422",
    ),
    "half an image": (
        with_message(DEPTH, turned_round),
        [],
        "depth/image_raw: data: expected 48 rows of at least 128 bytes, found 3072 bytes in rows",
    ),
    "a named topic that is none": (None, ["--color", "/foo"], "--color /foo: .* no such topic"),
    "a named topic of another type": (
        None,
        ["--depth", WRENCH],
        "--depth /ft_sensor/wrench: expected a topic of .* found geometry_msgs/msg/WrenchStamped",
    ),
    "a wrong range": (None, ["--range", "0", "3"], "range_m.0: expected a number > 0, found 0"),
    "no force file": (None, ["--force", "none.csv"], "none.csv: file: expected a CSV table"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_bag_that_lacks_something(case, film, tmp_path, capsys):
    change, options, line = CHANGES[case]
    bag = bag_of(tmp_path, film, change)
    found = refused(capsys, tmp_path, bag, *options)
    assert_like(line, found)


def assert_like(pattern, line):
    assert re.search(pattern, line), line


def test_one_image_of_another_size(film, tmp_path, capsys):
    other = np.zeros((48, 80), np.uint16)
    odd = replace(film, depth=[*film.depth[:-1], other])
    line = refused(capsys, tmp_path, bag_of(tmp_path, odd))
    assert_like("image: expected 64 x 48 16UC1 as the first, found 80 x 48 16UC1", line)


def test_two_topics_that_could_be_meant(film, tmp_path, capsys):
    def doubled(messages):
        found = camera_messages(film, messages)
        aligned = [
            ("/camera/aligned/image_raw", time, one) for name, time, one in found if name == DEPTH
        ]
        return sorted(found + aligned, key=lambda item: item[1])

    messages = Messages(ros1=True)
    bag = write_ros1(tmp_path / "film.bag", doubled(messages), messages)
    line = refused(capsys, tmp_path, bag)
    expected = "named by --depth, found /camera/aligned/image_raw, /camera/depth/image_raw"
    assert_like(expected, line)
    target = tmp_path / "raw/block/camera/08"
    arguments = ["import", str(bag), str(target), "--sensors", str(tmp_path / "sensors")]
    assert main([*arguments, "--depth", DEPTH]) == 0


@pytest.mark.parametrize(
    ("target", "line"),
    [
        (
            "raw/block/camera/08-b",
            r"camera/08-b: capture: expected a name like 08 or 08-a03 .*, found 08-b$",
        ),
        ("raw/block/scans/08", r"scans/08: sensor: expected a name of small .*, found scans$"),
        ("raw/block/My Cam/08", r"08: sensor: expected .*, like bench_cam, found My Cam$"),
        ("raw/sensors/camera/08", r"08: object: expected a name of letters.*, found sensors$"),
        ("raw/My Cow/camera/08", r"08: object: expected .*, like toy_cow, found My Cow$"),
        ("raw/block/camera/background", "capture: expected --background for this name"),
    ],
)
def test_places_that_are_no_captures(target, line, film, tmp_path, capsys):
    assert_like(line, refused(capsys, tmp_path, bag_of(tmp_path, film), target=target))


@pytest.mark.parametrize("target", ["08", "camera/08"])
def test_a_target_of_too_few_folders(target, film, tmp_path, capsys, monkeypatch):
    bag = bag_of(tmp_path, film)
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(bag), target]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    expected = "expected raw/<object>/<sensor>/<capture>, like raw/toy_cow/bench_cam/08"
    assert line == f"{target}: target: {expected}, found {target}"


def test_an_object_that_the_lab_makes(film, tmp_path, capsys):
    (tmp_path / "raw/block").mkdir(parents=True)
    described = tmp_path / "raw/block/object.yaml"
    described.write_text("object: block\nprovenance: simulated\n")
    bag = bag_of(tmp_path, film)
    line = refused(capsys, tmp_path, bag)
    assert_like("block/object.yaml: provenance: expected recorded, found simulated", line)
    described.write_text("object: block\nprovenance: recorded\n")
    arguments = ["import", str(bag), str(tmp_path / "raw/block/camera/08")]
    assert main([*arguments, "--sensors", str(tmp_path / "sensors")]) == 0


def test_a_film_that_stands_still(film, tmp_path, capsys):
    still = replace(film, depth=[film.depth[0]] * len(film.depth))
    line = refused(capsys, tmp_path, bag_of(tmp_path, still))
    assert_like("frames: expected at least 3 that differ from the one before, found 1 of 6", line)


@pytest.mark.parametrize("unit", ["0", "nan", "2"])
def test_depth_units_that_are_none(unit, film, tmp_path, capsys):
    line = refused(capsys, tmp_path, bag_of(tmp_path, film), "--depth-unit", unit)
    assert_like("--depth-unit: expected between a micrometre and a metre, found", line)
    folder = write_tum(tmp_path / "folder", film)
    line = refused(capsys, tmp_path, folder, "--depth-unit", "0.001")
    assert_like("--depth-unit: expected --depth-factor for rgb.txt, found 0.001", line)


def test_what_stands_there_is_kept(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    target = tmp_path / "raw/block/camera/08"
    target.mkdir(parents=True)
    (target / "note.txt").write_text("mine")
    assert_like("08: folder: expected nothing there yet", refused(capsys, tmp_path, bag))
    assert (target / "note.txt").read_text() == "mine"


def test_a_sensor_file_that_contradicts(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    sensors = tmp_path / "sensors"
    arguments = ["import", str(bag), str(tmp_path / "raw/block/camera/08"), "--sensors"]
    assert main([*arguments, str(sensors)]) == 0
    path = sensors / "camera.yaml"
    spec = yaml.safe_load(path.read_text())
    again = {"target": "raw/block/camera/09"}
    for change, line in (
        ({"fx_px": 62.0}, "camera.yaml: color.fx_px: expected 60.5 px, found 62.0 px"),
        ({"width_px": 640}, "camera.yaml: color.width_px: expected 64, as the recording has it"),
        ({"encoding": "mono8"}, "camera.yaml: color.encoding: expected rgb8"),
    ):
        path.write_text(yaml.safe_dump(spec | {"color": spec["color"] | change}))
        assert_like(line, refused(capsys, tmp_path, bag, **again))
    changed = spec["depth"] | {"color_from_depth": np.eye(4).tolist()}
    path.write_text(yaml.safe_dump(spec | {"depth": changed}))
    assert_like("depth.color_from_depth: expected", refused(capsys, tmp_path, bag, **again))
    # The person's own optics will do where the recording's can't be read.
    again = without("/tf_static", DEPTH_INFO)
    (tmp_path / "bare").mkdir()
    bag = bag_of(tmp_path / "bare", film, again)
    trusting = ["import", str(bag), str(tmp_path / "raw/block/camera/09"), "--trust-sensor-file"]
    assert main([*trusting, "--sensors", str(sensors)]) == 0
    assert yaml.safe_load(path.read_text())["depth"] == changed


def test_force_that_does_not_meet_the_frames(film, tmp_path, capsys):
    late = replace(film, wrench_ns=film.wrench_ns + 10**12)
    line = refused(capsys, tmp_path, bag_of(tmp_path, late))
    assert_like("force: time_s: expected samples during the frames' 1700000000.000 to", line)


def test_a_realsense_without_force(film, tmp_path, capsys):
    bag = write_realsense(tmp_path / "film.bag", film)
    assert_like("film.bag: wrench: expected one topic", refused(capsys, tmp_path, bag))


def test_a_folder_without_wrenches_or_optics(film, tmp_path, capsys):
    folder = write_tum(tmp_path / "film", film, wrench=False)
    assert_like("wrench.txt: file: expected wrenches", refused(capsys, tmp_path, folder))
    write_tum(tmp_path / "other", film)
    line = refused(capsys, tmp_path, tmp_path / "other")
    assert_like("camera.yaml: file: expected a sensor file, or optics", line)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("1.0 ../../secret.png", "rgb.txt: line 2: expected a file of this folder"),
        ("1.0 rgb/none.png", "rgb.txt: line 2: expected an image, found nothing at rgb/none.png"),
        ("soon rgb/a.png", "rgb.txt: line 2: expected a stamp and a file, found soon rgb/a.png"),
        ("nan rgb/a.png", "rgb.txt: line 2: expected a stamp and a file"),
        ("", "rgb.txt: lines: expected images, found none"),
    ],
)
def test_lists_that_say_nonsense(text, line, film, tmp_path, capsys):
    folder = write_tum(tmp_path / "film", film)
    (tmp_path / "secret.png").write_bytes(b"x")
    (folder / "rgb.txt").write_text(f"# stamps\n{text}\n")
    assert_like(line, refused(capsys, tmp_path, folder))


@pytest.mark.parametrize("kind", ["ros1", "db3", "mcap", "metadata"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_recording_that_was_cut(kind, share, film, tmp_path, capsys):
    if kind == "ros1":
        recording = path = bag_of(tmp_path, film)
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        recording = bag_of(tmp_path, film, ros1=False, plugin=plugin)
        path = recording / "metadata.yaml" if kind == "metadata" else next(recording.glob("film*"))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_like("film.*: (content|bag|compression|metadata)", refused(capsys, tmp_path, recording))


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_damaged_bytes_never_make_a_traceback(kind, film, tmp_path, capsys):
    """Each of many bags with wrong bytes is refused in a line or comes back as a whole capture."""
    few = replace(film, wrench=film.wrench[::20], wrench_ns=film.wrench_ns[::20])
    if kind == "ros1":
        recording = path = bag_of(tmp_path, few)
    else:
        folder = bag_of(tmp_path, few, ros1=False, plugin=StoragePlugin.MCAP)
        recording = path = next(folder.glob("*.mcap"))
    whole, random = path.read_bytes(), np.random.default_rng(8)
    refusals = 0
    for k in range(25):
        damaged = bytearray(whole)
        # Heads and the index at the end hold the sizes; the rest is mostly pixels.
        places = [*random.integers(0, 400, 2), len(whole) - 1 - random.integers(0, 5000)]
        for place in places:
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        target = tmp_path / f"raw/block/camera/{k:02d}"
        arguments = ["import", str(recording), str(target), "--sensors", str(tmp_path / "sensors")]
        if main(arguments):
            refusals += 1
            assert len(capsys.readouterr().err.strip().splitlines()) == 1
            assert not target.exists()
        else:
            assert len(read_frames(target)) == len(film.color)
    assert refusals > 3


@pytest.mark.parametrize(
    ("table", "name", "packed"),
    [
        ("_ROS1_WAYS", "bz2", bz2.compress),
        ("_ROS1_WAYS", "lz4", lz4.frame.compress),
        ("_MCAP_WAYS", "lz4", lz4.frame.compress),
        ("_MCAP_WAYS", "zstd", zstd.compress),
    ],
)
def test_chunks_that_unpack_without_end(table, name, packed, monkeypatch):
    monkeypatch.setattr(bag_bounds, "LARGEST_BYTES", 1000)
    unpacked = getattr(bag_bounds, table)[name]
    assert unpacked(packed(bytes(1000))) == bytes(1000)
    with pytest.raises(ValueError, match="a chunk that is cut or unpacks to more than 1000"):
        unpacked(packed(bytes(10**6)))
    with pytest.raises(ValueError, match="a chunk that is cut"):
        unpacked(packed(bytes(1000))[:-3])


def test_chunk_larger_than_the_file(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    data = bag.read_bytes()
    # The first chunk's size stands behind its header.
    start = data.index(b"compression=none") - 4
    place = _after_chunk_header(data, start)
    bag.write_bytes(data[:place] + struct.pack("<I", 2**32 - 1) + data[place + 4 :])
    assert_like("film.bag: content: expected a whole bag", refused(capsys, tmp_path, bag))


def _after_chunk_header(data, near):
    """Place of a chunk's data length: behind the header in which a field stands."""
    for start in range(near, 0, -1):
        length = struct.unpack("<I", data[start : start + 4])[0]
        if 30 < length < 100 and start + 4 <= near < start + 4 + length:
            return start + 4 + length
    raise LookupError("no chunk header")


def test_chunks_open_at_once_are_bounded(film, tmp_path, capsys, monkeypatch):
    recording = bag_of(tmp_path, film, ros1=False, plugin=StoragePlugin.MCAP)
    monkeypatch.setattr(bag_bounds, "LARGEST_BYTES", 10_000)
    line = refused(capsys, tmp_path, recording)
    assert_like("chunks: expected at most 10000 bytes of messages at one time", line)


def test_large_messages_are_refused(film, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(bags, "LARGEST_BYTES", 5000)
    line = refused(capsys, tmp_path, bag_of(tmp_path, film))
    assert_like("film.bag: message: expected at most 5000 bytes, found 9", line)


def test_folders_packed_as_a_whole_are_refused(film, tmp_path, capsys):
    packed = (CompressionMode.FILE, CompressionFormat.ZSTD)
    recording = bag_of(tmp_path, film, ros1=False, compression=packed)
    line = refused(capsys, tmp_path, recording)
    assert_like("metadata.yaml: compression_mode: expected none .* found file", line)


def test_messages_that_the_bag_promised(film, tmp_path, capsys):
    recording = bag_of(tmp_path, film, ros1=False)
    metadata = recording / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("message_count: 6\n", "message_count: 7\n"))
    line = refused(capsys, tmp_path, recording)
    assert_like("film: messages: expected 381, as the bag states, found 379", line)


def test_a_known_name_for_another_type(film, tmp_path, capsys):
    """A type that only goes by the name of one of ROS would be misread."""
    bag = bag_of(tmp_path, film)
    data = bag.read_bytes()
    digest = Messages(ros1=True).store.generate_msgdef("geometry_msgs/msg/WrenchStamped")[1]
    bag.write_bytes(data.replace(digest.encode(), b"0" * 32))
    line = refused(capsys, tmp_path, bag)
    assert_like(f"wrench: type: expected geometry_msgs/msg/WrenchStamped {digest}, found 000", line)


def test_names_that_steer_a_terminal(film, tmp_path, capsys):
    def change(topic, time, message, _):
        return (
            (topic + "\x1b[31m\nred", time, message) if topic == COLOR else (topic, time, message)
        )

    line = refused(capsys, tmp_path, bag_of(tmp_path, film, change), "--color", "/x")
    assert "\x1b" not in line and "?[31m?red" in line


def test_nothing_to_import(tmp_path, capsys):
    (tmp_path / "film.avi").write_bytes(b"RIFF")
    assert_like(
        "recording: expected a .bag, .mcap", refused(capsys, tmp_path, tmp_path / "film.avi")
    )
    assert_like("found nothing", refused(capsys, tmp_path, tmp_path / "none.mcap"))
    assert_like("a folder without them", refused(capsys, tmp_path, tmp_path))
    options = ["--background", "--force", "a.csv"]
    line = refused(capsys, tmp_path, tmp_path, *options, target="raw/block/camera")
    assert_like("--force: expected none with --background", line)


def test_pairs_are_mutual_and_within_half_a_frame():
    color = np.array([0, 100, 200, 300, 400, 500])
    depth = np.array([10, 112, 390, 405, 540, 900])
    pairs = paired(color, depth)
    assert pairs.color.tolist() == [0, 1, 4, 5]
    assert pairs.depth.tolist() == [0, 1, 3, 4]
    assert (pairs.within_ns, pairs.farthest_ns) == (50, 40)


def test_pairs_halfway_and_out_of_order():
    times = np.arange(6) * 100
    pairs = paired(times, times + 50)
    assert pairs.color.tolist() == pairs.depth.tolist() == [0, 1, 2, 3, 4, 5]
    order = np.array([3, 0, 5, 1, 4, 2])
    pairs = paired(times[order], times)
    assert times[order][pairs.color].tolist() == times.tolist()
    assert times[pairs.depth].tolist() == times.tolist()


def test_stamps_that_do_not_move():
    with pytest.raises(ValueError, match="color: stamps: expected times that move, found 0"):
        paired(np.zeros(5, int), np.arange(5))
    with pytest.raises(ValueError, match="depth: expected at least 2 images, found 1"):
        paired(np.arange(5), np.arange(1))


def test_transforms_go_through_the_tree():
    messages = Messages(ros1=False)
    found = messages.transforms(0).transforms
    with pytest.raises(ValueError, match="tf_static: expected a way from frame depth_optical to x"):
        chained(found, "x", "depth_optical")
    there = chained(found, "color_optical", "/depth_optical")
    back = chained(found, "depth_optical", "color_optical")
    np.testing.assert_allclose(there @ back, np.eye(4), atol=1e-12)
    with pytest.raises(ValueError, match="transform: expected a unit quaternion and metres"):
        matrix(messages.transform(((0, 0, 0, 0), (0, 0, 0))))


def test_inverse_lens_of_a_realsense():
    """The SDK takes rays to the image with its five, all but as OpenCV does with the same."""
    stated = np.array([-0.0567, 0.0665, 0.0006, 0.0002, -0.0214])
    found = five_coefficients("Inverse Brown Conrady", stated, K, FORM)
    assert found == stated.tolist()
    x, y = np.random.default_rng(1).uniform(-0.5, 0.5, (2, 50))
    k1, k2, p1, p2, k3 = stated
    r2 = x**2 + y**2
    u, v = (part * (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) for part in (x, y))
    u, v = (
        u + 2 * p1 * u * v + p2 * (r2 + 2 * u**2),
        v + 2 * p2 * u * v + p1 * (r2 + 2 * v**2),
    )
    rays = np.column_stack([x, y, np.ones(50)])
    pixels, _ = cv2.projectPoints(rays, *np.zeros((2, 3)), K.reshape(3, 3), np.array(found))
    expected = np.column_stack([K[0] * u + K[2], K[4] * v + K[5]])
    np.testing.assert_allclose(pixels.reshape(-1, 2), expected, rtol=0, atol=0.05)


def test_lenses_that_five_coefficients_can_not_follow():
    wild = np.array([0.0757, -2.48, 0.0007, -0.0002, 1.454, -0.045, -2.296, 1.379])
    with pytest.raises(ValueError, match="D: expected finite numbers"):
        five_coefficients("plumb_bob", np.array([np.nan] * 5), K, FORM)
    with pytest.raises(ValueError, match="follow within 0.05 px, found rational_polynomial at"):
        five_coefficients("rational_polynomial", wild, K, FORM)
    plain = np.array([0.1, -0.05, 0.001, 0.002, 0.01, 0, 0, 0])
    found = five_coefficients("rational_polynomial", plain, K, FORM)
    np.testing.assert_allclose(found, plain[:5], atol=1e-7)


def test_pictures_that_are_none():
    with pytest.raises(ValueError, match="image: expected PNG or JPEG, found neither"):
        file_form(b"GIF89a" + bytes(100))
    messages = Messages(ros1=False)
    image = messages.image(np.zeros((48, 64), np.uint8), 0, "")
    image.width = 2**31
    with pytest.raises(ValueError, match="image: expected 16 to 16384 pixels, found 2147483648"):
        form_of(image)
    image.encoding = "64FC1"
    with pytest.raises(ValueError, match="encoding: expected one of .* found 64FC1"):
        form_of(image)
    codec = messages.compressed(bytes(20), 0, "", "32FC1; compressedDepth png")
    with pytest.raises(ValueError, match="format: expected 16UC1; compressedDepth png"):
        form_of(codec)


def test_millimetres_round_to_the_nearest():
    metres = np.array([[0.5004, 0.5006, np.nan, 65.535, 65.536, -0.1]], np.float32)
    values, beyond = millimetres(metres, 1.0)
    assert values.tolist() == [[500, 501, 0, 65535, 0, 0]]
    assert beyond == 1
    counts = np.array([[5000, 5004, 0]], np.uint16)
    assert millimetres(counts, 1 / 5000)[0].tolist() == [[1000, 1001, 0]]
