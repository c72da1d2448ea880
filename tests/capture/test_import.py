"""Recordings of every kind become the same capture, frame by frame and sample by sample."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from bag_writing import COLOR_POSE, DEPTH_INFO, DEPTH_POSE, NANOSECONDS, WRENCH, Film, stand_in
from import_help import (
    KINDS,
    assert_same,
    bag_of,
    bring,
    left,
    mcap_file,
    options_for,
    read_spec,
    realsense,
    ros1,
    sqlite3,
    tum,
    with_message,
)
from palpate.__main__ import main
from palpate.capture.experiments import check_experiment
from palpate.capture.images import depth_of, read_image
from palpate.capture.tables import GAUGE_COLUMNS, read_force, read_frames
from scipy.spatial.transform import RigidTransform, Rotation

START_S = 1_700_000_000
RATE_HZ = 30
OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")
# The press begins with the sixth.
FRAMES = 8


@pytest.fixture(scope="module")
def sample_film(root, probe):
    """Most of the sample's capture with the Kinect, as a camera of millimetres would have it."""
    sensor = yaml.safe_load((root / "tests/sample/sensors/kinect.yaml").read_text())
    folder = root / "tests/sample/raw/foam_block/kinect/08"
    frames, force = read_frames(folder).iloc[:FRAMES], read_force(folder).iloc[::4]
    volts = force[list(GAUGE_COLUMNS)].to_numpy()
    color = [read_image(folder / name, "bayer_rggb8") for name in frames["color"]]
    depth = [read_image(folder / name, "kinect_disparity") for name in frames["depth"]]
    depth = [np.nan_to_num(np.rint(1000 * depth_of(one, sensor["depth"]))) for one in depth]
    depth, stamps = [one.astype(np.uint16) for one in depth], nanoseconds(frames["time_s"])
    wrench = volts @ np.array(probe["gauge"]["calibration"]).T, nanoseconds(force["time_s"])
    optics = (tuple(sensor[kind][name] for name in OPTICS) for kind in ("color", "depth"))
    return Film(color, depth, stamps, stamps + 4_000_000, *wrench, *optics)


def nanoseconds(times_s):
    return START_S * NANOSECONDS + np.rint(times_s.to_numpy() * 1e9).astype(np.int64)


@pytest.mark.parametrize("kind", KINDS)
def test_a_film_comes_back(kind, film, tmp_path):
    target = tmp_path / "raw/block/camera/08-a02"
    options = options_for(kind, tmp_path, film)
    assert bring(kind(tmp_path, film), target, *options) == 0
    assert_same(target, film)
    assert sorted(path.name for path in target.parent.iterdir()) == ["08-a02"]


@pytest.mark.parametrize("kind", [ros1, mcap_file, realsense, tum])
def test_the_samples_capture_passes_the_check(kind, sample_film, root, tmp_path, capsys):
    block, sample = tmp_path / "raw/foam_block", root / "tests/sample/raw/foam_block"
    shutil.copytree(sample, block, ignore=shutil.ignore_patterns("kinect", "bum*"))
    described = (block / "object.yaml").read_text()
    (block / "object.yaml").write_text(described.replace("simulated", "recorded"))
    options, recording = options_for(kind, tmp_path, sample_film), kind(tmp_path, sample_film)
    sensors = tmp_path / "sensors"
    assert bring(recording, block / "camera/08", *options, sensors=sensors) == 0
    assert bring(recording, block / "camera", "--background", sensors=sensors) == 0
    capsys.readouterr()
    probes = root / "config/probes"
    assert main(["check", str(block), "--sensors", str(sensors), "--probes", str(probes)]) == 1
    # All is right but that the film itself stands for the empty scene.
    wrong = f"{block}/camera/08: mask: expected foreground in each frame, found none in 0\n  "
    assert capsys.readouterr().out.startswith(wrong)
    assert_same(block / "camera/08", sample_film)
    assert not (block / "camera/background/force.csv").exists()


def of_old_ros(path, film):
    """Names of frames begin with a slash."""

    def slashed(message, _):
        message.header.frame_id = f"/{message.header.frame_id}"
        return message

    return bag_of(path, film, with_message(DEPTH_INFO, slashed))


@pytest.mark.parametrize("kind", [mcap_file, of_old_ros])
def test_the_sensors_file_is_what_the_drivers_said(kind, film, target, tmp_path):
    bring(kind(tmp_path, film), target)
    spec = read_spec(tmp_path)
    assert (spec["sensor"], spec["kind"], spec["frame_rate_hz"]) == ("camera", "depth", RATE_HZ)
    for stream in ("color", "depth"):
        assert tuple(spec[stream][name] for name in OPTICS) == getattr(film, f"{stream}_optics")
        assert (spec[stream]["width_px"], spec[stream]["height_px"]) == (64, 48)
    assert spec["color"]["distortion"] == [0.02, -0.05, 0.001, -0.002, 0.01]
    body_from_color, body_from_depth = (
        RigidTransform.from_components(translation, Rotation.from_quat(quaternion))
        for quaternion, translation in (COLOR_POSE, DEPTH_POSE)
    )
    expected = (body_from_color.inv() * body_from_depth).as_matrix()
    np.testing.assert_allclose(spec["depth"]["color_from_depth"], expected, atol=1e-8)


def test_images_without_a_partner_are_told(target, tmp_path, capsys):
    film, lost = stand_in(frames=12), [3, 7]
    assert bring(sqlite3(tmp_path, left(film, lost, "depth")), target) == 0
    told = capsys.readouterr().out
    assert "2 of 12 images have no depth image within half a frame (16.7 ms), left out" in told
    # The partners of these are lost: no window brings them back.
    assert "--pairing-ms" not in told
    assert_same(target, left(film, lost))


@pytest.mark.parametrize("kind", [sqlite3, tum])
def test_a_wider_window_takes_pairs_that_are_far_apart(kind, target, tmp_path, capsys):
    """One colour and the next depth image are lost: a pair is 30 ms apart."""
    film = left(left(stand_in(frames=12), [4], "color"), [5], "depth")
    recording, options = kind(tmp_path, film), options_for(kind, tmp_path, film)
    assert bring(recording, target, *options) == 0
    said = capsys.readouterr().out
    for other in ("depth", "color"):
        assert f"1 of 11 images have no {other} image within half a frame (16.7 ms)" in said
    assert said.count(" s; of 1 the nearest is 30.0 ms away (--pairing-ms)\n") == 2
    assert len(read_frames(target)) == 10
    target = target.with_name("09")
    assert bring(recording, target, *options, "--pairing-ms", "30") == 0
    said = capsys.readouterr().out
    assert "stamps apart by at most 30.0 ms" in said and "--pairing-ms" not in said
    assert_same(target, film)


def test_the_lens_of_a_folder(film, target, tmp_path):
    lens = [0.2624, -0.9531, -5e-05, 0.0026, 1.1633]
    options = [*options_for(tum, tmp_path, film), "--distortion", *map(str, lens)]
    assert bring(tum(tmp_path, film), target, *options) == 0
    spec = read_spec(tmp_path)
    for kind in ("color", "depth"):
        assert spec[kind]["distortion"] == lens
        assert spec[kind]["fx_px"] == 60.5


def test_frames_before_the_first_force_are_told(target, tmp_path, capsys):
    film = stand_in(frames=12)
    late = film.wrench_ns >= film.color_ns[2] - 1_000_000
    film = replace(film, wrench=film.wrench[late], wrench_ns=film.wrench_ns[late])
    assert bring(ros1(tmp_path, film), target) == 0
    told = "frames: 2 before the first and 0 after the last force sample, left out"
    assert told in capsys.readouterr().out
    assert len(read_frames(target)) == 10


def test_the_clock_is_the_headers(film, target, tmp_path):
    """Messages that were written down late, and not in the order of their stamps."""
    random = np.random.default_rng(5)

    def late(topic, received_ns, message, _):
        return topic, received_ns + int(random.integers(0, 200_000_000)), message

    assert bring(bag_of(tmp_path, film, late), target) == 0
    assert_same(target, film)


@pytest.mark.parametrize("clock", ["Hardware Clock", "Global Time"])
def test_force_of_another_clock(clock, film, target, tmp_path, capsys):
    bag = realsense(tmp_path, film, clock=clock)
    late = replace(film, wrench_ns=film.wrench_ns + 5 * 10**8)
    options = [*options_for(realsense, tmp_path, late), "--force-offset", "-0.5"]
    assert bring(bag, target, *options) == 0
    assert_same(target, film)
    told = "another clock than the computer's (Hardware Clock): force of the computer's clock needs"
    assert (told in capsys.readouterr().out) == (clock == "Hardware Clock")


@pytest.mark.parametrize("kind", [ros1, tum])
def test_images_that_repeat_the_one_before_are_left_out(kind, target, tmp_path, capsys):
    film = stand_in(frames=9)
    color, depth = list(film.color), list(film.depth)
    color[3] = color[4] = color[2]
    depth[6] = depth[5]
    options = options_for(kind, tmp_path, film)
    assert bring(kind(tmp_path, replace(film, color=color, depth=depth)), target, *options) == 0
    told = "frames: 3 of 9 repeat an image of the frame before, left out, the first (color) at"
    assert f"{told} {film.color_ns[3] / NANOSECONDS:.3f} s" in capsys.readouterr().out
    assert_same(target, left(film, [3, 4, 6]))
    assert len(list(target.rglob("*.png"))) == 2 * 6


def test_the_same_bytes_twice(film, target, tmp_path):
    bag, contents = mcap_file(tmp_path, film), []
    for folder in (target, target.with_name("09")):
        bring(bag, folder)
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        contents.append([path.read_bytes() for path in files])
    assert len(contents[0]) == 14 and contents[0] == contents[1]


# Not getrusage: its peak begins with that of the process that started this one.
MEASURED = """
import sys
from pathlib import Path
from palpate.__main__ import main
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


def test_wrenches_without_stamps_can_take_the_receipts(film, target, tmp_path, capsys):
    def unstamped(topic, received_ns, message, _):
        # A recorder notes each of them 0.1 ms late.
        late = topic == WRENCH
        return topic, received_ns - late * 10**5, message.wrench if late else message

    bag = bag_of(tmp_path, film, unstamped)
    assert bring(bag, target) == 1
    assert "--receive-clock" in capsys.readouterr().err
    assert bring(bag, target, "--receive-clock") == 0
    assert_same(target, film)


def test_films_of_the_probe(sample_film, tmp_path):
    """Into raw/sensors: a turning handle has no force; what was held free has an empty table."""
    recording, folder = ros1(tmp_path, sample_film), tmp_path / "raw/sensors/camera"
    sensors = tmp_path / "sensors"
    assert bring(recording, folder / "pivot", sensors=sensors) == 0
    assert not (folder / "pivot/force.csv").exists()
    assert len(read_frames(folder / "pivot")) == FRAMES
    assert bring(recording, folder / "load", "--background", sensors=sensors) == 0
    assert bring(recording, folder / "load", sensors=sensors) == 0
    spec = yaml.safe_load((sensors / "camera.yaml").read_text())
    assert spec["sensor"] == "camera"
    assert len(read_force(folder / "load")) > 0
    assert not (folder / "load/background/force.csv").exists()
    assert check_experiment(folder / "pivot", spec) == []
    assert check_experiment(folder / "load", spec) == []
