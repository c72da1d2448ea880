"""What makes no capture is refused in one line, and nothing is left behind."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml
from bag_writing import (
    COLOR,
    COLOR_INFO,
    DEPTH,
    DEPTH_INFO,
    WRENCH,
    Messages,
    camera_messages,
    write_realsense,
    write_ros1,
    write_tum,
)
from import_help import (
    assert_like,
    attributes,
    bag_of,
    refused,
    with_message,
    without,
    wrench_file,
)
from palpate.__main__ import main
from palpate.capture.importing.pixels import RAW_FORMS


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
        ("raw/block/My Cam/08", r"08: sensor: expected .*, like d435, found My Cam$"),
        ("raw/sensors/camera/08", r"08: object: expected a name of letters.*, found sensors$"),
        ("raw/sensors/My Cam/load", r"load: sensor: expected .*, like d435, found My Cam$"),
        ("raw/My Cow/camera/08", r"08: object: expected .*, like red_sponge, found My Cow$"),
        ("raw/block/camera/background", "capture: expected --background for this name"),
        ("raw/block/08", r"expected raw/<object>/<sensor>/<capture>, .*, found .*raw/block/08$"),
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
    expected = "expected raw/<object>/<sensor>/<capture>, like raw/red_sponge/d435/08"
    assert line == f"error: {target}: target: {expected}, found {target}"


def test_depth_that_a_message_can_not_keep(film, tmp_path, capsys):
    """Depth in float millimetres, and codecs that lose it or that nothing here unpacks."""
    floats = replace(film, depth=[depth.astype(np.float32) for depth in film.depth])
    line = refused(capsys, tmp_path, bag_of(tmp_path, floats))
    assert_like(r"depth: expected a median of up to 6.55 m, found .* --depth-unit 0.001", line)
    (tmp_path / "film.bag").unlink()
    for said, why in {
        "16UC1; compressedDepth rvl": "RVL: republish it as an Image",
        "32FC1; compressedDepth png": "rounded inverse depth: republish",
        "16UC1; jpeg compressed": "JPEG keeps 8 of depth's 16 bits",
    }.items():
        packed = with_message(DEPTH, lambda _, m, s=said: m.compressed(bytes(40), 0, "", s))
        assert_like(why, refused(capsys, tmp_path, bag := bag_of(tmp_path, film, packed)))
        bag.unlink()


def test_a_row_of_units_in_a_table_of_forces(film, tmp_path, capsys):
    path = wrench_file(tmp_path, film)
    head, rows = path.read_text().split("\n", 1)
    path.write_text(f"{head}\ns,N,N,N,Nm,Nm,Nm\n{rows}")
    line = refused(capsys, tmp_path, bag_of(tmp_path, film), "--force", str(path))
    assert_like("wrench.csv: rows: expected numbers, found s, N, N", line)


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


@pytest.mark.parametrize("name", ["rgb.txt", "depth.txt"])
@pytest.mark.parametrize(
    ("order", "line"),
    [
        ([1, 0, 2, 3, 4, 5], "3: expected increasing stamps, found {1} then {0} (sort the list)"),
        ([5, 4, 3, 2, 1, 0], "3: expected increasing stamps, found {5} then {4} (sort the list)"),
        ([0, 1, 1, 2], "4: expected increasing stamps, found {1} then {1} (leave one of them out)"),
    ],
)
def test_lists_whose_stamps_do_not_increase(name, order, line, film, tmp_path, capsys):
    folder = write_tum(tmp_path / "film", film)
    head, *rows = (folder / name).read_text().splitlines()
    (folder / name).write_text("\n".join([head, *(rows[k] for k in order)]))
    stamps = [row.split()[0] for row in rows]
    found = refused(capsys, tmp_path, folder, "--intrinsics", "60", "60", "32", "24")
    assert found == f"{folder / name}: line {line.format(*stamps)}"


def bag_with(path, film, messages, topics):
    """A bag of the wrench and one scan in each of some topics."""
    header = messages.header(film.color_ns[0], "laser")
    numbers = ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time")
    fields = dict.fromkeys((*numbers, "range_min", "range_max"), 0.0)
    empty = {"ranges": np.zeros(0, np.float32), "intensities": np.zeros(0, np.float32)}
    scan = messages.make("sensor_msgs/msg/LaserScan", header=header, **fields, **empty)
    found = [item for item in camera_messages(film, messages) if item[0] == WRENCH]
    found += [(topic, found[-1][1], scan) for topic in topics]
    return write_ros1(path / "press.bag", found, messages)


NO_COLOR = (
    "color: expected one topic of Image of rgb8, bgr8, rgba8, bgra8, mono8, 8UC1 or bayer_rggb8,"
    " or CompressedImage of PNG or JPEG, found none"
)
NO_DEPTH = (
    "depth: expected one topic of Image of 16UC1, mono16 or 32FC1, or CompressedImage of PNG,"
    " found none"
)
SCAN = "of sensor_msgs/msg/LaserScan"


@pytest.mark.parametrize(("count", "rest"), [(1, ""), (8, " and 1 other"), (9, " and 2 others")])
def test_a_bag_without_images_says_what_it_holds(count, rest, film, tmp_path, capsys):
    bag = bag_with(tmp_path, film, Messages(ros1=True), [f"/scan{k}" for k in range(count)])
    line = refused(capsys, tmp_path, bag)
    held = [f"{WRENCH} of geometry_msgs/msg/WrenchStamped"]
    held += [f"/scan{k} {SCAN}" for k in range(min(count, 7))]
    assert line == f"{bag}: {NO_COLOR} (it holds {', '.join(held)}{rest})"


def test_a_bag_that_holds_nothing(film, tmp_path, capsys):
    bag = write_ros1(tmp_path / "film.bag", [], Messages(ros1=True))
    assert refused(capsys, tmp_path, bag) == f"{bag}: {NO_COLOR} (it holds no messages)"


def test_the_lines_name_what_is_taken(root, film, tmp_path, capsys):
    line = refused(capsys, tmp_path, bag_of(tmp_path, film, without(DEPTH)))
    assert_like(
        f"{NO_DEPTH} .it holds {COLOR_INFO} of sensor_msgs/msg/CameraInfo, {COLOR} of", line
    )
    page = (root / "docs/importing.md").read_text()
    for encoding in RAW_FORMS:
        assert len(re.findall(rf"\b{encoding}\b", NO_COLOR + NO_DEPTH)) == 1
        assert f"`{encoding}`" in page


@pytest.mark.parametrize("window", ["0", "-1", "nan", "inf"])
def test_windows_that_are_none(window, film, tmp_path, capsys):
    line = refused(capsys, tmp_path, bag_of(tmp_path, film), "--pairing-ms", window)
    assert line == f"--pairing-ms: expected milliseconds above 0, found {window}"


def test_too_few_pairs_name_the_window(film, tmp_path, capsys):
    line = refused(capsys, tmp_path, bag_of(tmp_path, film), "--pairing-ms", "1")
    expected = "frames: expected at least 3 pairs of images within 1 ms, found 0"
    assert line == f"{expected}; of 6 the nearest is 3.4 ms away (--pairing-ms)"


LENS = ["--distortion", "0.1", "0", "0", "0", "0"]


@pytest.mark.parametrize(
    "option", [["--intrinsics", "60", "60", "32", "24"], LENS, ["--depth-factor", "1000"]]
)
def test_options_of_folders_with_a_bag(option, film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    line = refused(capsys, tmp_path, bag, *option)
    assert line == f"{option[0]}: expected a folder with rgb.txt and depth.txt, found {bag}"


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (LENS, "--distortion: expected --intrinsics beside it, found none"),
        (
            ["--intrinsics", "60", "60", "32", "24", "--distortion", "0.1", "nan", "0", "0", "inf"],
            "--distortion: expected finite numbers, found 0.1 nan 0 0 inf",
        ),
        (
            ["--intrinsics", "60", "60", "32", "nan"],
            "--intrinsics: expected finite numbers, found 60 60 32 nan",
        ),
    ],
)
def test_optics_of_a_folder_that_are_none(options, line, film, tmp_path, capsys):
    folder = write_tum(tmp_path / "film", film)
    assert refused(capsys, tmp_path, folder, *options) == line


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
    line = refused(capsys, tmp_path, tmp_path, *options[1:], target="raw/sensors/camera/pivot")
    assert_like("--force: expected none for .*/pivot, found a.csv", line)
