"""Images and clouds as files: round trips, colours, depths, and what is rejected."""

import cv2
import numpy as np
import pandas as pd
import pytest
from palpate.capture.check_capture import check_capture
from palpate.capture.images import (
    depth_of,
    mosaic_rggb,
    png_problem,
    read_cloud,
    read_image,
    write_image,
)
from palpate.capture.poses import PoseRecord, write_poses
from palpate.capture.tables import WRENCH_COLUMNS, write_force, write_frames
from palpate.config.sensor import SensorSpec
from palpate.examine import examine_frames
from palpate.yaml_files import load_yaml


@pytest.fixture
def noise(tmp_path):
    """A picture of noise, and its file."""
    image = np.random.default_rng(0).integers(0, 255, (48, 64)).astype(np.uint8)
    write_image(tmp_path / "a.png", image, "mono8")
    return tmp_path / "a.png"


def rejected(path, encoding="mono8", words="a.png: image: expected a whole PNG"):
    with pytest.raises(ValueError, match=words):
        read_image(path, encoding)


@pytest.mark.parametrize(
    ("encoding", "shape", "dtype"),
    [
        ("rgb8", (6, 8, 3), np.uint8),
        ("mono8", (6, 8), np.uint8),
        ("kinect_disparity", (6, 8), np.uint16),
        ("millimetre", (6, 8), np.uint16),
    ],
)
def test_round_trip(tmp_path, encoding, shape, dtype):
    image = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, shape).astype(dtype)
    write_image(tmp_path / "a.png", image, encoding)
    assert np.array_equal(read_image(tmp_path / "a.png", encoding), image)
    assert png_problem(tmp_path / "a.png", 8, 6, encoding) is None


def test_colours_keep_their_places_and_are_ordinary_rgb_on_disk(tmp_path):
    """A wrong Bayer constant would swap or smear the channels of the two halves."""
    y, x = np.mgrid[:48, :64]
    rgb = np.stack([40 + 2 * x, 60 + 2 * y, 200 - x], axis=-1).astype(np.uint8)
    rgb[:, 32:] = rgb[:, 32:, ::-1]
    write_image(tmp_path / "a.png", mosaic_rggb(rgb), "bayer_rggb8")
    error = np.abs(read_image(tmp_path / "a.png", "bayer_rggb8").astype(int) - rgb)
    away_from_the_seam = np.r_[2:29, 36:62]
    assert error[2:-2, away_from_the_seam].max() <= 1
    write_image(tmp_path / "a.png", np.full((6, 8, 3), (250, 10, 60), np.uint8), "rgb8")
    assert cv2.imread(str(tmp_path / "a.png"))[0, 0].tolist() == [60, 10, 250]


@pytest.mark.parametrize(
    ("encoding", "shape"),
    [("rgb8", (6, 8)), ("rgb8", (6, 8, 4)), ("mono8", (6, 8, 1)), ("bayer_rggb8", (6, 8, 3))],
)
def test_wrong_channels_are_not_written(tmp_path, encoding, shape):
    with pytest.raises(ValueError, match=f"a.png: {encoding}: expected uint8 of its shape"):
        write_image(tmp_path / "a.png", np.zeros(shape, np.uint8), encoding)
    assert not (tmp_path / "a.png").exists()


@pytest.mark.parametrize("content", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n"])
def test_no_png_is_found(tmp_path, content):
    (path := tmp_path / "a.png").write_bytes(content)
    assert png_problem(path, 8, 6, "mono8").startswith("expected a PNG image")
    rejected(path)


def test_an_image_that_was_cut_or_whose_checksum_does_not_fit(noise):
    content = noise.read_bytes()
    damaged = [content[: len(content) // 2] + content[-12:]]
    for part in (0.1, 0.5, 0.9):
        place = int(len(content) * part)
        damaged.append(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
    for now in damaged:
        noise.write_bytes(now)
        rejected(noise)
    noise.write_bytes(damaged[0])
    assert png_problem(noise, 64, 48, "mono8") is None


def test_wrong_size_and_depth_are_found(noise):
    assert "64 x 48" in png_problem(noise, 640, 480, "mono8")
    assert "16-bit" in png_problem(noise, 64, 48, "millimetre")
    rejected(noise, "millimetre", "expected 16 bits, 1 channels, found 8 bits, 1 channels")


def test_counts_of_depth(root):
    kinect = load_yaml(root / "config/sensors/kinect.yaml")["depth"]
    for spec, counts, metres in (
        ({"encoding": "millimetre"}, [8500, 0], 8.5),
        ({"encoding": "counts", "count_m": 1e-4}, [8500, 0], 0.85),
        (kinect, [690, 2047, 1090], pytest.approx(584.6213 * 0.075 / 50)),
    ):
        depth = depth_of(np.array([counts], np.uint16), spec)
        assert depth[0, 0] == metres and np.isnan(depth[0, 1:]).all()


SENSOR = {"sensor": "zivid", "kind": "cloud", "cloud": {"unit": "m"}, "range_m": [0.2, 2.0]}
SENSOR |= {"base": {"camera_from_base": np.eye(4).tolist()}, "frame_rate_hz": 10}
POINTS = np.random.default_rng(0).uniform([-0.1, -0.1, 0.6], [0.1, 0.1, 0.8], (120, 3))
PLY = "ply\nformat {} 1.0\nelement vertex {}\n{}end_header\n"
PCD = """VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F
COUNT 1 1 1 1 1 1\nWIDTH 15\nHEIGHT 10\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 150\nDATA binary\n"""


def ply(path, rows=POINTS, form="ascii"):
    """As a person's own script writes it."""
    names = ("x", "y", "z", "nx", "ny", "nz")[: rows.shape[1]]
    head = PLY.format(form, len(rows), "".join(f"property float {name}\n" for name in names))
    text = "".join(" ".join(map(str, row)) + "\n" for row in rows.tolist()).encode()
    path.write_bytes(head.encode() + (text if form == "ascii" else rows.astype("<f4").tobytes()))
    return path


def test_points_and_normals_are_read_in_metres(tmp_path):
    """The organised cloud has 120 points in 150 places, and 100 of them have a normal."""
    values = np.full((150, 6), np.nan, np.float32)
    values[:120, :3], values[:100, 3:] = POINTS, [0, 0, -1]
    (organised := tmp_path / "0.pcd").write_bytes(PCD.encode() + values.tobytes())
    binary = ply(tmp_path / "1.ply", values[:120], "binary_little_endian")
    for found in map(read_cloud, (organised, binary)):
        assert found.points_m == pytest.approx(POINTS[:100], abs=1e-6)
        assert found.normals == pytest.approx(np.tile([0, 0, -1.0], (100, 1)))
    for scale, unit in ((1, "m"), (1000, "mm")):
        found = read_cloud(ply(tmp_path / f"{unit}.PLY", scale * POINTS), unit)
        assert found.normals is None and found.points_m == pytest.approx(POINTS, abs=1e-6)
    binary.write_bytes(binary.read_bytes()[:-9])
    few = ply(tmp_path / "2.ply", POINTS[:99])
    for path, line in ((binary, "a whole PLY file"), (few, "100 points or more, found 99")):
        with pytest.raises(ValueError, match=f"^{path}: cloud: expected {line}"):
            read_cloud(path)


def test_each_fault_of_a_capture_has_its_line(tmp_path):
    (tmp_path / "cloud").mkdir()
    frames = pd.DataFrame({"time_s": [0, 0.1, 0.2]}).rename_axis("frame").reset_index()
    frames["cloud"] = names = [f"cloud/{k:06}.ply" for k in range(3)]
    write_frames(tmp_path, frames)
    force = dict.fromkeys(WRENCH_COLUMNS, 0.0) | {"time_s": np.arange(30) / 100}
    write_force(tmp_path, pd.DataFrame(force))
    poses = PoseRecord(np.linspace(0, 0.2, 5), np.tile(np.eye(4), (5, 1, 1)), np.full(5, np.nan))
    write_poses(tmp_path, poses)
    first, second, third = (ply(tmp_path / name, POINTS + 1e-4 * k) for k, name in enumerate(names))
    assert check_capture(tmp_path, SENSOR) == []
    (line,) = examine_frames(tmp_path, SENSOR).found
    assert "120 points without normals, 100% of them in range" in line
    ply(first, 1000 * POINTS)
    with pytest.raises(ValueError, match=r"0.2 to 2 m from the camera .*, found them 7\d\d m away"):
        examine_frames(tmp_path, SENSOR)
    third.write_bytes(second.read_bytes())
    (line,) = check_capture(tmp_path, SENSOR)
    assert f"another cloud in each frame, found {names[2]} the same as {names[1]}" in line
    second.write_text("points"), third.unlink()
    wrong = [f"{second}: cloud: expected a cloud as .ply or .pcd, found something else"]
    wrong += [f"{third}: cloud: expected a cloud, found nothing"]
    assert check_capture(tmp_path, SENSOR) == wrong
    with pytest.raises(ValueError, match="^optics: expected none with kind cloud, found one$"):
        SensorSpec.read(SENSOR | {"frame_rate_hz": 10.0, "optics": "calibration"})
