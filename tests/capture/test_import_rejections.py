"""What makes no capture is rejected in one line, and nothing is left behind."""

import re
import sqlite3
from contextlib import closing
from dataclasses import replace
from functools import partial

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
    bring,
    read_spec,
    rejected,
    with_message,
    without,
    wrench_file,
)
from palpate.__main__ import main
from palpate.capture.importing.pixels import RAW_FORMS
from palpate.capture.tables import read_force


def halved(message, _):
    message.data = message.data[: len(message.data) // 2]
    return message


def unturned(message, messages):
    message.transforms[0].transform = messages.transform(((0, 0, 0, 0), (0, 0, 0)))
    return message


def packed(kind):
    """A change to depth images of a codec that loses it or that nothing here unpacks."""
    return with_message(DEPTH, lambda _, messages: messages.compressed(bytes(40), 0, "", kind))


CHANGES = {
    "no wrench": (without(WRENCH), "wrench: expected one topic of WrenchStamped, found none"),
    "no depth": (without(DEPTH), "depth: expected one topic of .* found none"),
    "no colour": (without(COLOR), "color: expected one topic of .* found none"),
    "no optics": (without(COLOR_INFO), "camera.yaml: file: expected a sensor file, or optics"),
    "no transform": (
        without("/tf_static"),
        "film.bag: tf_static: frames: expected a path from frame depth_optical to color_optical",
    ),
    "no rotation": (
        with_message("/tf_static", unturned),
        "tf_static: transform: expected a unit quaternion and metres, found length 0",
    ),
    "size of the optics": (
        with_message(COLOR_INFO, attributes(width=65)),
        "/camera/color/camera_info: camera_info: expected 64 x 48 pixels .* found 65 x 48",
    ),
    "no focal length": (
        with_message(DEPTH_INFO, attributes(K=np.zeros(9))),
        "depth/camera_info: camera_info: K: expected focal lengths above 0, found 0.0",
    ),
    "fisheye": (
        with_message(COLOR_INFO, attributes(distortion_model="equidistant")),
        "distortion_model: expected one of .* found equidistant with 5",
    ),
    "encoding": (
        with_message(COLOR, attributes(encoding="yuv422")),
        "color: expected one topic of .* found none but /camera/color/image_raw of yuv422",
    ),
    "half an image": (
        with_message(DEPTH, halved),
        "depth/image_raw: data: expected 48 rows of at least 128 bytes, found 3072 bytes in rows",
    ),
    "RVL": (packed("16UC1; compressedDepth rvl"), "RVL: republish it as an Image"),
    "inverse depth": (packed("32FC1; compressedDepth png"), "rounded inverse depth: republish"),
    "depth in JPEG": (packed("16UC1; jpeg compressed"), "JPEG keeps 8 of depth's 16 bits"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_bag_without_something(case, film, tmp_path, capsys):
    change, line = CHANGES[case]
    assert_like(line, rejected(capsys, tmp_path, bag_of(tmp_path, film, change)))


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            lambda film: replace(film, depth=[*film.depth[:-1], np.zeros((48, 80), np.uint16)]),
            "image: expected 64 x 48 16UC1 as the first, found 80 x 48 16UC1",
        ),
        (
            lambda film: replace(film, depth=[depth.astype(np.float32) for depth in film.depth]),
            r"depth: expected a median of up to 6.55 m, found .* --depth-unit 0.001",
        ),
        (
            lambda film: replace(film, depth=[film.depth[0]] * len(film.depth)),
            "frames: expected at least 3 that differ from the one before, found 1 of 6",
        ),
        (
            lambda film: replace(film, wrench_ns=film.wrench_ns + 10**12),
            "force: time_s: expected samples during the frames' 1700000000.000 to",
        ),
    ],
    ids=["another size", "millimetres as floats", "repeated images", "force of another time"],
)
def test_images_and_forces_that_make_no_capture(change, line, film, tmp_path, capsys):
    assert_like(line, rejected(capsys, tmp_path, bag_of(tmp_path, change(film))))


LENS = ["--distortion", "0.1", "0", "0", "0", "0"]
FOLDER = "expected a folder with rgb.txt and depth.txt, found .*film.bag$"


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--color", "/foo"], "--color /foo: .* no such topic"),
        (
            ["--depth", WRENCH],
            "--depth /ft_sensor/wrench: expected a topic of .* found geometry_msgs/msg/Wrench",
        ),
        (["--force", "none.csv"], "none.csv: file: expected a CSV table"),
        *(
            (["--depth-unit", unit], "--depth-unit: expected between a micrometre and a metre,")
            for unit in ("0", "nan", "2")
        ),
        *(
            (["--pairing-ms", w], f"^--pairing-ms: expected milliseconds above 0, found {w}$")
            for w in ("0", "-1", "nan", "inf")
        ),
        (
            ["--pairing-ms", "1"],
            "^frames: expected at least 3 pairs of images within 1 ms, found 0; of 6 the nearest"
            r" is 3.4 ms away \(--pairing-ms\)$",
        ),
        (["--intrinsics", "60", "60", "32", "24"], f"^--intrinsics: {FOLDER}"),
        (LENS, f"^--distortion: {FOLDER}"),
    ],
)
def test_options_that_do_not_fit_a_bag(options, line, film, tmp_path, capsys):
    assert_like(line, rejected(capsys, tmp_path, bag_of(tmp_path, film), *options))


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
        (
            ["--depth-unit", "0"],
            "--depth-unit: expected between a micrometre and a metre, found 0 m",
        ),
    ],
)
def test_options_that_do_not_fit_a_folder(options, line, film, tmp_path, capsys):
    folder = write_tum(tmp_path / "film", film)
    assert rejected(capsys, tmp_path, folder, *options) == line


def test_two_topics_that_could_be_meant(film, tmp_path, capsys):
    messages, aligned = Messages(ros1=True), "/camera/aligned/image_raw"
    found = camera_messages(film, messages)
    found += [(aligned, time, message) for name, time, message in found if name == DEPTH]
    bag = write_ros1(tmp_path / "film.bag", found, messages)
    line = rejected(capsys, tmp_path, bag)
    assert_like(f"named by --depth, found {aligned}, /camera/depth/image_raw", line)
    assert bring(bag, tmp_path / "raw/block/camera/08", "--depth", DEPTH) == 0


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
    assert_like(line, rejected(capsys, tmp_path, bag_of(tmp_path, film), target=target))


@pytest.mark.parametrize("target", ["08", "camera/08"])
def test_a_target_of_too_few_folders(target, film, tmp_path, capsys, monkeypatch):
    bag = bag_of(tmp_path, film)
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(bag), target]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    expected = "expected raw/<object>/<sensor>/<capture>, like raw/red_sponge/d435/08"
    assert line == f"error: {target}: target: {expected}, found {target}"


def test_a_row_of_units_in_a_table_of_forces(film, tmp_path, capsys):
    path = wrench_file(tmp_path, film)
    head, rows = path.read_text().split("\n", 1)
    path.write_text(f"{head}\ns,N,N,N,Nm,Nm,Nm\n{rows}")
    line = rejected(capsys, tmp_path, bag_of(tmp_path, film), "--force", str(path))
    assert_like("wrench.csv: rows: expected numbers, found s, N, N", line)


@pytest.fixture
def forces(film, tmp_path):
    """A bag for its forces alone that lost the messages for which something holds."""

    def without_some(lost):
        (tmp_path / "force").mkdir()
        bag = bag_of(tmp_path / "force", film, ros1=False)
        with closing(sqlite3.connect(next(bag.glob("*.db3")))) as content, content:
            content.execute(f"delete from messages where {lost}")
        return str(bag)

    return without_some


def test_a_bag_of_forces_that_states_wrenches_and_holds_none(forces, film, tmp_path, capsys):
    bag = forces("true")
    line = rejected(capsys, tmp_path, bag_of(tmp_path, film), "--force", bag)
    expected = f"expected {len(film.wrench)}, as the bag states .*--force .*, found 0$"
    assert_like(f"^{bag}: {WRENCH}: wrenches: {expected}", line)


def test_a_bag_of_forces_that_lost_a_few_counts_as_far_as_it_goes(forces, film, tmp_path):
    target, bag = tmp_path / "raw/block/camera/08", forces("id % 50 = 0")
    assert bring(bag_of(tmp_path, film), target, "--force", bag) == 0
    assert 0.9 * len(film.wrench) < len(read_force(target)) < len(film.wrench)


def test_an_object_that_the_lab_makes(film, tmp_path, capsys):
    (tmp_path / "raw/block").mkdir(parents=True)
    described = tmp_path / "raw/block/object.yaml"
    described.write_text("object: block\nprovenance: simulated\n")
    bag = bag_of(tmp_path, film)
    line = rejected(capsys, tmp_path, bag)
    assert_like("block/object.yaml: provenance: expected recorded, found simulated", line)
    described.write_text("object: block\nprovenance: recorded\n")
    assert bring(bag, tmp_path / "raw/block/camera/08") == 0


def test_what_stands_there_is_kept(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    target = tmp_path / "raw/block/camera/08"
    target.mkdir(parents=True)
    (target / "note.txt").write_text("mine")
    assert_like("08: folder: expected nothing there yet", rejected(capsys, tmp_path, bag))
    assert (target / "note.txt").read_text() == "mine"


def test_a_sensor_file_that_contradicts(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    assert bring(bag, tmp_path / "raw/block/camera/08") == 0
    spec, target = read_spec(tmp_path), "raw/block/camera/09"
    moved = {"color_from_depth": np.eye(4).tolist()}
    for block, change, line in (
        ("color", {"fx_px": 62.0}, "camera.yaml: color.fx_px: expected 60.5 px, found 62.0 px"),
        ("color", {"width_px": 640}, "color.width_px: expected 64, as the recording has it"),
        ("color", {"encoding": "mono8"}, "camera.yaml: color.encoding: expected rgb8"),
        ("depth", moved, "depth.color_from_depth: expected"),
    ):
        changed = yaml.safe_dump(spec | {block: spec[block] | change})
        (tmp_path / "sensors/camera.yaml").write_text(changed)
        assert_like(line, rejected(capsys, tmp_path, bag, target=target))
    # The person's own optics will do where the recording's can't be read.
    (tmp_path / "bare").mkdir()
    bag = bag_of(tmp_path / "bare", film, without("/tf_static", DEPTH_INFO))
    assert bring(bag, tmp_path / target, "--trust-sensor-file") == 0
    assert read_spec(tmp_path)["depth"] == spec["depth"] | moved


@pytest.mark.parametrize(
    ("write", "name", "line"),
    [
        (write_realsense, "film.bag", "film.bag: wrench: expected one topic"),
        (
            partial(write_tum, wrench=False),
            "film",
            "force.csv: file: expected force.csv .--force <file> will do., found nothing",
        ),
        (write_tum, "film", "camera.yaml: file: expected a sensor file, or optics"),
    ],
    ids=["a RealSense", "no wrenches", "no optics"],
)
def test_recordings_without_force_or_optics(write, name, line, film, tmp_path, capsys):
    assert_like(line, rejected(capsys, tmp_path, write(tmp_path / name, film)))


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
    assert_like(line, rejected(capsys, tmp_path, folder))


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
    found = rejected(capsys, tmp_path, folder, "--intrinsics", "60", "60", "32", "24")
    assert found == f"{folder / name}: line {line.format(*stamps)}"


COLORS = "rgb8, bgr8, rgba8, bgra8, mono8, 8UC1 or bayer_rggb8"
DEPTHS = "16UC1, mono16 or 32FC1"
NO_COLOR = (
    f"color: expected one topic of Image of {COLORS}, or CompressedImage of PNG or JPEG, found none"
)


def test_a_bag_without_images_says_what_it_holds(film, tmp_path, capsys):
    def many(topic, time, message, _):
        return (f"/scan{time % 11:02d}", time, message) if topic == WRENCH else None

    late = replace(film, wrench_ns=film.wrench_ns[0] + np.arange(len(film.wrench_ns)))
    bag = bag_of(tmp_path, late, many)
    held = ", ".join(f"/scan{k:02d} of geometry_msgs/msg/WrenchStamped" for k in range(8))
    assert rejected(capsys, tmp_path, bag) == f"{bag}: {NO_COLOR} (it holds {held} and 3 others)"


def test_a_bag_that_holds_nothing(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film, lambda *_: None)
    assert rejected(capsys, tmp_path, bag) == f"{bag}: {NO_COLOR} (it holds no messages)"


def test_all_encodings_that_are_taken_are_named(root, film, tmp_path, capsys):
    line = rejected(capsys, tmp_path, bag_of(tmp_path, film, without(DEPTH)))
    assert_like(f"depth: expected one topic of Image of {DEPTHS}, or CompressedImage of PNG,", line)
    page = (root / "docs/importing.md").read_text()
    for encoding in RAW_FORMS:
        assert len(re.findall(rf"\b{encoding}\b", f"{COLORS} {DEPTHS}")) == 1
        assert f"`{encoding}`" in page


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("film.avi", "recording: expected a .bag, .mcap .* found another file"),
        ("none.mcap", "found nothing"),
        ("", "a folder without them"),
    ],
)
def test_nothing_to_import(name, line, tmp_path, capsys):
    (tmp_path / "film.avi").write_bytes(b"RIFF")
    assert_like(line, rejected(capsys, tmp_path, tmp_path / name))


def test_force_for_what_has_none(tmp_path, capsys):
    force = ["--force", "a.csv"]
    line = rejected(capsys, tmp_path, tmp_path, *force, "--background", target="raw/block/camera")
    assert_like("--force: expected none with --background", line)
    line = rejected(capsys, tmp_path, tmp_path, *force, target="raw/sensors/camera/pivot")
    assert_like("--force: expected none for .*/pivot, found a.csv", line)
