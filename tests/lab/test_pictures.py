"""What the lab's cameras see: geometry, noise and the Kinect's disparity."""

import numpy as np
import pytest
import yaml
from palpate.lab.block import fine_surface
from palpate.lab.cameras import KinectDepth, color_image
from palpate.lab.render import Light, View, look_at, render
from palpate.lab.scene import BOARD, OBJECT, TABLE, Scene, make_bench, make_probe
from palpate.vision.camera import PinholeCamera
from palpate.vision.depth import kinect_depth
from palpate.vision.marker import find_corners

SIZE = np.array([0.598, 0.150, 0.0475])
LIGHT = Light(
    np.array([-0.45, -0.35, 0.82]) / np.linalg.norm([-0.45, -0.35, 0.82]), 0.95, 0.45, 0.05
)
NOISE = {"flicker": 0.003, "blur_px": 0.55, "read_variance": 0.6, "shot_variance": 0.008}
TIP = np.array([-0.05, 0, 0.0475 + 0.00622])
TURN = np.column_stack([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]])


@pytest.fixture(scope="module")
def bench():
    return make_bench(SIZE, np.array([[-0.05, 0, 0.0475]]), np.random.default_rng(0))


@pytest.fixture(scope="module")
def scene(probe):
    rest, faces = fine_surface(SIZE, np.array([-0.05, 0, 0.0475]))
    return Scene(
        surface_m=rest,
        rest_m=rest,
        faces=faces,
        probe=make_probe(probe),
        tip_m=TIP,
        object_from_force=TURN,
    )


def view(width, height, focal):
    camera = PinholeCamera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
    return View(camera, look_at([-0.05, 0, 0.14], distance_m=0.6, elevation_deg=45))


def test_the_checkerboard_is_where_the_probe_says(bench, scene, probe):
    eye = view(480, 360, 700.0)
    layer = render(eye, scene, bench, LIGHT, samples=4)
    image = color_image(layer.colour, "mono8", NOISE, np.random.default_rng(0))
    corners = find_corners(image, probe["marker"])
    columns, rows = probe["marker"]["inner_corners"]
    y, x = np.mgrid[:rows, :columns] * probe["marker"]["square_m"]
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    tip_from_marker = np.linalg.inv(
        np.array(probe["marker_from_force"]) @ np.array(probe["force_from_tip"])
    )
    points = (points @ tip_from_marker[:3, :3].T + tip_from_marker[:3, 3]) @ TURN.T + TIP
    transform = eye.camera_from_object
    expected = eye.camera.project(points @ transform[:3, :3].T + transform[:3, 3])
    assert np.abs(corners - expected).max() < 0.2
    assert np.abs((corners - expected).mean(axis=0)).max() < 0.08


def test_kinds_and_shadow(bench, scene):
    layer = render(view(160, 120, 150.0), scene, bench, LIGHT, samples=1)
    assert {TABLE, OBJECT, BOARD} <= set(np.unique(layer.kind))
    on_block = layer.kind == OBJECT
    shadow = on_block & ~layer.lit
    assert 0.005 < shadow.sum() / on_block.sum() < 0.4
    assert layer.colour[shadow].mean() < 0.8 * layer.colour[on_block & layer.lit].mean()


def test_noise_has_the_stated_variance_and_follows_the_seed():
    picture = np.full((200, 200, 3), 0.3, np.float32)
    quiet = NOISE | {"flicker": 0.0}
    first, again, other = (
        color_image(picture, "bayer_rggb8", quiet, np.random.default_rng(s)) for s in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    expected = np.sqrt(0.6 + 0.008 * first.mean() + 1 / 12)
    assert first.std() == pytest.approx(expected, rel=0.03)


def test_kinect_sees_a_plane_with_the_published_noise(root):
    sensor = yaml.safe_load((root / "config/sensors/kinect.yaml").read_text())
    camera = PinholeCamera(320, 240, 584.6, 584.6, 159.5, 119.5)
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1.0, -1.0, -1.0])
    pose[2, 3] = 0.85
    device = KinectDepth(
        View(camera, pose),
        sensor["depth"],
        [0.5, 8.0],
        {"distortion_px": 0.0},
        np.random.default_rng(0),
    )
    rng = np.random.default_rng(1)
    depths = np.stack(
        [kinect_depth(device.image(Scene(), rng), sensor["depth"]) for _ in range(12)]
    )
    depth = depths[:, 20:-20, 20:-20]
    assert np.isfinite(depth).mean() > 0.99
    assert np.nanmean(depth) == pytest.approx(0.85, abs=1e-3)
    # Khoshelham and Elberink 2012, with the rounding to an eighth of a pixel.
    noise, step = 1.425e-6 * 850**2, 2.85e-6 * 850**2
    assert np.nanstd(depth, axis=0).mean() * 1e3 == pytest.approx(
        np.hypot(noise, step / np.sqrt(12)), rel=0.25
    )


def test_projector_casts_a_shadow_of_no_readings(root, scene):
    sensor = yaml.safe_load((root / "config/sensors/kinect.yaml").read_text())
    eye = view(320, 240, 300.0)
    device = KinectDepth(
        eye, sensor["depth"], [0.5, 8.0], {"distortion_px": 0.0}, np.random.default_rng(0)
    )
    _, valid = device.true_disparity(scene)
    assert 0.01 < (~valid).mean() < 0.4
