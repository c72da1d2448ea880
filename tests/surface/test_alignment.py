"""The template laid into a camera's view: pose, first touch, and thickness along a press."""

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.open3d_core import ClosestPoints
from palpate.surface.alignment import (
    align_first,
    first_touch,
    load_alignment,
    resting_prior,
    save_alignment,
    thickness_along,
)
from palpate.surface.options import Aligning
from palpate.surface.pose import TOUCH_STD_M, initial_pose, to_camera
from palpate.surface.template import Template
from trimesh.creation import box, icosphere
from trimesh.sample import sample_surface

R = 0.00622
SIZE = np.array([0.30, 0.15, 0.0475])
POINT = np.array([0.05, 0.0, 0.0475])
LEANING = np.array([np.sin(0.35), 0, -np.cos(0.35)])


def block(change=None):
    """Box on z = 0 by its corners, their upper ones' heights changed by a function of x."""
    mesh = box(SIZE).apply_translation([0, 0, SIZE[2] / 2])
    vertices = np.array(mesh.vertices)
    top = vertices[:, 2] > 0.01
    if change:
        vertices[top, 2] = change(vertices[top, 0])
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def template_of(mesh):
    return Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def seen(mesh, pose, count=12000, noise_m=0.0):
    """Points of the faces that are turned to the camera, and their normals, camera frame."""
    points, faces = sample_surface(mesh, count, seed=3)
    points = points + np.random.default_rng(1).normal(0, noise_m, points.shape)
    cloud, normals = to_camera(pose, points), mesh.face_normals[faces] @ pose[:3, :3].T
    shown = (normals * cloud).sum(axis=1) < 0
    return cloud[shown], normals[shown]


def rest(template, pose, point, tips, *frames):
    """Prior of an object on the plane z = 0 of this pose, pressed by tips in the camera frame."""
    plane = np.append(pose[:3, 2], -pose[:3, 2] @ pose[:3, 3])
    return resting_prior(template, floor(1e-3), point, plane, tips, *frames, indenter_radius_m=R)


@pytest.fixture(scope="module")
def template():
    return template_of(block().subdivide().subdivide().subdivide().subdivide())


@pytest.fixture(scope="module")
def pose():
    pose = np.eye(4)
    angle = np.deg2rad(135)
    pose[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = [0.02, 0.01, 0.65]
    return pose


@pytest.fixture(scope="module")
def alignment(template, pose):
    heights = np.array([0.015, 0.004, -0.001, -0.006])
    tips = to_camera(pose, POINT + np.outer(heights + R, [0, 0, 1]))
    resting = rest(template, pose, {"position_m": POINT}, tips, 2, 3)
    return align_first(template, seen(block(), pose), resting, 2, Aligning())


def test_pose_and_contact_are_found_and_come_back_from_a_file(alignment, pose, tmp_path):
    """No end of the block is seen, so along it the touched point alone decides."""
    gap = to_camera(alignment.camera_from_object, POINT) - to_camera(pose, POINT)
    assert np.abs(gap[1:]).max() < 2e-4
    assert abs(gap[0]) < 2e-3
    assert np.abs(alignment.contact_point_m - POINT)[1:].max() < 2e-4
    assert alignment.rms_m < 1e-4
    save_alignment(tmp_path / "a.json", alignment)
    for name, value in vars(load_alignment(tmp_path / "a.json")).items():
        assert np.array_equal(value, getattr(alignment, name)), name


def test_a_ball_does_not_roll_or_turn_over(pose):
    """No normal shows its turns: they follow the touched point."""
    mesh = icosphere(subdivisions=4, radius=0.06).apply_translation([0, 0, 0.06])
    ball, up, top = template_of(mesh), pose[:3, 2], np.array([0, 0, 0.12])
    tips = to_camera(pose, top + np.outer([0.015, -1e-3], [0, 0, 1]) + [0, 0, R])
    resting = rest(ball, pose, {"position_m": top}, tips, 1, 1)
    cloud = seen(mesh, pose, count=8000, noise_m=1e-3)
    found = align_first(ball, cloud, resting, 1, Aligning())
    assert np.linalg.norm(found.contact_point_m - top) < 1e-3
    tilt = np.arccos(np.clip(found.camera_from_object[:3, 2] @ up, -1, 1))
    assert np.rad2deg(tilt) < 0.2
    centres = [to_camera(one, np.array([0, 0, 0.06])) for one in (found.camera_from_object, pose)]
    assert np.abs(centres[0] - centres[1]).max() < 3e-4


@pytest.mark.parametrize(("sign", "wedge"), [(-1, False), (1, False), (-1, True)])
def test_of_two_equal_turns_the_press_goes_the_declared_way(pose, sign, wedge):
    """A block is its own image turned by half: a tilted press tells which; a wedge shows itself."""
    mesh = block((lambda x: np.where(x > 0, 0.6, 1) * SIZE[2]) if wedge else None)
    points, _ = sample_surface(mesh, 12000, seed=3)
    top = np.array([0, 0, (0.8 if wedge else 1) * SIZE[2]])
    way = LEANING * [sign, 1, 1]
    tips = to_camera(pose, top + [0, 0, R] + np.outer([-0.01, 0, 0.006], way))
    point = {"position_m": top, "direction": LEANING}
    resting = rest(template_of(mesh), pose, point, tips, 1, 2)
    found = initial_pose(template_of(mesh), to_camera(pose, points), resting)
    assert found[:3, 0] @ pose[:3, 0] == pytest.approx(1 if wedge else sign, abs=0.01)


@pytest.mark.parametrize("radius_m", [1e-3, R])
def test_the_first_touch_is_where_the_line_enters(template, radius_m):
    """A declared point may lie off the surface; the tip comes from outside all the same."""
    for below_m in (-0.004, 0.0, 0.004, 0.04):
        centre = first_touch(template, POINT - [0, 0, below_m], np.array([0, 0, -1.0]), radius_m)
        assert centre == pytest.approx(POINT + [0, 0, radius_m], abs=1e-6)


def test_a_cloud_of_something_else(template, pose):
    cloud, normals = seen(block(), pose)
    tips = to_camera(pose, POINT + np.outer([0.015 + R, 0.004 + R, R], [0, 0, 1]))
    resting = rest(template, pose, {"position_m": POINT}, tips, 2, 2)
    with pytest.raises(ValueError, match="cloud: expected at least 90% of its points within 12 mm"):
        align_first(template, (3 * cloud, normals), resting, 2, Aligning())


def test_thickness(template):
    assert thickness_along(template, POINT, [0, 0, -3.0]) == pytest.approx(SIZE[2])
    slanted = np.array([0, np.sin(0.1), -np.cos(0.1)])
    assert thickness_along(template, POINT, slanted) == pytest.approx(SIZE[2] / np.cos(0.1))
    with pytest.raises(ValueError, match="direction: expected a ray through the template"):
        thickness_along(template, POINT, [0, 0, 1.0])


def pressed(surface, pose, point, direction):
    """Template, tips and declared point of a press along a line through a point."""
    direction = np.array(direction) / np.linalg.norm(direction)
    away = np.linspace(0, 0.03, 30001)
    line = point - away[:, None] * direction
    distance = ClosestPoints(surface.vertices, surface.faces).distance(line)
    touch = away[np.flatnonzero(distance < R)[-1]]
    tips = to_camera(pose, point - np.outer(touch + [0.01, 0.0, -0.006], direction))
    return template_of(surface), tips, {"position_m": point, "direction": direction}


TOP = 0.1
SQUARE = np.array([np.sin(np.pi / 6), 0, -np.cos(np.pi / 6)])
END = np.array([SIZE[0] / 2, 0, 0.024])
SLOPE = block(lambda x: TOP + np.tan(np.pi / 6) * x)


def test_the_first_touch_is_along_the_press(pose):
    """Where the object is, nothing pulls it away: the prior's equations hold to a tenth of a mm."""
    top = np.array([0.0, 0.0, TOP])
    on_slope = ((SLOPE, top, SQUARE), (SLOPE, top, [0, 0, -1]))
    for case in (*on_slope, (block(), END, [-1, 0, 0]), (block(), END, [-1, 0, -0.5])):
        surface, point, direction = case
        template, tips, declared = pressed(surface, pose, point, direction)
        resting = rest(template, pose, declared, tips, 1, 2)
        assert np.linalg.norm(resting.equations(pose)[1][:3] * TOUCH_STD_M) < 1e-4


def test_a_press_from_the_side_tells_where_an_unseen_end_is(pose):
    template, tips, declared = pressed(block(), pose, END, [-1, 0, 0])
    resting = rest(template, pose, declared, tips, 1, 2)
    found = align_first(template, seen(block(), pose), resting, 1, Aligning())
    assert abs((found.camera_from_object[:3, 3] - pose[:3, 3]) @ pose[:3, 0]) < 1e-3
