"""Encodings, depth units, pairs and optics of recordings become the capture's."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import yaml
from bag_writing import (
    COLOR,
    COLOR_FRAME,
    COLOR_INFO,
    DEPTH,
    DEPTH_FRAME,
    DEPTH_INFO,
    Messages,
    camera_messages,
    stand_in,
    write_ros2,
)
from import_help import (
    assert_same,
    bag_of,
    bring,
    options_for,
    read_spec,
    realsense,
    ros1,
    with_message,
)
from palpate.capture.images import read_image
from palpate.capture.importing.optics import coefficients
from palpate.vision.clouds import scene_cloud


def test_registered_depth_and_rectified_images(film, target, tmp_path):
    """Depth is in the colour camera's frame; what is rectified has the projection's optics."""

    def registered(topic, time, message, _):
        if topic == DEPTH_INFO:
            message.header.frame_id = COLOR_FRAME
        if topic == COLOR_INFO:
            message.p = message.p * 1.1
        topic = "/camera/color/image_rect_color" if topic == COLOR else topic
        return None if topic == "/tf_static" else (topic, time, message)

    assert bring(bag_of(tmp_path, film, registered, ros1=False), target) == 0
    spec = read_spec(tmp_path)
    np.testing.assert_array_equal(spec["depth"]["color_from_depth"], np.eye(4))
    assert spec["color"]["distortion"] == [0, 0, 0, 0, 0]
    assert spec["color"]["fx_px"] == pytest.approx(1.1 * film.color_optics[0])


@pytest.mark.parametrize("metres", [False, True])
def test_a_plane_is_where_it_stood(metres, target, tmp_path):
    """Depth of a tilted plane by the camera's model, back through file and images."""
    film = stand_in(size=(96, 128))
    fx, fy, cx, cy = film.depth_optics
    rows, columns = np.mgrid[:96, :128]
    rays = np.stack([(columns - cx) / fx, (rows - cy) / fy, np.ones((96, 128))], axis=-1)
    normal, distance_m = np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97]), 0.8
    depth_m = distance_m / (rays @ normal)
    depth_m[10:20, 10:20] = np.nan
    counts = np.nan_to_num(np.rint(1000 * depth_m)).astype(np.uint16)
    depths = [(depth_m.astype(np.float32) if metres else counts).copy() for _ in film.depth]
    for k, image in enumerate(depths):
        image[0, :k] = 0
    assert bring(ros1(tmp_path, replace(film, depth=depths)), target) == 0
    spec = read_spec(tmp_path)
    image = read_image(target / "depth/000000.png", "millimetre")
    assert not image[10:20, 10:20].any()
    points = scene_cloud({"depth": image}, spec).points_m
    assert len(points) == 96 * 128 - 100
    color_from_depth = np.array(spec["depth"]["color_from_depth"])
    turned = color_from_depth[:3, :3] @ normal
    off = points @ turned - distance_m - turned @ color_from_depth[:3, 3]
    # Half a count along the optical axis is more or less along the normal.
    count_m = 0.0001 if metres else 0.001
    assert np.abs(off).max() < 0.5 * count_m * (rays @ normal).max() + 1e-6
    assert 0.1 < off.std() / count_m < 0.4  # a count over the root of twelve


def test_other_encodings(target, tmp_path):
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
    assert bring(write_ros2(tmp_path / "film", found, messages), target) == 0
    for k in range(len(smooth)):
        color = read_image(target / f"color/{k:06d}.png", "rgb8").astype(int)
        assert np.abs(color - smooth[k]).mean() < 2
        depth = read_image(target / f"depth/{k:06d}.png", "millimetre")
        assert np.array_equal(depth, film.depth[k])


def test_bgr_and_big_endian_depth(film, target, tmp_path):
    def change(topic, time, message, _):
        if topic == COLOR:
            message.encoding = "bgr8"
        if topic == DEPTH:
            message.data = message.data.view(np.uint16).byteswap().view(np.uint8)
            message.is_bigendian = 1
        return topic, time, message

    assert bring(bag_of(tmp_path, film, change), target) == 0
    assert_same(target, replace(film, color=[image[..., ::-1] for image in film.color]))


def test_what_a_count_was_taken_as_is_told(film, target, tmp_path, capsys):
    assert bring(ros1(tmp_path, film), target) == 0
    path = tmp_path / "sensors/camera.yaml"
    path.write_text(yaml.safe_dump(read_spec(tmp_path) | {"range_m": [2, 3]}))
    assert bring(tmp_path / "film.bag", target.with_name("09")) == 0
    found = capsys.readouterr().out
    median_m = 1e-3 * np.median(film.depth)
    told = "one count is 1 mm (16UC1 by REP 118, the recording states none: --depth-unit)"
    assert f"depth: {told}, which makes a median of {median_m:.3g} m" in found
    assert "depth: that is not in the sensor's range_m, 2 to 3 m" in found
    assert "worth a look" not in found
    options = ("--depth-unit", "0.01", "--trust-sensor-file")
    assert bring(tmp_path / "film.bag", target.with_name("10"), *options) == 0
    assert "depth: worth a look: few benches are so far; a D405" in capsys.readouterr().out


OPTICS = ("fx_px", "fy_px", "cx_px", "cy_px")


@pytest.mark.parametrize("whole", [True, False])
def test_optics_of_a_region_in_bins(whole, film, target, tmp_path):
    """A chip of twice the pixels and a margin, read in bins of two: optics in its own pixels."""
    fx, fy, cx, cy = film.color_optics

    def binned(message, _):
        message.binning_x = message.binning_y = 2
        if whole:  # else its optics are of the bins already
            message.width, message.height, roi = 200, 160, message.roi
            roi.x_offset, roi.y_offset, roi.width, roi.height = 10, 20, 128, 96
            message.K = np.array([2 * fx, 0, 2 * cx + 10, 0, 2 * fy, 2 * cy + 20, 0, 0, 1.0])
        return message

    assert bring(bag_of(tmp_path, film, with_message(COLOR_INFO, binned)), target) == 0
    color = read_spec(tmp_path)["color"]
    assert [color[name] for name in OPTICS] == pytest.approx(film.color_optics)


def test_depth_units_of_a_realsense(film, target, tmp_path, capsys):
    bag, options = realsense(tmp_path, film, unit_m=0.0001), options_for(realsense, tmp_path, film)
    assert bring(bag, target, *options) == 0
    assert "rounded" not in capsys.readouterr().out
    place = tmp_path / "sensors/camera.yaml"
    spec = read_spec(tmp_path)
    assert spec["depth"]["encoding"] == "counts" and spec["depth"]["count_m"] == 0.0001
    assert np.array_equal(read_image(target / "depth/000000.png", "counts"), film.depth[0])
    # A file of whole millimetres, of earlier captures, is obeyed, and that is told.
    spec["depth"] |= {"encoding": "millimetre"}
    del spec["depth"]["count_m"]
    place.write_text(yaml.safe_dump(spec))
    assert bring(bag, target.with_name("09"), *options) == 0
    assert "depth: 100 um were rounded to counts of 1000 um" in capsys.readouterr().out
    depth = read_image(target.with_name("09") / "depth/000000.png", "millimetre")
    assert np.array_equal(depth, np.rint(film.depth[0] / 10))


def realsense_of_ros2(path, film, *, unit):
    """What the SDK writes where names have no blanks and options are texts."""
    color, depth = "/device_0/sensor_1/Color_0", "/device_0/sensor_0/Depth_0"
    names = {COLOR: f"{color}/image/data", COLOR_INFO: f"{color}/info/camera_info"}
    names |= {DEPTH: f"{depth}/image/data", DEPTH_INFO: f"{depth}/info/camera_info"}

    def change(topic, time, message, messages):
        if topic == "/tf_static":
            text = messages.make("std_msgs/msg/String", data=unit or "")
            option = "/device_0/sensor_0/option/Depth_Units/value"
            return (option, time, text) if unit else None
        return names.get(topic, topic), time, message

    return bag_of(path, film, change, ros1=False)


NO_UNIT = "the recording or --depth-unit <metres>"
NO_OPTION = {"unit_m": 0.0001, "option": None}


@pytest.mark.parametrize(
    ("write", "stated", "expected"),
    [
        (realsense_of_ros2, {"unit": "0.0001"}, None),
        (realsense_of_ros2, {"unit": None}, NO_UNIT),
        (realsense_of_ros2, {"unit": "mm"}, "between a micrometre"),
        (realsense, NO_OPTION, None),
        (realsense, NO_OPTION | {"marked": False}, NO_UNIT),
    ],
)
def test_where_a_realsense_states_depth_units(
    write, stated, expected, film, target, tmp_path, capsys
):
    bag = write(tmp_path, film, **stated)
    options = ["--registered", *options_for(realsense, tmp_path, film)]
    if expected:
        assert bring(bag, target, *options) == 1
        line = f"Depth_0/image/data: depth units: expected {expected}"
        assert line in capsys.readouterr().err
        options += ["--depth-unit", "0.0001"]
    assert bring(bag, target, *options) == 0
    assert np.array_equal(read_image(target / "depth/000000.png", "counts"), film.depth[0])


def test_depth_too_far_for_the_file_is_left_out(film, target, tmp_path, capsys):
    depth = [image.astype(np.float32) / 1000 for image in film.depth]
    depth[0][:2, :3] = 70.0
    depth[1][0, :3] = np.inf, -np.inf, -1.0
    assert bring(ros1(tmp_path, replace(film, depth=depth)), target) == 0
    assert "depth: 6 pixels beyond 6.554 m, left out (0)" in capsys.readouterr().out
    image = read_image(target / "depth/000001.png", "millimetre")
    assert not image[0, :3].any() and image[1:].all()


def test_inverse_lens_of_a_realsense():
    """The SDK takes rays to the image with its five, all but as OpenCV does with the same."""
    stated = np.array([-0.0567, 0.0665, 0.0006, 0.0002, -0.0214])
    assert coefficients("plumb_bob", stated[:4]) == [*stated[:4], 0.0]
    assert coefficients("", []) == coefficients("None", [0.0] * 5) == [0.0] * 5
    found = coefficients("Inverse Brown Conrady", stated)
    assert found == stated.tolist()
    x, y = np.random.default_rng(1).uniform(-0.5, 0.5, (2, 50))
    k1, k2, p1, p2, k3 = stated
    r2 = x**2 + y**2
    u, v = (part * (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) for part in (x, y))
    u, v = u + 2 * p1 * u * v + p2 * (r2 + 2 * u**2), v + 2 * p2 * u * v + p1 * (r2 + 2 * v**2)
    rays = np.column_stack([x, y, np.ones(50)])
    K = np.array([[640.0, 0, 645], [0, 640, 361], [0, 0, 1]])
    pixels, _ = cv2.projectPoints(rays, *np.zeros((2, 3)), K, np.array(found))
    expected = np.column_stack([K[0, 0] * u + K[0, 2], K[1, 1] * v + K[1, 2]])
    np.testing.assert_allclose(pixels.reshape(-1, 2), expected, rtol=0, atol=0.05)
