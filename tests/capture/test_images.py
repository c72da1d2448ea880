"""Images: round trips, the mosaic's colours, depths, and what is rejected."""

import cv2
import numpy as np
import pytest
from palpate.capture.images import depth_of, mosaic_rggb, png_problem, read_image, write_image
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


def test_mosaic_keeps_colours_in_their_places(tmp_path):
    """A wrong Bayer constant would swap or smear the channels of the two halves."""
    y, x = np.mgrid[:48, :64]
    rgb = np.stack([40 + 2 * x, 60 + 2 * y, 200 - x], axis=-1).astype(np.uint8)
    rgb[:, 32:] = rgb[:, 32:, ::-1]
    write_image(tmp_path / "a.png", mosaic_rggb(rgb), "bayer_rggb8")
    error = np.abs(read_image(tmp_path / "a.png", "bayer_rggb8").astype(int) - rgb)
    away_from_the_seam = np.r_[2:29, 36:62]
    assert error[2:-2, away_from_the_seam].max() <= 1


def test_colour_on_disk_is_ordinary_rgb(tmp_path):
    rgb = np.full((6, 8, 3), (250, 10, 60), np.uint8)
    write_image(tmp_path / "a.png", rgb, "rgb8")
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
    (tmp_path / "a.png").write_bytes(content)
    assert png_problem(tmp_path / "a.png", 8, 6, "mono8").startswith("expected a PNG image")
    rejected(tmp_path / "a.png")


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


def test_kinect_equation(root):
    spec = load_yaml(root / "config/sensors/kinect.yaml")["depth"]
    depth = depth_of(np.array([[690, 2047, 1090]], np.uint16), spec)
    assert depth[0, 0] == pytest.approx(584.6213 * 0.075 / 50)
    assert np.isnan(depth[0, 1:]).all()


@pytest.mark.parametrize(
    ("spec", "metres"),
    [({"encoding": "millimetre"}, 8.5), ({"encoding": "counts", "count_m": 1e-4}, 0.85)],
)
def test_counts_of_depth(spec, metres):
    depth = depth_of(np.array([[8500, 0]], np.uint16), spec)
    assert depth[0, 0] == metres and np.isnan(depth[0, 1])
