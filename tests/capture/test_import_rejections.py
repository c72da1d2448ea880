"""What makes no capture is rejected in one line, and nothing is left behind."""

import re
import sqlite3
from contextlib import closing
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
    write_ros1,
    write_tum,
    write_wrenches,
)
from import_help import (
    assert_like,
    attributes,
    bag_of,
    bring,
    read_spec,
    realsense,
    rejected,
    ros1,
    tum,
    with_message,
    without,
)
from palpate.__main__ import main
from palpate.capture.tables import read_force


def halved(message, _):
    message.data = message.data[: len(message.data) // 2]
    return message


def unturned(message, messages):
    message.transforms[0].transform = messages.transform(((0, 0, 0, 0), (0, 0, 0)))
    return message


def bag(change=None, **of_film):
    """What makes a bag whose messages, or the film of which it is, are changed."""

    def made(path, film):
        changed = {name: work(film) for name, work in of_film.items()}
        return bag_of(path, replace(film, **changed), change)

    return made


def message(topic, work):
    return bag(with_message(topic, work))


def packed(kind, topic=DEPTH, data=bytes(40)):
    """Images of a codec that loses them or that nothing here unpacks."""
    return message(topic, lambda _, messages: messages.compressed(data, 0, "", kind))


def with_units(path, film):
    """A bag, and beside it a table of forces with a row of units."""
    table = write_wrenches(path / "wrench.csv", film)
    head, rows = table.read_text().split("\n", 1)
    table.write_text(f"{head}\ns,N,N,N,Nm,Nm,Nm\n{rows}")
    return ros1(path, film)


def listed(text):
    """What makes a folder whose list of colour images says something."""

    def made(path, film):
        folder = tum(path, film)
        (path / "secret.png").write_bytes(b"x")
        (folder / "rgb.txt").write_text(f"# stamps\n{text}\n")
        return folder

    return made


def named(name):
    """What makes no recording, but another file; it names one or the other."""

    def made(path, film):
        (path / "film.avi").write_bytes(b"RIFF")
        return path / name

    return made


EYE = "--intrinsics 60 60 32 24"
LENS = "--distortion 0.1 0 0 0 0"
FOLDER = "expected a folder with rgb.txt and depth.txt, found .*film.bag$"
UNIT = "^--depth-unit: expected between a micrometre and a metre, found {} m$"
WINDOW = "^--pairing-ms: expected milliseconds above 0, found {}$"
COLORS = "rgb8, bgr8, rgba8, bgra8, mono8, 8UC1 or bayer_rggb8"
DEPTHS = "16UC1, mono16 or 32FC1"
NO_COLOR = (
    f"color: expected one topic of Image of {COLORS}, or CompressedImage of PNG or JPEG, found none"
)
# What is brought in, with which options, and the line.
REJECTED = [
    (bag(without(WRENCH)), "", "wrench: expected one topic of WrenchStamped, found none"),
    (bag(without(DEPTH)), "", f"depth: .* of Image of {DEPTHS}, or CompressedImage of PNG, found"),
    (bag(without(COLOR)), "", re.escape(NO_COLOR)),
    (bag(lambda *_: None), "", rf"^.*film.bag: {NO_COLOR} \(it holds no messages\)$"),
    (bag(without(COLOR_INFO)), "", "camera.yaml: file: expected a sensor file, or optics"),
    (bag(without("/tf_static")), "",
     "film.bag: tf_static: frames: expected a path from frame depth_optical to color_optical"),
    (message("/tf_static", unturned), "",
     "tf_static: transform: expected a unit quaternion and metres, found length 0"),
    (message(COLOR_INFO, attributes(width=65)), "",
     "/camera/color/camera_info: camera_info: expected 64 x 48 pixels .* found 65 x 48"),
    (message(DEPTH_INFO, attributes(K=np.zeros(9))), "",
     "depth/camera_info: camera_info: K: expected focal lengths above 0, found 0.0"),
    (message(COLOR_INFO, attributes(distortion_model="equidistant")), "",
     "distortion_model: expected one of .* found equidistant with 5"),
    (message(COLOR_INFO, attributes(D=np.full(5, np.nan))), "", "D: expected finite numbers"),
    (message(COLOR, attributes(encoding="yuv422")), "",
     "color: expected one topic of .* found none but /camera/color/image_raw of yuv422"),
    (message(DEPTH, halved), "",
     "depth/image_raw: data: expected 48 rows of at least 128 bytes, found 3072 bytes in rows"),
    (packed("16UC1; compressedDepth rvl"), "", "RVL: republish it as an Image"),
    (packed("32FC1; compressedDepth png"), "", "rounded inverse depth: republish"),
    (packed("16UC1; jpeg compressed"), "", "JPEG keeps 8 of depth's 16 bits"),
    (packed("png", COLOR, b"GIF89a" + bytes(100)), "", f"none but {COLOR} of neither"),
    (message(COLOR, attributes(width=2**31)), "", f"none but {COLOR} of 2147483648"),
    # Images and forces that make no capture.
    (bag(depth=lambda film: [*film.depth[:-1], np.zeros((48, 80), np.uint16)]), "",
     "image: expected 64 x 48 16UC1 as the first, found 80 x 48 16UC1"),
    (bag(depth=lambda film: [depth.astype(np.float32) for depth in film.depth]), "",
     r"depth: expected a median of up to 6.55 m, found .* --depth-unit 0.001"),
    (bag(depth=lambda film: [film.depth[0]] * len(film.depth)), "",
     "frames: expected at least 3 that differ from the one before, found 1 of 6"),
    (bag(color_ns=lambda film: np.full_like(film.color_ns, film.color_ns[0])), "",
     "color: stamps: expected times that move, found"),
    (bag(depth=lambda film: film.depth[:1], depth_ns=lambda film: film.depth_ns[:1]), "",
     "depth: expected at least 2 images, found 1"),
    (bag(wrench_ns=lambda film: film.wrench_ns + 10**12), "",
     "force: time_s: expected samples during the frames' 1700000000.000 to"),
    (with_units, "--force {}/wrench.csv", "wrench.csv: rows: expected numbers, found s, N, N"),
    (realsense, "", "film.bag: wrench: expected one topic"),
    (lambda path, film: write_tum(path, film, wrench=False), "",
     "force.csv: file: expected force.csv .--force <file> will do., found nothing"),
    # Options that do not fit.
    (ros1, "--color /foo", "--color /foo: .* no such topic"),
    (ros1, f"--depth {WRENCH}",
     "--depth /ft_sensor/wrench: expected a topic of .* found geometry_msgs/msg/Wrench"),
    (ros1, "--force none.csv", "none.csv: file: expected a CSV table"),
    *((ros1, f"--depth-unit {unit}", UNIT.format(unit)) for unit in ("0", "nan", "2")),
    (tum, f"{EYE} --depth-unit 0", UNIT.format(0)),
    *((ros1, f"--pairing-ms {part}", WINDOW.format(part)) for part in ("0", "-1", "nan", "inf")),
    (ros1, "--pairing-ms 1", "^frames: expected at least 3 pairs of images within 1 ms, found 0;"
     r" of 6 the nearest is 3.4 ms away \(--pairing-ms\)$"),
    (ros1, EYE, f"^--intrinsics: {FOLDER}"),
    (ros1, LENS, f"^--distortion: {FOLDER}"),
    (tum, "", "camera.yaml: file: expected a sensor file, or optics"),
    (tum, LENS, "^--distortion: expected --intrinsics beside it, found none$"),
    (tum, f"{EYE} --distortion 0.1 nan 0 0 inf",
     "^--distortion: expected finite numbers, found 0.1 nan 0 0 inf$"),
    (tum, "--intrinsics 60 60 32 nan", "^--intrinsics: .* finite numbers, found 60 60 32 nan$"),
    # Lists that say nonsense.
    (listed("1.0 ../../secret.png"), "", "rgb.txt: line 2: expected a file of this folder"),
    (listed("1.0 rgb/none.png"), "",
     "rgb.txt: line 2: expected an image, found nothing at rgb/none.png"),
    (listed("soon rgb/a.png"), "",
     "rgb.txt: line 2: expected a stamp and a file, found soon rgb/a.png"),
    (listed("nan rgb/a.png"), "", "rgb.txt: line 2: expected a stamp and a file"),
    (listed(""), "", "rgb.txt: lines: expected images, found none"),
    # Nothing to import.
    (named("film.avi"), "", "recording: expected a .bag, .mcap .* found another file"),
    (named("none.mcap"), "", "found nothing"),
    (named(""), "", "a folder without them"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "options", "line"), REJECTED)
def test_no_capture(make, options, line, film, tmp_path, capsys):
    given = options.format(tmp_path).split()
    assert_like(line, rejected(capsys, tmp_path, make(tmp_path, film), *given))


def test_two_topics_that_could_be_meant(film, target, tmp_path, capsys):
    messages, aligned = Messages(ros1=True), "/camera/aligned/image_raw"
    found = camera_messages(film, messages)
    found += [(aligned, time, message) for name, time, message in found if name == DEPTH]
    bag = write_ros1(tmp_path / "film.bag", found, messages)
    line = rejected(capsys, tmp_path, bag)
    assert_like(f"named by --depth, found {aligned}, /camera/depth/image_raw", line)
    assert bring(bag, target, "--depth", DEPTH) == 0


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ("raw/block/camera/08-b", r"08-b: capture: expected a name like 08 or 08-a03 .*08-b$"),
        ("raw/block/scans/08", r"scans/08: sensor: expected a name of small .*, found scans$"),
        ("raw/block/My Cam/08", r"08: sensor: expected .*, like d435, found My Cam$"),
        ("raw/sensors/camera/08", r"08: object: expected a name of letters.*, found sensors$"),
        ("raw/sensors/My Cam/load", r"load: sensor: expected .*, like d435, found My Cam$"),
        ("raw/My Cow/camera/08", r"08: object: expected .*, like red_sponge, found My Cow$"),
        ("raw/block/camera/background", "capture: expected --background for this name"),
        ("raw/block/08", r"expected raw/<object>/<sensor>/<capture>, .*, found .*raw/block/08$"),
        ("raw/block/camera --background --force a.csv", "--force: expected none with --background"),
        ("raw/sensors/camera/pivot --force a.csv", "expected none for .*/pivot, found a.csv"),
    ],
)
def test_places_that_are_no_captures(given, line, film, tmp_path, capsys):
    target, mark, options = given.partition(" --")
    options = f"{mark}{options}".split()
    assert_like(line, rejected(capsys, tmp_path, ros1(tmp_path, film), *options, target=target))


@pytest.mark.parametrize("target", ["08", "camera/08"])
def test_a_target_of_too_few_folders(target, film, tmp_path, capsys, monkeypatch):
    bag = bag_of(tmp_path, film)
    monkeypatch.chdir(tmp_path)
    assert main(["import", str(bag), target]) == 1
    expected = "expected raw/<object>/<sensor>/<capture>, like raw/red_sponge/d435/08"
    assert capsys.readouterr().err == f"error: {target}: target: {expected}, found {target}\n"


def lose(bag, which):
    """Of messages."""
    with closing(sqlite3.connect(next(bag.glob("*.db3")))) as content, content:
        content.execute(f"delete from messages where {which}")


def test_a_bag_of_forces_that_lost_some_counts_as_far_as_it_goes(film, target, tmp_path, capsys):
    recording, bag = ros1(tmp_path, film), bag_of(tmp_path, film, ros1=False)
    count = len(film.wrench)
    lose(bag, "id % 50 = 0")
    assert bring(recording, target, "--force", str(bag)) == 0
    assert 0.9 * count < len(read_force(target)) < count
    lose(bag, "true")
    line = rejected(capsys, tmp_path, recording, "--force", str(bag), target="raw/block/camera/09")
    expected = f"expected {count}, as the bag states .*--force .*, found 0$"
    assert_like(f"^{bag}: {WRENCH}: wrenches: {expected}", line)


def test_what_stands_there_is_kept_and_no_object_of_the_labs_is_added_to(
    film, target, tmp_path, capsys
):
    bag, described = bag_of(tmp_path, film), tmp_path / "raw/block/object.yaml"
    target.mkdir(parents=True)
    described.write_text("object: block\nprovenance: simulated\n")
    line = rejected(capsys, tmp_path, bag)
    assert_like("block/object.yaml: provenance: expected recorded, found simulated", line)
    described.write_text("object: block\nprovenance: recorded\n")
    (target / "note.txt").write_text("mine")
    assert_like("08: folder: expected nothing there yet", rejected(capsys, tmp_path, bag))
    assert (target / "note.txt").read_text() == "mine"
    assert bring(bag, target.with_name("09")) == 0


def test_a_sensor_file_that_contradicts(film, target, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    assert bring(bag, target) == 0
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
    folder = tum(tmp_path, film)
    head, *rows = (folder / name).read_text().splitlines()
    (folder / name).write_text("\n".join([head, *(rows[k] for k in order)]))
    stamps = [row.split()[0] for row in rows]
    found = rejected(capsys, tmp_path, folder, *EYE.split())
    assert found == f"{folder / name}: line {line.format(*stamps)}"


def test_a_bag_without_images_says_what_it_holds(film, tmp_path, capsys):
    def many(topic, time, message, _):
        return (f"/scan{time % 11:02d}", time, message) if topic == WRENCH else None

    late = replace(film, wrench_ns=film.wrench_ns[0] + np.arange(len(film.wrench_ns)))
    bag = bag_of(tmp_path, late, many)
    held = ", ".join(f"/scan{k:02d} of geometry_msgs/msg/WrenchStamped" for k in range(8))
    assert rejected(capsys, tmp_path, bag) == f"{bag}: {NO_COLOR} (it holds {held} and 3 others)"
