"""Explanatory figures of chapter 4: drawn points, poses and chains are those of the equations."""

import numpy as np
import pandas as pd
import pytest
from palpate.capture.images import depth_of
from palpate.vision.background import BackgroundModel
from palpate.vision.camera import camera_from_spec
from palpate.vision.probe import MARKER, QUATERNION, marker_from_tip
from thesis.chapter4 import colour_model, pinhole_figure, rig, triangulation

SHAPE = (40, 60)
TABLE, FOAM = (180.0, 155.0, 130.0), (115, 128, 143)
PLACEMENT = {"target_m": [0.0, 0.0, 0.09], "distance_m": 0.65, "elevation_deg": 45}


@pytest.fixture
def model():
    mean = np.tile(np.array(TABLE, np.float32), (*SHAPE, 1))
    std = np.ones_like(mean)
    return BackgroundModel(
        mean=mean,
        std=std,
        brightness_rms=np.full(SHAPE, 0.004, np.float32),
        chromaticity_rms=np.full(SHAPE, 1.4, np.float32),
        brightness_threshold=3.0,
        threshold=4.0,
    )


@pytest.fixture
def scene():
    mask = np.zeros(SHAPE, bool)
    mask[10:30, 20:50] = True
    image = np.tile(np.array(TABLE, np.uint8), (*SHAPE, 1))
    image[mask] = np.array(FOAM) + 4
    image[20, 30] = FOAM
    image[20, 40:42] = (20, 200, 60)
    image[22, 32:44] = np.array(FOAM) - 4
    return image, mask


@pytest.fixture
def samples():
    return np.random.default_rng(2).normal(TABLE, 1.0, (6, 3)).round()


@pytest.fixture
def pose(probe):
    quaternion = np.array([0.19, -0.01, 0.02, 0.0])
    quaternion[3] = np.sqrt(1 - quaternion @ quaternion)
    table = pd.DataFrame({"frame": [0, 1], "detected": [0, 1]})
    table[QUATERNION] = quaternion
    table[MARKER] = [[0.0, 0.0, 0.5], [-0.07, -0.11, 0.53]]
    return table


def test_pixel_is_a_typical_one_off_the_rim(model, scene):
    image, mask = scene
    chosen = [colour_model.choose_pixel(model, image, mask, alpha_low=0.55) for _ in range(2)]
    # All foam off the rim is alike but for a few pixels: the first of them, row by row.
    assert chosen[0] == chosen[1] == (13, 23)
    shrunk = np.zeros_like(mask)
    shrunk[17:24, 27:34] = True
    assert colour_model.choose_pixel(model, image, shrunk, alpha_low=0.55) == (20, 30)


def test_unlike_deviations_are_passed_over(model, scene):
    image, mask = scene
    model.std[:, :40, 0] = 2.0
    row, column = colour_model.choose_pixel(model, image, mask, alpha_low=0.55)
    assert (row, column) == (13, 40)


def test_no_pixel_that_shows_the_model(model, scene):
    image, mask = scene
    with pytest.raises(ValueError, match="expected a pixel that shows the colour model, found"):
        colour_model.choose_pixel(model, image, np.zeros_like(mask), alpha_low=0.55)


def test_grey_images_have_no_colour_model(model, scene):
    image, mask = scene
    with pytest.raises(ValueError, match=r"expected \(h, w, 3\) colours, found shape \(40, 60\)"):
        colour_model.choose_pixel(model, image[..., 0], mask, alpha_low=0.55)


def test_distortions_of_equal_deviations_are_those_of_a_perpendicular(model, scene, samples):
    shown = colour_model.pixel_colour(model, scene[0], samples, (20, 30))
    E, colour = np.array(TABLE), np.array(FOAM)
    assert shown.alpha == pytest.approx(colour @ E / (E @ E), rel=1e-5)
    across = np.linalg.norm(np.cross(colour, E)) / np.linalg.norm(E)
    assert shown.chromaticity == pytest.approx(across / 1.4, rel=1e-4)
    assert shown.sample_alpha == pytest.approx(samples @ E / (E @ E), rel=1e-4)


def test_samples_are_colours(model, scene):
    with pytest.raises(ValueError, match=r"samples: expected shape \(n, 3\), found \(6,\)"):
        colour_model.pixel_colour(model, scene[0], np.zeros(6), (20, 30))


def test_chain_ends_at_the_tip(pose, probe):
    frames = rig.chain(pose, probe)
    assert list(frames) == ["camera", "marker", "force", "tip"]
    assert frames["marker"][:3, 3] == pytest.approx(pose[MARKER].to_numpy()[1])
    assert frames["tip"] == pytest.approx(frames["marker"] @ marker_from_tip(probe))


def test_chain_needs_the_marker(pose, probe):
    with pytest.raises(ValueError, match="expected a frame with the marker, found none of 2"):
        rig.chain(pose.assign(detected=0), probe)


def test_camera_stands_at_its_distance_and_looks_at_its_target():
    pose = rig.camera_pose(PLACEMENT)
    assert pose[:3, :3].T @ pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    ahead = np.array(PLACEMENT["target_m"]) - pose[:3, 3]
    assert ahead == pytest.approx(0.65 * pose[:3, 2])
    assert pose[2, 3] == pytest.approx(0.09 + 0.65 * np.sin(np.pi / 4))
    assert pose[1, 3] < 0


def test_field_of_view_ends_on_the_table_or_at_its_reach(sensors):
    pose = rig.camera_pose(PLACEMENT)
    corners = rig.frustum(sensors["bumblebee"]["color"], pose, 0.7)
    assert corners[0] == pytest.approx(pose[:3, 3])
    assert corners[3:, 2] == pytest.approx(0, abs=1e-12)
    assert (corners[1:3] - pose[:3, 3]) @ pose[:3, 2] == pytest.approx(0.7)


def test_optics_stand_a_baseline_apart(sensors):
    _, places = rig.sensor_mesh(sensors["bumblebee"])
    gap = places["right camera"] - places["left camera"]
    assert gap == pytest.approx([0.12, 0, 0])
    _, places = rig.sensor_mesh(sensors["kinect"])
    gap = places["infrared projector"] - places["infrared camera"]
    assert np.linalg.norm(gap) == pytest.approx(0.075, rel=1e-6)
    assert places["infrared camera"][0] < 0 < places["infrared projector"][0]


def test_sphere_touches_the_pressed_point(probe):
    vertices = rig.probe_on(probe, [0.05, 0.0, 0.0475]).vertices
    lowest = vertices[vertices[:, 2].argmin()]
    assert lowest == pytest.approx([0.05, 0, 0.0475], abs=1e-6)


def test_target_faces_the_cameras_and_is_tilted_as_configured(probe):
    face = -np.linalg.inv(probe["marker_from_force"])[:3, 2]
    towards = rig.UPRIGHT[:3, :3] @ face
    assert towards[1] < 0 < towards[2]
    assert rig.tilt_deg(probe) == pytest.approx(20, abs=1e-3)


def test_field_of_view_of_a_right_angle():
    camera = {"width_px": 200, "fx_px": 100.0, "cx_px": 100.0}
    camera |= {"height_px": 100, "fy_px": 100.0, "cy_px": 0.0}
    assert rig.field_deg(camera) == pytest.approx((90, 45))


@pytest.mark.parametrize("depth_m", [0.5, 0.85, 7.9])
def test_disparity_of_the_drawn_point_gives_its_depth(sensors, depth_m):
    spec = sensors["bumblebee"]
    shape = triangulation.triangle(spec["color"], spec["stereo"]["baseline_m"], depth_m)
    product = spec["color"]["fx_px"] * spec["stereo"]["baseline_m"]
    assert product / shape.disparity_px == pytest.approx(depth_m, rel=1e-12)
    camera = camera_from_spec(spec["color"])
    seen = camera.project([[shape.x_m, 0, depth_m], [shape.x_m - 0.12, 0, depth_m]])[:, 0]
    assert (shape.first_px, shape.second_px) == pytest.approx(tuple(seen), abs=1e-6)


def test_counts_and_depth_are_the_sensors_own(sensors):
    spec = sensors["kinect"]["depth"]
    counts = np.arange(400, 1050)
    depth_m = depth_of(counts[None].astype(np.uint16), spec)[0]
    disparity = spec["fx_px"] * spec["baseline_m"] / depth_m
    assert triangulation.counts_of(spec, disparity) == pytest.approx(counts, rel=1e-5)


@pytest.mark.parametrize(("baseline_m", "depth_m"), [(0.0, 1.0), (0.1, -1.0)])
def test_lengths_are_positive(sensors, baseline_m, depth_m):
    with pytest.raises(ValueError, match=r"_m: expected a positive length, found (0\.0|-1\.0) m"):
        triangulation.triangle(sensors["kinect"]["color"], baseline_m, depth_m)


def test_marked_image_points_lie_on_the_rays(sensors):
    spec = sensors["kinect"]["depth"]
    shape = triangulation.triangle(spec, spec["baseline_m"], 0.85)
    x, z = triangulation.on_plane(shape, shape.first_px)
    assert x / z == pytest.approx(shape.x_m / shape.z_m)
    other, _ = triangulation.on_plane(shape, shape.second_px)
    assert (x - other) / z == pytest.approx(shape.baseline_m / shape.z_m)


def test_pinhole_point_projects_onto_its_image_point(sensors):
    camera = camera_from_spec(sensors["kinect"]["color"] | {"distortion": [0.0] * 5})
    pixel, point = pinhole_figure.shown_point(camera, 0.85)
    assert camera.project(point)[0] == pytest.approx(pixel, abs=1e-6)
    assert point[2] == pytest.approx(0.85)
    assert (pixel > 0).all()
    assert (pixel < [640, 480]).all()
