"""What the lab's cameras see: geometry, noise and the Kinect's disparity."""

import cv2
import numpy as np
import pytest
from palpate.capture.images import depth_of
from palpate.vision.camera import PinholeCamera
from palpate.vision.marker import board_of
from virtual_lab.block import fine_surface
from virtual_lab.kinect import KinectDepth
from virtual_lab.paint import BlockPaint, table_texture
from virtual_lab.probe import make_probe
from virtual_lab.render import Light, PosedCamera, look_at, render, render_change
from virtual_lab.rig import Exposure, depth_view
from virtual_lab.scene import Bench, Scene

SIZE = np.array([0.598, 0.150, 0.0475])
LIGHT = Light(
    np.array([-0.45, -0.35, 0.82]) / np.linalg.norm([-0.45, -0.35, 0.82]), 0.95, 0.45, 0.05
)
NOISE = {"flicker": 0.003, "blur_px": 0.55, "read_variance": 0.6, "shot_variance": 0.008}
TIP = np.array([-0.05, 0, 0.0475 + 0.00622])
TURN = np.column_stack([[1, 0, 0], [0, -1, 0], [0, 0, -1.0]])


KINECT = {"distortion_px": 0.0, "noise": 0.006, "shot_noise": 0.03, "correlation": 0.45}


@pytest.fixture(scope="module")
def bench():
    rng = np.random.default_rng(0)
    paint = BlockPaint(SIZE, np.array([[-0.05, 0, 0.0475]]), rng)
    return Bench(table_texture(rng), paint)


@pytest.fixture(scope="module")
def scene(bench, probe):
    rest, faces = fine_surface(SIZE, np.array([-0.05, 0, 0.0475]))
    placed = {"probe": make_probe(probe), "tip_m": TIP, "object_from_force": TURN}
    return Scene(bench, surface_m=rest, rest_m=rest, faces=faces, **placed)


def view(width, height, focal):
    camera = PinholeCamera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
    return PosedCamera(camera, look_at([-0.05, 0, 0.14], distance_m=0.6, elevation_deg=45))


def test_the_target_is_where_the_probes_file_says(scene, probe):
    camera = view(480, 360, 700.0)
    layer = render(camera, scene, LIGHT, samples=3)
    image = Exposure(layer.colour, "mono8", NOISE).shot(np.random.default_rng(0))
    corners = board_of(probe["marker"]).find(image)
    columns, rows = probe["marker"]["inner_corners"]
    y, x = np.mgrid[:rows, :columns] * probe["marker"]["square_m"]
    tip_from_marker = make_probe(probe).tip_from_marker
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]) @ tip_from_marker[:3, :3].T
    points = (points + tip_from_marker[:3, 3]) @ TURN.T + TIP
    expected = camera.camera.project(camera.local(points))
    assert np.abs(corners - expected).max() < 0.2
    assert np.abs((corners - expected).mean(axis=0)).max() < 0.08


def test_noise_has_the_stated_variance_and_follows_the_seed():
    picture = np.full((200, 200, 3), 0.3, np.float32)
    quiet = NOISE | {"flicker": 0.0}
    first, again, other = (
        Exposure(picture, "bayer_rggb8", quiet).shot(np.random.default_rng(s)) for s in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    expected = np.sqrt(0.6 + 0.008 * first.mean() + 1 / 12)
    assert first.std() == pytest.approx(expected, rel=0.03)


def test_what_changed_is_rendered_as_the_whole_would_be(bench, scene):
    """Rendering just what moved gives the same picture as rendering all again."""
    rest, faces = scene.rest_m, scene.faces
    camera = view(240, 180, 300.0)
    before = Scene(bench, surface_m=rest, rest_m=rest, faces=faces)
    still = render(camera, before, LIGHT, samples=2)
    change = render_change(camera, scene, LIGHT, still, moved_m=np.zeros(len(rest)), samples=2)
    whole = render(camera, scene, LIGHT, samples=2)
    assert np.array_equal(change.kind, whole.kind)
    # Here and there the last of a shadow's soft edge is missed.
    assert (np.abs(change.colour - whole.colour).max(axis=2) > 0.02).mean() < 1e-3
    assert (np.abs(change.colour - still.colour).max(axis=2) > 0.1).sum() > 500


def facing_plane(sensor, distance_m, bench_table):
    """A Kinect of a quarter's size that looks straight down onto the table."""
    camera = PinholeCamera(320, 240, 584.6, 584.6, 159.5, 119.5)
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1.0, -1.0, -1.0])
    pose[2, 3] = distance_m
    rng = np.random.default_rng(0)
    device = KinectDepth(PosedCamera(camera, pose), sensor["depth"], [0.5, 8.0], KINECT, rng)
    return device, Scene(Bench(bench_table, None))


@pytest.mark.parametrize("distance_m", [0.7, 0.85, 1.0])
def test_kinect_sees_a_plane_with_the_published_noise(sensors, bench, distance_m):
    sensor = sensors["kinect"]
    device, plane = facing_plane(sensor, distance_m, bench.table)
    rng = np.random.default_rng(1)
    depths = np.stack([depth_of(device.image(plane, rng), sensor["depth"]) for _ in range(8)])
    depth = depths[:, 20:-20, 20:-20]
    assert np.isfinite(depth).mean() > 0.98
    assert np.nanmean(depth) == pytest.approx(distance_m, abs=1e-3)
    # Khoshelham and Elberink 2012: standard deviation and step of the depth [mm].
    noise, step = 1.425e-6 * (distance_m * 1e3) ** 2, 2.85e-6 * (distance_m * 1e3) ** 2
    assert 0.5 * noise < np.nanstd(depth) * 1e3 < 1.6 * np.hypot(noise, step / np.sqrt(12))
    levels = np.unique(depth[np.isfinite(depth)]) * 1e3
    assert np.median(np.diff(levels)) == pytest.approx(step, rel=0.05)


def test_kinect_has_eleven_bits_and_no_reading_out_of_range(sensors, bench):
    sensor = sensors["kinect"]
    for distance_m, share in ((0.45, 1.0), (0.8, 0.0)):
        device, plane = facing_plane(sensor, distance_m, bench.table)
        counts = device.image(plane, np.random.default_rng(0))
        assert counts.dtype == np.uint16 and counts.max() < 2**11
        assert (counts == sensor["depth"]["no_reading"]).mean() == pytest.approx(share, abs=0.1)


def test_projector_casts_a_shadow_of_no_readings(sensors, scene):
    rng = np.random.default_rng(0)
    device = KinectDepth(view(320, 240, 300.0), sensors["kinect"]["depth"], [0.5, 8], KINECT, rng)
    disparity, strength = device.true_signal(scene)
    shadow = np.isfinite(disparity) & (strength == 0)
    assert 0.01 < shadow.mean() < 0.4
    missing = device.image(scene, rng) == sensors["kinect"]["depth"]["no_reading"]
    # Noise alone seldom matches: deep in the shadow there are hardly any readings.
    deep = cv2.erode(shadow.astype(np.uint8), np.ones((9, 9))) > 0
    assert missing[deep].mean() > 0.9


def test_a_camera_that_writes_millimetres(own):
    lab, sensor, _ = own
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = 0.8
    options = lab["kinect"] | {"distortion_px": 1e-9}
    rng = np.random.default_rng(2)
    view = depth_view(sensor, pose)
    camera = KinectDepth(view, sensor["depth"], sensor["range_m"], options, rng)
    scene = Scene(Bench(np.full((4, 4, 3), 0.6), None))
    depth = camera.image(scene, rng)
    middle = depth[100:300, 100:300]
    assert (middle > 0).mean() > 0.9
    assert np.median(middle) == pytest.approx(800, abs=2)
    far = KinectDepth(view, sensor["depth"], [0.1, 0.5], options, rng).image(scene, rng)
    assert not far.any()
