"""Objects whose form is a mesh, and other sensors: millimetres and wrenches."""

import numpy as np
import pytest
import trimesh
import yaml
from virtual_lab.checks import lab_problems
from virtual_lab.kinect import KinectDepth
from virtual_lab.rig import depth_view
from virtual_lab.scene import Bench, Scene
from virtual_lab.shapes import shape_of
from virtual_lab.signed_distance import ClosedMesh
from virtual_lab.wrench import gauge_record

RADIUS, SUNK = 0.04, 0.015


@pytest.fixture(scope="module")
def dome(tmp_path_factory):
    """A ball that the table cuts 15 mm above its lowest point."""
    path = tmp_path_factory.mktemp("dome") / "dome.ply"
    ball = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    ball.apply_translation([0.01, 0, RADIUS - SUNK]).export(path)
    return str(path)


def test_the_signed_distance_of_a_mesh(dome):
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.05, 0.05, (200, 3)) + [0.01, 0, RADIUS - SUNK]
    exact = np.linalg.norm(points - [0.01, 0, RADIUS - SUNK], axis=1) - RADIUS
    assert ClosedMesh(dome)(points) == pytest.approx(exact, abs=1e-4)


def form(file, surface_m):
    return {"shape": {"kind": "mesh", "file": file, "surface_m": surface_m}}


def test_the_table_cuts_a_mesh(dome):
    surface = trimesh.Trimesh(*shape_of(form(dome, 0.003)).surface(), process=False)
    assert surface.is_watertight
    assert surface.bounds[:, 2] == pytest.approx([0, 2 * RADIUS - SUNK], abs=2e-4)
    cap = np.pi * SUNK**2 * (3 * RADIUS - SUNK) / 3
    assert surface.volume == pytest.approx(4 / 3 * np.pi * RADIUS**3 - cap, rel=0.01)


OPTIONS = {"deepest_m": 0.004, "spacing_m": 0.012, "element_m": 0.004}


def test_a_mesh_is_bonded_to_the_table(dome):
    top = np.array([0.01, 0, 2 * RADIUS - SUNK])
    model = shape_of(form(dome, 0.006)).model(top, OPTIONS)
    fixed = model.fixed.all(axis=1)
    assert fixed.any()
    assert np.abs(model.solid.nodes_m[fixed, 2]).max() < 1e-9
    # A rigid turn of the nodes is a rigid turn of the surface.
    turn = np.array([[0, -1e-3, 0], [1e-3, 0, 0], [0, 0, 0]])
    moved = model.sample(model.solid.nodes_m @ turn.T)
    assert moved == pytest.approx(model.surface_rest_m @ turn.T, abs=3e-6)


@pytest.fixture
def own(root):
    """The own object's lab, its sensor and its probe."""
    folder = root / "tests/own_object"
    names = ("lab.yaml", "sensors/bench_cam.yaml", "probes/bench_probe.yaml")
    lab, sensor, probe = (yaml.safe_load((folder / name).read_text()) for name in names)
    return lab, sensor, probe


def test_the_own_objects_lab_makes_sense(own, root, monkeypatch):
    monkeypatch.chdir(root)
    lab, sensor, _ = own
    assert lab_problems(lab, {"bench_cam": sensor}, "lab.yaml") == []
    cow = lab["objects"]["toy_cow"]
    cow["object"]["points"]["back"]["position_m"] = [0.0189, 0.0, 0.06]
    (line,) = lab_problems(lab, {"bench_cam": sensor}, "lab.yaml")
    assert "points.back.position_m: expected on the mesh's surface" in line
    cow["shape"]["file"] = "tests/own_object/raw/toy_cow/template.ply"
    (line,) = lab_problems(lab, {"bench_cam": sensor}, "lab.yaml")
    assert "shape.file: tests/own_object/raw/toy_cow/template.ply: mesh: expected z from" in line


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


def test_a_sensor_that_reports_wrenches(own):
    lab, _, probe = own
    options = lab["force"]
    time = np.arange(0, 1, 0.002)
    force = np.where(time > 0.5, 2.0, 0.0)[:, None] * [0, 0, 1]
    upside_down = np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (len(time), 3, 3))
    rng = np.random.default_rng(1)
    record = gauge_record(time, force, upside_down, probe, options, rng)
    assert list(record.columns)[:4] == ["time_s", "fx_n", "fy_n", "fz_n"]
    step = record["fz_n"][time > 0.5].mean() - record["fz_n"][time <= 0.5].mean()
    assert step == pytest.approx(-2.0, abs=0.01)
    assert record["fz_n"][time < 0.5].std() == pytest.approx(0.02, rel=0.2)
    del options["wrench"]
    with pytest.raises(ValueError, match="force.wrench: expected its noise"):
        gauge_record(time, force, upside_down, probe, options, rng)
