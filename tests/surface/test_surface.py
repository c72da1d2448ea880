"""Template, its sharp edges, and rigid alignment on a synthetic block."""

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.surface.alignment import align_first
from palpate.surface.options import Aligning
from palpate.surface.pose import RestingPrior, align_rigidly, initial_pose, to_camera
from palpate.surface.sharp_edges import sharp_edge_distance
from palpate.surface.template import Template, read_template, refine_template
from scipy.spatial.transform import Rotation
from virtual_lab.describe import box_template

SIZE = np.array([0.598, 0.150, 0.0475])
POINT = np.array([-0.05, 0.0, 0.0475])


@pytest.fixture(scope="module")
def template():
    mesh = box_template(SIZE, 0.015)
    return Template(np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.fixture(scope="module")
def drawn():
    """The same block by its corners alone, as a person draws it."""
    mesh = trimesh.creation.box(SIZE)
    return Template(mesh.vertices + [0, 0, SIZE[2] / 2], np.asarray(mesh.faces))


@pytest.fixture(scope="module")
def pose():
    """A camera in front of the block, 45 degrees up."""
    turn = Rotation.from_euler("x", 135, degrees=True).as_matrix()
    pose = np.eye(4)
    pose[:3, :3] = turn
    pose[:3, 3] = [0.01, 0.02, 0.65]
    return pose


def visible_cloud(template, pose, noise_m, rng):
    """Points of the faces turned to the camera, with normals, camera frame."""
    mesh = trimesh.Trimesh(template.vertices_m, template.faces, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, 20000, seed=int(rng.integers(1 << 30)))
    normals = mesh.face_normals[faces] @ pose[:3, :3].T
    points = to_camera(pose, points)
    seen = (normals * points).sum(axis=1) < 0
    points = points[seen]
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    return points + rays * rng.normal(0, noise_m, (len(points), 1)), normals[seen]


def test_initial_pose_and_alignment_from_any_yaw(template, pose):
    rng = np.random.default_rng(0)
    cloud, normals = visible_cloud(template, pose, 0.001, rng)
    plane = np.append(pose[:3, 2], -pose[:3, 2] @ pose[:3, 3])
    plane = plane if plane[3] > 0 else -plane
    tip = to_camera(pose, POINT) + 0.002
    resting = RestingPrior(plane, floor(1e-3), POINT, centre_m=POINT, tip_m=tip, radius_m=0.0)
    first = initial_pose(template, cloud, resting)
    found = align_rigidly(template, cloud, normals, first, Aligning())
    gap = to_camera(found, template.vertices_m) - to_camera(pose, template.vertices_m)
    assert np.linalg.norm(gap, axis=1).mean() < 1e-3
    with pytest.raises(ValueError, match="cloud: expected at least 90% of its points within 12 mm"):
        align_first(template, (cloud * 3.0, normals), resting, 0, Aligning())


@pytest.mark.parametrize("rough", ["template", "drawn"])
@pytest.mark.parametrize("radius_m", [0.001, 0.02])
def test_refined_template_is_fine_around_the_contact(rough, radius_m, request):
    fine = refine_template(request.getfixturevalue(rough), POINT, radius_m=radius_m, edge_m=0.0025)
    mesh = trimesh.Trimesh(fine.vertices_m, fine.faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.prod(SIZE))
    closest = trimesh.triangles.closest_point(mesh.triangles, np.tile(POINT, (len(fine.faces), 1)))
    near = np.linalg.norm(closest - POINT, axis=1) < radius_m
    lengths = np.linalg.norm(np.diff(mesh.triangles[:, [0, 1, 2, 0]], axis=1), axis=-1)
    assert near.any() and lengths[near].max() <= 0.0025


def test_an_edge_length_out_of_reach(template):
    with pytest.raises(ValueError, match="edge_m: expected at most 1e-09 m after 40 passes, found"):
        refine_template(template, POINT, radius_m=1e-6, edge_m=1e-9)


def test_a_template_of_very_many_vertices_is_thinned(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("palpate.surface.template.MOST_VERTICES", 2000)
    trimesh.creation.icosphere(subdivisions=5, radius=0.05).export(tmp_path / "ball.ply")
    with caplog.at_level("INFO"):
        ball = read_template(tmp_path / "ball.ply", unit="m")
    assert len(ball.vertices_m) == 2000
    assert np.linalg.norm(ball.vertices_m, axis=1) == pytest.approx(0.05, abs=2e-5)
    assert "ball.ply: template: thinned from 10242 vertices to 2000" in caplog.text


def seams(box):
    """A closed box as OBJ with a texture's vertex for each corner of each triangle."""
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in box.vertices]
    lines += [f"vt {k / 99:g} {k / 98:g}" for k in range(3 * len(box.faces))]
    for k, (a, b, c) in enumerate(box.faces + 1):
        lines.append(f"f {a}/{3 * k + 1} {b}/{3 * k + 2} {c}/{3 * k + 3}")
    return "mtllib nowhere.mtl\n" + "\n".join(lines) + "\n"


def test_a_textured_surface_is_closed_where_its_vertices_are(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.05))
    (tmp_path / "seams.obj").write_text(seams(box))
    assert len(read_template(tmp_path / "seams.obj", unit="m").vertices_m) == 8
    head = box.export(file_type="ply", encoding="ascii").decode()
    head = head.replace("format ascii 1.0", "format ascii 1.0\ncomment TextureFile nowhere.png")
    (tmp_path / "picture.ply").write_text(head)
    assert len(read_template(tmp_path / "picture.ply", unit="m").vertices_m) == 8


def test_triangles_wound_both_ways_are_turned_and_doubled_ones_named(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.05))
    faces = box.faces.copy()
    faces[::3] = faces[::3, ::-1]
    trimesh.Trimesh(box.vertices, faces, process=False).export(tmp_path / "mixed.ply")
    found = read_template(tmp_path / "mixed.ply", unit="m")
    assert trimesh.Trimesh(found.vertices_m, found.faces).volume == pytest.approx(5e-4)
    doubled = trimesh.Trimesh(box.vertices, np.vstack([faces, faces[:1]]), process=False)
    doubled.export(tmp_path / "doubled.ply")
    with pytest.raises(ValueError, match="found edges with more than two faces, 3"):
        read_template(tmp_path / "doubled.ply", unit="m")


def headed(old, new):
    """Replace something in a PLY file's head."""

    def change(content):
        head, _, body = content.partition(b"end_header\n")
        return head.replace(old, new) + b"end_header\n" + body

    return change


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c[:-40],
        lambda c: c[:5],
        lambda c: b"",
        headed(b"vertex 8", b"vertex 1000000000000"),
        headed(b"vertex 8", b"vertex -8"),
        headed(b"float x", b"quark x"),
        headed(b"binary_little_endian", b"ascii"),
    ],
    ids=["cut", "cut in the header", "empty", "promised", "negative", "unknown type", "ascii"],
)
def test_a_damaged_template_is_one_line(tmp_path, change):
    path = tmp_path / "template.ply"
    path.write_bytes(change(trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="ply")))
    with pytest.raises(ValueError, match="template.ply: template: expected ") as refused:
        read_template(path, unit="m")
    assert "\n" not in str(refused.value)


def test_templates_that_are_rejected(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    two = trimesh.util.concatenate([box, box.copy().apply_translation([0.2, 0, 0])])
    opened, nowhere = box.copy(), box.copy()
    opened.update_faces(np.arange(len(box.faces)) > 0)
    nowhere.vertices[3] = np.nan
    (tmp_path / "a.gltf").write_text('{"buffers": [{"uri": "../secret"}]}')
    for name, mesh in (("box", box), ("two", two), ("open", opened), ("nowhere", nowhere)):
        mesh.export(tmp_path / f"{name}.ply")
    for name, unit, line in (
        ("box.ply", "mm", "template.unit: expected an object of 0.01 to 3 m"),
        ("two.ply", "m", "two.ply: template: expected one piece, found 2"),
        ("open.ply", "m", "expected a closed surface, found 3 open edges"),
        ("nowhere.ply", "m", "nowhere.ply: template: expected (finite vertices|a closed surface)"),
        ("a.gltf", "m", "a.gltf: template: expected a file of .ply, .stl, .obj, .off"),
    ):
        with pytest.raises(ValueError, match=line):
            read_template(tmp_path / name, unit=unit)


def test_distance_from_sharp_edges_of_which_a_ball_has_none():
    box = trimesh.creation.box((0.1, 0.1, 0.04))
    points = np.array([[0, 0, 0.02], [0.04, 0.03, 0.02], [0.05, 0, 0.015]])
    found = sharp_edge_distance(box.vertices, box.faces, points)
    assert found == pytest.approx([0.05, 0.01, 0.005], abs=1e-5)
    ball = trimesh.creation.icosphere(3, radius=0.06)
    assert np.isinf(sharp_edge_distance(ball.vertices, ball.faces, ball.vertices[:2])).all()
