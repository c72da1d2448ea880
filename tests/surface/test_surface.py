"""Template and rigid alignment on a synthetic block."""

import numpy as np
import pytest
import trimesh
from floor import floor
from palpate.surface.pose import RestingPrior, align_rigidly, initial_pose, to_camera
from palpate.surface.template import (
    Template,
    neighbourhoods,
    read_template,
    refine_template,
    unique_edges,
)
from palpate.surface.tracked import load_tracked, save_tracked
from scipy.spatial.transform import Rotation
from virtual_lab.describe import box_template

SIZE = np.array([0.598, 0.150, 0.0475])
POINT = np.array([-0.05, 0.0, 0.0475])
WITHIN = {"largest_distance_m": 0.012, "largest_normal_deg": 60}


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
    resting = RestingPrior(
        plane,
        floor(1e-3),
        point_m=POINT,
        centre_m=POINT,
        tip_m=to_camera(pose, POINT) + 0.002,
    )
    first = initial_pose(template, cloud, resting)
    found = align_rigidly(template, cloud, normals, first, **WITHIN)
    gap = to_camera(found, template.vertices_m) - to_camera(pose, template.vertices_m)
    assert np.linalg.norm(gap, axis=1).mean() < 1e-3


def test_a_cloud_that_misses_is_refused(template, pose):
    cloud, normals = visible_cloud(template, pose, 0.001, np.random.default_rng(0))
    away = np.eye(4)
    away[:3, 3] = [0.5, 0.5, 2.0]
    with pytest.raises(ValueError, match="alignment: expected most of the cloud within 0.012 m"):
        align_rigidly(template, cloud * 3.0, normals, away, **WITHIN)


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


def test_neighbourhoods(template):
    rings = neighbourhoods(template, reach=1, measure="rings")
    assert rings.nnz == 2 * len(unique_edges(template.faces))
    far = neighbourhoods(template, reach=2, measure="geodesic")
    assert far.nnz > rings.nnz
    with pytest.raises(ValueError, match="neighbourhood: expected rings or geodesic"):
        neighbourhoods(template, reach=1, measure="cones")


def test_tracked_round_trip(template, tmp_path):
    from palpate.surface.tracked import Tracked

    rest = template.vertices_m
    tracked = Tracked(
        rest,
        template.faces,
        rest,
        rest[None],
        np.ones((1, len(rest)), bool),
        np.eye(4),
        np.array([0.001]),
        POINT,
        3,
    )
    for name in "ab":
        save_tracked(tmp_path / f"{name}.npz", tracked)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert load_tracked(tmp_path / "a.npz").contact_frame == 3


def test_a_template_of_very_many_vertices_is_thinned(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("palpate.surface.template.MOST_VERTICES", 2000)
    trimesh.creation.icosphere(subdivisions=5, radius=0.05).export(tmp_path / "ball.ply")
    with caplog.at_level("INFO"):
        ball = read_template(tmp_path / "ball.ply", unit="m")
    assert len(ball.vertices_m) == 2000
    assert np.linalg.norm(ball.vertices_m, axis=1) == pytest.approx(0.05, abs=2e-5)
    assert "ball.ply: template: thinned from 10242 vertices to 2000" in caplog.text


def test_templates_that_are_refused(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.export(tmp_path / "metres.ply")
    with pytest.raises(ValueError, match=r"template.unit: expected an object of 0.01 to 3 m"):
        read_template(tmp_path / "metres.ply", unit="mm")
    two = trimesh.util.concatenate([box, box.copy().apply_translation([0.2, 0, 0])])
    two.export(tmp_path / "two.ply")
    with pytest.raises(ValueError, match="two.ply: template: expected one piece, found 2"):
        read_template(tmp_path / "two.ply", unit="m")
    box.update_faces(np.arange(len(box.faces)) > 0)
    box.export(tmp_path / "open.ply")
    with pytest.raises(ValueError, match="expected a closed surface, found 3 open edges"):
        read_template(tmp_path / "open.ply", unit="m")


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


def spoilt(content, change):
    head, _, body = content.partition(b"end_header\n")
    return change(head) + b"end_header\n" + body


@pytest.mark.parametrize(
    "change",
    [
        lambda c: c[:-40],
        lambda c: c[:5],
        lambda c: b"",
        lambda c: spoilt(c, lambda h: h.replace(b"vertex 8", b"vertex 1000000000000")),
        lambda c: spoilt(c, lambda h: h.replace(b"vertex 8", b"vertex -8")),
        lambda c: spoilt(c, lambda h: h.replace(b"float x", b"quark x")),
        lambda c: spoilt(c, lambda h: h.replace(b"binary_little_endian", b"ascii")),
    ],
    ids=["cut", "cut in the header", "empty", "promised", "negative", "unknown type", "ascii"],
)
def test_a_damaged_template_is_one_line(tmp_path, change):
    path = tmp_path / "template.ply"
    path.write_bytes(change(trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="ply")))
    with pytest.raises(ValueError, match="template.ply: template: expected ") as refused:
        read_template(path, unit="m")
    assert "\n" not in str(refused.value)


def test_a_template_of_another_kind(tmp_path):
    (tmp_path / "a.gltf").write_text('{"buffers": [{"uri": "../secret"}]}')
    with pytest.raises(
        ValueError, match="a.gltf: template: expected a file of .ply, .stl, .obj, .off"
    ):
        read_template(tmp_path / "a.gltf", unit="m")


def test_a_template_with_a_vertex_nowhere(tmp_path):
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    box.vertices[3] = np.nan
    box.export(tmp_path / "a.ply")
    line = "a.ply: template: expected (finite vertices|a closed surface)"
    with pytest.raises(ValueError, match=line):
        read_template(tmp_path / "a.ply", unit="m")
