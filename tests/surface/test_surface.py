"""Templates, read and refined, and their sharp edges; the tracked surface as files."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv
import trimesh
from palpate.surface.options import ElasticTracking
from palpate.surface.pose import to_camera, to_object
from palpate.surface.series import INDEX, save_series
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.surface.template import Template, read_template, refine_template
from palpate.surface.tracked import Tracked, describe, load_tracked, save_tracked
from scipy.spatial.transform import Rotation
from virtual_lab.describe import box_template

SIZE = np.array([0.598, 0.150, 0.0475])
POINT = np.array([-0.05, 0.0, 0.0475])


@pytest.mark.parametrize("drawn", [False, True])
@pytest.mark.parametrize("radius_m", [0.001, 0.02])
def test_refined_template_is_fine_around_the_contact(drawn, radius_m):
    """Of an even mesh, and of the block by its corners alone, as a person draws it."""
    corners = trimesh.creation.box(SIZE).apply_translation([0, 0, SIZE[2] / 2])
    mesh = corners if drawn else box_template(SIZE, 0.015)
    rough = Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    fine = refine_template(rough, POINT, radius_m=radius_m, edge_m=0.0025)
    mesh = trimesh.Trimesh(fine.vertices_m, fine.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.prod(SIZE))
    closest = trimesh.triangles.closest_point(mesh.triangles, np.tile(POINT, (len(fine.faces), 1)))
    near = np.linalg.norm(closest - POINT, axis=1) < radius_m
    lengths = np.linalg.norm(np.diff(mesh.triangles[:, [0, 1, 2, 0]], axis=1), axis=-1)
    assert near.any() and lengths[near].max() <= 0.0025
    with pytest.raises(ValueError, match="edge_m: expected at most 1e-09 m after 40 passes, found"):
        refine_template(rough, POINT, radius_m=1e-6, edge_m=1e-9)


def test_a_template_of_very_many_vertices_is_thinned(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("palpate.surface.template.MOST_VERTICES", 2000)
    trimesh.creation.icosphere(subdivisions=5, radius=0.05).export(tmp_path / "ball.ply")
    with caplog.at_level("INFO"):
        ball = read_template(tmp_path / "ball.ply", unit="m")
    assert len(ball.vertices_m) == 2000
    assert np.linalg.norm(ball.vertices_m, axis=1) == pytest.approx(0.05, abs=2e-5)
    assert "ball.ply: template: thinned from 10242 vertices to 2000" in caplog.text


def test_a_textured_surface_is_closed_where_its_vertices_are(tmp_path):
    """OBJ with a texture's vertex for each corner of each triangle, and PLY with a picture."""
    box = trimesh.creation.box((0.1, 0.1, 0.05))
    lines = ["mtllib nowhere.mtl", *(f"v {x:g} {y:g} {z:g}" for x, y, z in box.vertices)]
    lines += [f"vt {k / 99:g} {k / 98:g}" for k in range(3 * len(box.faces))]
    for k, (a, b, c) in enumerate(box.faces + 1):
        lines.append(f"f {a}/{3 * k + 1} {b}/{3 * k + 2} {c}/{3 * k + 3}")
    (tmp_path / "seams.obj").write_text("\n".join(lines) + "\n")
    head = box.export(file_type="ply", encoding="ascii").decode()
    head = head.replace("format ascii 1.0", "format ascii 1.0\ncomment TextureFile nowhere.png")
    (tmp_path / "picture.ply").write_text(head)
    for name in ("seams.obj", "picture.ply"):
        assert len(read_template(tmp_path / name, unit="m").vertices_m) == 8


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c[:-40],
        lambda c: c[:5],
        lambda c: b"",
        lambda c: c.replace(b"vertex 8", b"vertex 1000000000000"),
        lambda c: c.replace(b"vertex 8", b"vertex -8"),
        lambda c: c.replace(b"float x", b"quark x"),
        lambda c: c.replace(b"binary_little_endian", b"ascii"),
    ],
)
def test_a_damaged_template_is_one_line(tmp_path, change):
    path = tmp_path / "template.ply"
    path.write_bytes(change(trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="ply")))
    with pytest.raises(ValueError, match="template.ply: template: expected ") as refused:
        read_template(path, unit="m")
    assert "\n" not in str(refused.value)


def test_distance_from_sharp_edges_of_which_a_ball_has_none():
    box = trimesh.creation.box((0.1, 0.1, 0.04))
    points = np.array([[0, 0, 0.02], [0.04, 0.03, 0.02], [0.05, 0, 0.015]])
    found = sharp_edge_distance(box.vertices, box.faces, points)
    assert found == pytest.approx([0.05, 0.01, 0.005], abs=1e-5)
    ball = trimesh.creation.icosphere(3, radius=0.06)
    assert np.isinf(sharp_edge_distance(ball.vertices, ball.faces, ball.vertices[:2])).all()


FRAMES = 5
TIME_S = np.array([0.0, 0.171, 0.330, 0.499, 0.668])


@pytest.fixture
def tracked():
    """A ball that moves and shrinks in front of a camera."""
    rng = np.random.default_rng(0)
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.05)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [130, 10, 5], degrees=True).as_matrix()
    pose[:3, 3] = [0.01, -0.02, 0.65]
    rest = np.asarray(ball.vertices)
    moved = [rest * (1 - 0.01 * k) + [0, 0, 0.001 * k] for k in range(FRAMES)]
    known = rng.random((FRAMES, len(rest))) < 0.5, pose, np.linspace(1e-4, 2e-4, FRAMES), rest[7], 2
    moved = to_camera(pose, np.array(moved))
    return Tracked(rest, np.asarray(ball.faces), to_camera(pose, rest), moved, *known)


def test_vtk_reads_every_step(tmp_path, tracked):
    tips = tracked.rest_m[7] + np.linspace(0.002, -0.002, FRAMES)[:, None] * np.ones(3)
    save_series(tmp_path / "series", tracked, time_s=TIME_S, tips_m=tips)
    reader = pv.get_reader(tmp_path / "series" / INDEX)
    assert reader.time_values == TIME_S.tolist()
    for k in range(FRAMES):
        reader.set_active_time_point(k)
        surface = reader.read()[0]
        place = to_object(tracked.camera_from_object, tracked.vertices_m[k])
        moved = place - tracked.template_m
        expected = {"displacement_m": moved, "distance_moved_m": np.linalg.norm(moved, axis=1)}
        assert np.allclose(surface.points, place, atol=5e-8)
        for name, values in (expected | {"observed": tracked.observed[k]}).items():
            assert np.allclose(surface.point_data[name], values, atol=5e-8), name
        assert (surface.regular_faces == tracked.faces).all()
        assert surface.field_data["residual_m"] == tracked.residual_m[k]
        assert (surface.field_data["contact_point_m"] == tracked.contact_point_m).all()
        tip = to_object(tracked.camera_from_object, tips[k])
        assert np.allclose(surface.field_data["tip_m"], tip, atol=1e-15)


def test_a_surface_keeps_its_prior_and_older_files_have_none(tmp_path, tracked):
    residual = np.where(np.arange(FRAMES) == 1, np.nan, tracked.residual_m)
    held = replace(tracked, residual_m=residual, prior='{"poisson_ratio": 0.3}')
    save_tracked(tmp_path / "new.npz", held)
    found = load_tracked(tmp_path / "new.npz")
    assert (found.prior, found.contact_frame) == (held.prior, 2)
    assert (found.vertices_m == tracked.vertices_m).all()
    fields = {name: value for name, value in vars(tracked).items() if name != "prior"}
    np.savez_compressed(tmp_path / "old.npz", **fields)
    assert load_tracked(tmp_path / "old.npz").prior == ""
    content = describe(held, tracker="mine", options=ElasticTracking(poisson_ratio=0.4))
    assert (content["prior"], content["options"]["poisson_ratio"]) == ({"poisson_ratio": 0.3}, 0.4)
    assert content["residual_rms_m"][:2] == [tracked.residual_m[0], None]
