"""The alignment as a result of its own, and the thickness along a press."""

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.open3d_core import ClosestPoints
from palpate.surface.alignment import (
    align_capture,
    first_touch,
    load_alignment,
    resting_prior,
    save_alignment,
    thickness_along,
)
from palpate.surface.pose import TOUCH_STD_M, initial_pose, to_camera
from palpate.surface.template import Template
from trimesh.creation import box, icosphere
from trimesh.sample import sample_surface

R = 0.00622
SIZE = np.array([0.30, 0.15, 0.0475])
POINT = np.array([0.05, 0.0, 0.0475])


@pytest.fixture(scope="module")
def template():
    mesh = box(SIZE).subdivide().subdivide().subdivide().subdivide()
    return Template(np.asarray(mesh.vertices) + [0, 0, SIZE[2] / 2], np.asarray(mesh.faces))


@pytest.fixture(scope="module")
def pose():
    pose = np.eye(4)
    angle = np.deg2rad(135)
    pose[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[:3, 3] = [0.02, 0.01, 0.65]
    return pose


@pytest.fixture(scope="module")
def alignment(template, pose):
    mesh = box(SIZE)
    mesh.apply_translation([0, 0, SIZE[2] / 2])
    points, faces = sample_surface(mesh, 12000, seed=3)
    cloud, normals = to_camera(pose, points), mesh.face_normals[faces] @ pose[:3, :3].T
    seen = (normals * cloud).sum(axis=1) < 0
    up = pose[:3, 2]
    heights = np.array([0.015, 0.004, -0.001, -0.006])
    tips = to_camera(pose, POINT + np.outer(heights + R, [0, 0, 1]))
    plane = np.append(up, -up @ pose[:3, 3])
    point = {"position_m": POINT}
    resting = resting_prior(template, floor(1e-3), point, plane, tips, 2, 3, indenter_radius_m=R)
    return align_capture(
        template,
        (cloud[seen], normals[seen]),
        resting,
        tips,
        2,
        largest_distance_m=0.012,
        largest_normal_deg=60,
    )


def test_pose_and_contact_are_found(alignment, pose):
    """No end of the block is seen, so along it the touched point alone decides."""
    gap = to_camera(alignment.camera_from_object, POINT) - to_camera(pose, POINT)
    assert np.abs(gap[1:]).max() < 2e-4
    assert abs(gap[0]) < 2e-3
    assert np.abs(alignment.contact_point_m - POINT)[1:].max() < 2e-4
    assert alignment.residual.rms_m < 1e-4
    assert abs(alignment.residual.contact_mean_m) < 1e-4
    assert alignment.residual.contact_points > 100


def test_a_ball_does_not_roll_or_turn_over(pose):
    """No normal shows its turns: they follow the touched point."""
    mesh = icosphere(subdivisions=4, radius=0.06)
    ball = Template(np.asarray(mesh.vertices) + [0, 0, 0.06], np.asarray(mesh.faces))
    points, faces = sample_surface(mesh, 8000, seed=3)
    points = points + [0, 0, 0.06] + np.random.default_rng(1).normal(0, 1e-3, points.shape)
    cloud, normals = to_camera(pose, points), mesh.face_normals[faces] @ pose[:3, :3].T
    seen = (normals * cloud).sum(axis=1) < 0
    up, top = pose[:3, 2], np.array([0, 0, 0.12])
    tips = to_camera(pose, top + np.outer([0.015, -1e-3], [0, 0, 1]) + [0, 0, R])
    plane = np.append(up, -up @ pose[:3, 3])
    resting = resting_prior(
        ball, floor(1e-3), {"position_m": top}, plane, tips, 1, 1, indenter_radius_m=R
    )
    cloud = cloud[seen], normals[seen]
    options = {"largest_distance_m": 0.012, "largest_normal_deg": 60}
    found = align_capture(ball, cloud, resting, tips, 1, **options)
    assert np.linalg.norm(found.contact_point_m - top) < 1e-3
    tilt = np.arccos(np.clip(found.camera_from_object[:3, 2] @ up, -1, 1))
    assert np.rad2deg(tilt) < 0.2
    centre = np.array([0, 0, 0.06])
    assert (
        np.abs(to_camera(found.camera_from_object, centre) - to_camera(pose, centre)).max() < 3e-4
    )


@pytest.mark.parametrize("sign", [-1, 1])
def test_of_two_equal_turns_the_press_goes_the_declared_way(template, pose, sign):
    """A block is its own image turned by half: a press that leans along it tells which is meant."""
    mesh = box(SIZE)
    mesh.apply_translation([0, 0, SIZE[2] / 2])
    points, _ = sample_surface(mesh, 12000, seed=3)
    cloud, up = to_camera(pose, points), pose[:3, 2]
    lean = np.array([np.sin(0.35), 0, -np.cos(0.35)])
    tips = to_camera(
        pose, [0, 0, SIZE[2] + R] + np.outer([-0.01, 0, 0.006], sign * lean * [1, 1, sign])
    )
    plane = np.append(up, -up @ pose[:3, 3])
    point = {"position_m": [0, 0, SIZE[2]], "direction": lean}
    resting = resting_prior(template, floor(1e-3), point, plane, tips, 1, 2, indenter_radius_m=R)
    found = initial_pose(template, cloud, resting)
    assert found[:3, 0] @ pose[:3, 0] == pytest.approx(sign, abs=0.01)


@pytest.mark.parametrize("below_m", [-0.004, 0.0, 0.004, 0.04])
@pytest.mark.parametrize("radius_m", [1e-3, R])
def test_the_first_touch_is_where_the_line_enters(template, radius_m, below_m):
    """A declared point may lie off the surface; the tip comes from outside all the same."""
    centre = first_touch(template, POINT - [0, 0, below_m], np.array([0, 0, -1.0]), radius_m)
    assert centre == pytest.approx(POINT + [0, 0, radius_m], abs=1e-6)


def test_round_trip(alignment, tmp_path):
    for name in "ab":
        save_alignment(tmp_path / f"{name}.json", alignment)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    again = load_alignment(tmp_path / "a.json")
    assert np.array_equal(again.camera_from_object, alignment.camera_from_object)
    assert np.array_equal(again.contact_point_m, alignment.contact_point_m)
    assert (again.contact_frame, again.residual) == (2, alignment.residual)


def test_thickness(template):
    assert thickness_along(template, POINT, [0, 0, -3.0]) == pytest.approx(SIZE[2])
    slanted = np.array([0, np.sin(0.1), -np.cos(0.1)])
    assert thickness_along(template, POINT, slanted) == pytest.approx(SIZE[2] / np.cos(0.1))
    ball = icosphere(subdivisions=4, radius=0.06)
    ball = Template(np.asarray(ball.vertices), np.asarray(ball.faces))
    top = np.array([0, 0, 0.06])
    assert thickness_along(ball, top, [0, 0, -1]) == pytest.approx(0.12, rel=1e-3)
    with pytest.raises(ValueError, match="direction: expected a ray through the template"):
        thickness_along(template, POINT, [0, 0, 1.0])


def test_a_cloud_that_tells_turns_apart_outweighs_the_way(template, pose):
    """A wedge seen whole stands as it is seen, whatever the way of the tip."""
    mesh = box(SIZE)
    mesh.apply_translation([0, 0, SIZE[2] / 2])
    vertices = np.array(mesh.vertices)
    vertices[(vertices[:, 0] > 0) & (vertices[:, 2] > 0.01), 2] *= 0.6
    wedge = Template(vertices, np.array(mesh.faces))
    points, _ = sample_surface(trimesh.Trimesh(vertices, mesh.faces, process=False), 12000, seed=3)
    lean = np.array([np.sin(0.35), 0, -np.cos(0.35)])
    touch = np.array([0, 0, 0.8 * SIZE[2]])
    tips = to_camera(pose, touch + [0, 0, R] + np.outer([-0.01, 0, 0.006], lean * [-1, 1, 1]))
    up = pose[:3, 2]
    resting = resting_prior(
        wedge,
        floor(1e-3),
        {"position_m": touch, "direction": lean},
        np.append(up, -up @ pose[:3, 3]),
        tips,
        1,
        2,
        indenter_radius_m=R,
    )
    found = initial_pose(wedge, to_camera(pose, points), resting)
    assert found[:3, 0] @ pose[:3, 0] == pytest.approx(1, abs=0.01)


def pressed(surface, pose, point, direction):
    """Template, plane and tips of a press whose centre comes along a line through a point."""
    direction = np.array(direction) / np.linalg.norm(direction)
    away = np.linspace(0, 0.03, 30001)
    distance = ClosestPoints(surface.vertices, surface.faces).distance(
        point - away[:, None] * direction
    )
    touch = away[np.flatnonzero(distance < R)[-1]]
    tips = to_camera(pose, point - np.outer(touch + [0.01, 0.0, -0.006], direction))
    plane = np.append(pose[:3, 2], -pose[:3, 2] @ pose[:3, 3])
    declared = {"position_m": point, "direction": direction}
    return Template(np.asarray(surface.vertices), np.asarray(surface.faces)), plane, tips, declared


def wedge():
    """A block whose top rises by 30 degrees along x."""
    mesh = box(SIZE)
    mesh.apply_translation([0, 0, SIZE[2] / 2])
    vertices = np.array(mesh.vertices)
    top = vertices[:, 2] > 0.01
    vertices[top, 2] = TOP + np.tan(np.pi / 6) * vertices[top, 0]
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


TOP = 0.1
SLOPE = np.array([np.sin(np.pi / 6), 0, -np.cos(np.pi / 6)])
END = np.array([SIZE[0] / 2, 0, 0.024])


@pytest.mark.parametrize(
    ("surface", "point", "direction"),
    [
        (wedge(), [0.0, 0.0, TOP], SLOPE),
        (wedge(), [0.0, 0.0, TOP], [0, 0, -1]),
        (box(SIZE).apply_translation([0, 0, SIZE[2] / 2]), END, [-1, 0, 0]),
        (box(SIZE).apply_translation([0, 0, SIZE[2] / 2]), END, [-1, 0, -0.5]),
    ],
    ids=["square to a slope", "down on a slope", "from the side", "slanted from the side"],
)
def test_the_first_touch_is_along_the_press(pose, surface, point, direction):
    """Where the object is, nothing pulls it away: the prior's equations hold to a tenth of a mm."""
    template, plane, tips, declared = pressed(surface, pose, np.array(point), direction)
    resting = resting_prior(template, floor(1e-3), declared, plane, tips, 1, 2, indenter_radius_m=R)
    pulled_m = resting.equations(pose)[1][:3] * TOUCH_STD_M
    assert np.linalg.norm(pulled_m) < 1e-4


def test_a_press_from_the_side_tells_where_an_unseen_end_is(pose):
    mesh = box(SIZE).apply_translation([0, 0, SIZE[2] / 2])
    template, plane, tips, declared = pressed(mesh, pose, END, [-1, 0, 0])
    points, faces = sample_surface(mesh, 12000, seed=3)
    cloud, normals = to_camera(pose, points), mesh.face_normals[faces] @ pose[:3, :3].T
    seen = (normals * cloud).sum(axis=1) < 0
    resting = resting_prior(template, floor(1e-3), declared, plane, tips, 1, 2, indenter_radius_m=R)
    found = align_capture(
        template,
        (cloud[seen], normals[seen]),
        resting,
        tips,
        1,
        largest_distance_m=0.012,
        largest_normal_deg=60,
    )
    shift = (found.camera_from_object[:3, 3] - pose[:3, 3]) @ pose[:3, 0]
    assert abs(shift) < 1e-3
