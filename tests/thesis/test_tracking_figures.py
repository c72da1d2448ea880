"""Figures of tracked surfaces: what they show, and what they compute on the way."""

import numpy as np
import pytest
import trimesh
from palpate.report import panels as tracking_panels
from palpate.report import style
from palpate.report.views import Surface, View, render_surface, view_from
from palpate.surface.pose import to_camera
from palpate.surface.template import Template, refine_template
from thesis.chapter5 import force_direction, rigid_slide, tracking_figures

TOP = View(-90, 90)


def captures(*sensors):
    common = {"object": "foam_ball", "capture": "01", "point": "01", "provenance": "simulated"}
    return [common | {"sensor": sensor} for sensor in sensors]


def texts(figure):
    return {text.get_text() for text in figure.findobj(style.matplotlib.text.Text)}


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(2, 0.06)
    moved = mesh.vertices * [1, 1, 0.9]
    return Surface(mesh.vertices, moved, mesh.faces, np.array([0, 0, 0.06]))


def test_parallel_view_is_a_rotation_with_z_up():
    view = View(-72, 33)
    assert np.allclose(view.axes @ view.axes.T, np.eye(3))
    assert view.project(np.array([[0, 0, 0.001]]))[0, 1] == pytest.approx(np.cos(np.deg2rad(33)))


def test_view_stands_where_the_camera_stood():
    pose = np.eye(4)
    pose[:3, :3] = np.diag([1, -1, -1])
    pose[2, 3] = 0.5
    assert view_from(pose).elevation_deg == pytest.approx(90)
    assert view_from(pose, elevation_deg=10).elevation_deg == 10


def test_picture_of_a_ball_covers_its_disc(ball):
    frame = np.array([-80.0, 80, -80, 80])
    fine = trimesh.creation.icosphere(4, 0.06)
    picture = render_surface(fine.vertices, fine.faces, View(20, 30), frame, width_px=320)
    area = picture[..., 3].mean() * 160**2
    assert area == pytest.approx(np.pi * 60**2, rel=0.01)
    assert picture[160, 160, 3] == 1


def test_nearer_surface_hides_the_farther_one():
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.01
    vertices = np.vstack([square, square + [0, 0, 0.005]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    colours = np.repeat([[1.0, 0, 0], [0, 0, 1.0]], 4, axis=0)
    frame = np.array([-8.0, 8, -8, 8])
    picture = render_surface(vertices, faces, TOP, frame, width_px=20, colours=colours)
    assert picture[..., 0].max() == 0
    assert picture[..., 2].min() > 0.3


def test_edges_are_drawn_dark():
    vertices = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * 0.01
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    frame = np.array([-8.0, 8, -8, 8])
    plain, lined = (
        render_surface(vertices, faces, TOP, frame, width_px=80, edges=edges)[..., :3]
        for edges in (False, True)
    )
    dark = (lined < plain - 0.05).any(axis=2)
    assert dark[np.arange(79, -1, -1), np.arange(80)].all()
    assert dark.mean() < 0.1


def test_a_frame_without_area_is_refused(ball):
    with pytest.raises(ValueError, match="frame_mm: expected an area"):
        render_surface(ball.rest_m, ball.faces, TOP, np.zeros(4), width_px=10)


def test_volume_and_displacement_of_a_squeezed_ball(ball):
    assert ball.volume_change() == pytest.approx(-0.1)
    assert ball.displacement_mm().max() == pytest.approx(6)


def block(edge_m=0.02):
    mesh = trimesh.creation.box((0.6, 0.15, 0.05))
    rough = Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    return refine_template(rough, np.zeros(3), radius_m=1.0, edge_m=edge_m)


def top_and_front(low_m, high_m):
    """Captured points of the block's upper and front face between two places along it."""
    x, y = np.meshgrid(np.arange(-0.3, 0.3001, 0.005), np.arange(-0.075, 0.0751, 0.005))
    top = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.025)])
    x, z = np.meshgrid(np.arange(-0.3, 0.3001, 0.005), np.arange(-0.02, 0.021, 0.005))
    front = np.column_stack([x.ravel(), np.full(x.size, -0.075), z.ravel()])
    normals = np.repeat([[0, 0, 1.0], [0, -1.0, 0]], [len(top), len(front)], axis=0)
    points = np.vstack([top, front])
    kept = rigid_slide.without_ends(points, low_m=low_m, high_m=high_m)
    return points[kept], normals[kept]


def test_a_cloud_without_ends_slides_and_added_ends_hold_it():
    right, options = np.eye(4), {"largest_distance_m": 0.012, "largest_normal_deg": 60}
    template, (points, normals) = block(), top_and_front(-0.02, 0.27)
    start = rigid_slide.shifted(right, 0.01)
    slid = rigid_slide.align_to_nearest(template, points, normals, start, **options)
    left = rigid_slide.slide(slid, right, np.zeros(3))
    assert abs(left) > 0.005
    y, z = np.meshgrid(np.arange(-0.07, 0.071, 0.005), np.arange(-0.02, 0.021, 0.005))
    ends = [np.column_stack([np.full(y.size, x), y.ravel(), z.ravel()]) for x in (-0.3, 0.3)]
    outward = np.repeat([[-1.0, 0, 0], [1.0, 0, 0]], y.size, axis=0)
    whole = np.vstack([points, *ends]), np.vstack([normals, outward])
    held = rigid_slide.align_to_nearest(template, *whole, start, **options)
    assert abs(rigid_slide.slide(held, right, np.zeros(3))) < abs(left)


def test_slide_is_the_shift_along_the_block():
    pose = np.eye(4)
    pose[:3, :3] = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    found = rigid_slide.slide(rigid_slide.shifted(pose, 0.03), pose, np.array([0.1, 0, 0]))
    assert found == pytest.approx(0.03)
    assert np.allclose(to_camera(pose, np.zeros((1, 3))), 0)


def test_a_cloud_far_away_is_refused():
    points, normals = top_and_front(-0.2, 0.2)
    with pytest.raises(ValueError, match="cloud_m: expected points near the template"):
        rigid_slide.align_to_nearest(
            block(0.05), points + 1, normals, np.eye(4),
            largest_distance_m=0.01, largest_normal_deg=60,
        )  # fmt: skip


def test_a_tilted_force_keeps_its_size_and_leans_by_the_angle():
    force = force_direction.tilted(np.array([0, 0, -8.0]), np.array([0, 0, 2.0]), 15)
    assert np.linalg.norm(force) == pytest.approx(8)
    assert -force[2] / 8 == pytest.approx(np.cos(np.deg2rad(15)))


def drawn(ball, tmp_path, name):
    """Every figure on tiny data, saved; their texts by number."""
    two, views = captures("bumblebee", "kinect"), [View(0, 20), View(90, 20)]
    photo, none = np.full((30, 40, 3), 90, np.uint8), np.zeros((0, 3))
    points = ball.rest_m[ball.rest_m[:, 2] > 0]
    cloud = tracking_figures.AddedCloud(points, -points, ball.contact_m[None])
    sets = points, points[:, [1, 0, 2]], -points[:3]
    turned = tracking_figures.TurnedClouds(points, sets, sets)
    pressed = force_direction.Pressed(ball, 5.0, 1.0, 0.001)
    slides = rigid_slide.Slides(np.array([-0.01, 0.01]), {"alone": np.array([-0.01, 0.01])})
    template = Template(ball.rest_m, ball.faces)
    shown = [("alone", points, none), ("held", points, points[:2])]
    known = {"times": 1.0, "note": "force 1 N"}
    cases = [("as measured", pressed), ("turned", pressed)]
    figures = {
        "5": tracking_figures.figure_5_5(two, [photo] * 2, [cloud] * 2, [ball] * 2),
        "6": rigid_slide.figure_5_6(two[0], template, shown, slides, note="cut"),
        "7": tracking_figures.figure_5_7(two[0], ball, ball, points),
        "11": tracking_figures.figure_5_11(two, views, [turned] * 2),
        "12": force_direction.figure_5_12(two[0], cases, views[0], **known),
        "13": tracking_figures.figure_5_13(two, views, [(ball, ball)] * 2),
        "16": tracking_figures.figure_5_16(two[0], photo, views[0], points, ball),
    }
    found = {number: texts(figure) for number, figure in figures.items()}
    for number, figure in figures.items():
        style.save(figure, tmp_path / f"{name}{number}.png", tmp_path / f"{name}{number}.svg")
    return found


def test_figures_name_panels_units_and_provenance_and_repeat_their_bytes(
    ball, tmp_path, monkeypatch
):
    def coarse(*args, width_px, **options):
        return render_surface(*args, width_px=min(width_px, 60), **options)

    monkeypatch.setitem(style.SETTINGS, "savefig.dpi", 40)
    monkeypatch.setattr(tracking_panels, "render_surface", coarse)
    with style.journal():
        found = drawn(ball, tmp_path, "a")
        drawn(ball, tmp_path, "b")
    for number, words in found.items():
        assert {"a", "b", "simulated captures"} <= words, number
        assert any("mm" in word for word in words), number
        one, other = (tmp_path / f"{name}{number}.svg" for name in "ab")
        assert one.read_bytes() == other.read_bytes(), number
    for number in ("5", "7", "12", "13", "16"):
        assert "Displacement (mm)" in found[number]
    assert "volume -10.0 %" in found["13"]
