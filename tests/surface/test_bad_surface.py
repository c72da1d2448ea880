"""What alignment and tracking end with over input that does not fit: one line, nothing written."""

import json
from functools import partial

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.tables import write_table
from palpate.solid.mesh import solid_mesh, write_solid
from palpate.surface.alignment import Alignment, save_alignment
from palpate.vision.clouds import Cloud, save_clouds
from palpate.vision.probe import AXIS
from settings import full
from skfem import MeshTet
from trimesh.sample import sample_surface

RADIUS = 0.00622
PROBE = {"probe": {"indenter": {"radius_m": RADIUS}}}
TRACKED = {"tracked": "tracked.npz", "series": "series", "description": "tracked.json"}
POINT = np.array([0.01, 0.0, 0.03])
FRAMES = 4
HEIGHTS = np.array([0.015, 0.004, -0.001, -0.003])
NOISE_M = 0.0005
# The object's frame is the camera's, turned: the camera looks straight down from 0.6 m.
POSE = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.6], [0, 0, 0, 1]])


def height_m(x, y):
    """A flat top with a hill and a hollow: neither a mirror image nor any turn of it fits it."""
    hill = 0.025 * np.exp(-((x + 0.035) ** 2 + (y - 0.015) ** 2) / 0.015**2)
    return 0.03 + hill - 0.012 * np.exp(-((x - 0.04) ** 2 + (y + 0.02) ** 2) / 0.015**2)


@pytest.fixture(scope="module")
def shape():
    """Closed surface of 120 mm by 80 mm under `height_m`."""
    mesh = trimesh.creation.box((0.12, 0.08, 1.0))
    for _ in range(3):
        mesh = mesh.subdivide()
    x, y, z = mesh.vertices.T
    return trimesh.Trimesh(np.column_stack([x, y, (z + 0.5) * height_m(x, y)]), mesh.faces)


@pytest.fixture
def files(tmp_path, shape):
    """Inputs of align and track that fit each other."""
    return Files(tmp_path, shape)


class Files:
    """A capture's files before alignment and tracking, to be spoilt one at a time."""

    def __init__(self, folder, shape):
        self.folder, self.shape = folder, shape
        self.template(shape)
        self.cloud(self.seen())
        self.tips(POINT + np.outer(HEIGHTS + RADIUS, [0, 0, 1]))
        self.forces([0.0, 0.01, 0.5, 1.0])
        self.describe()
        plane = {"normal": [0, 0, -1.0], "offset_m": 0.6}
        (folder / "plane.json").write_text(json.dumps(plane))
        save_alignment(folder / "alignment.json", Alignment(POSE, POINT, 2, 1e-4))
        mesh = MeshTet().refined(1)
        write_solid(folder / "solid.vtu", solid_mesh(0.03 * mesh.p.T, mesh.t.T))

    def describe(self, **template):
        content = {
            "template": {"unit": "m", "vertices": 50} | template,
            "support": {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3},
            "points": {"01": {"position_m": POINT.tolist()}},
        }
        (self.folder / "object.yaml").write_text(yaml.safe_dump(content))

    def template(self, mesh):
        mesh.export(self.folder / "template.ply")

    def seen(self):
        """What the camera sees of the object, with noise: points and normals."""
        points, faces = sample_surface(self.shape, 6000, seed=3)
        normals = self.shape.face_normals[faces]
        up = normals[:, 2] > 0.1
        points = points[up] + np.random.default_rng(0).normal(0, NOISE_M, points[up].shape)
        return points @ POSE[:3, :3].T + POSE[:3, 3], normals[up] @ POSE[:3, :3].T

    def cloud(self, *clouds):
        clouds = clouds if len(clouds) > 1 else clouds * FRAMES
        save_clouds(self.folder / "clouds.npz", [Cloud(*cloud) for cloud in clouds])

    def tips(self, tips_m):
        tips = tips_m @ POSE[:3, :3].T + POSE[:3, 3]
        names = ("tip_x_m", "tip_y_m", "tip_z_m")
        table = pd.DataFrame(
            {"time_s": np.arange(len(tips)) / 6} | dict(zip(names, tips.T, strict=True))
        )
        write_table(self.folder / "probe_pose.csv", table)

    def forces(self, newtons):
        force = np.asarray(newtons, dtype=float)
        table = pd.DataFrame({"fx_n": 0 * force, "fy_n": 0 * force, "fz_n": force})
        write_table(self.folder / "force.csv", table)


@pytest.fixture
def execute(stage):
    """Run a stage of a capture."""
    wildcards = {"object": "hill", "sensor": "kinect", "capture": "01", "tracker": "study"}
    return partial(stage, wildcards=wildcards)


@pytest.fixture
def align(execute, files, root):
    options = full(root)["tracking"]["alignment"]
    inputs = {"object": "object.yaml", "template": "template.ply", "cloud": "clouds.npz"}
    inputs |= {"pose": "probe_pose.csv", "force": "force.csv", "plane": "plane.json"}

    def aligned():
        return execute(
            "align",
            inputs={name: files.folder / file for name, file in inputs.items()},
            outputs={"alignment": "made.json"},
            params=PROBE | {"options": options, "onset_force_n": 0.1},
        )

    return aligned


@pytest.fixture
def track(execute, files, root):
    options = full(root)["tracking"]["trackers"]["study"]
    inputs = {"object": "object.yaml", "template": "template.ply", "clouds": "clouds.npz"}
    inputs |= {"pose": "probe_pose.csv", "force": "force.csv", "solid": "solid.vtu"}
    inputs |= {"alignment": "alignment.json"}

    def tracked():
        return execute(
            "track",
            inputs={name: files.folder / file for name, file in inputs.items()},
            outputs=TRACKED,
            params=PROBE | {"options": options},
        )

    return tracked


def test_what_fits_is_aligned_and_tracked_to_the_same_bytes_each_time(files, align, track):
    assert align() is None
    made = files.folder / "made.json"
    found = np.array(json.loads(made.read_text())["camera_from_object"])
    assert np.abs(found - POSE).max() < 4e-3
    made.unlink()
    runs = []
    for _ in range(2):
        assert track() is None
        made = [files.folder / TRACKED["tracked"], files.folder / TRACKED["description"]]
        made += sorted((files.folder / TRACKED["series"]).iterdir())
        runs.append([file.read_bytes() for file in made])
    assert runs[0] == runs[1]
    described = json.loads(runs[0][1])
    with np.load(files.folder / TRACKED["tracked"], allow_pickle=False) as data:
        assert described["vertices"] == len(data["template_m"])
        assert described["observed_vertices"] == data["observed"].sum(axis=1).tolist()
        assert described["residual_rms_m"] == data["residual_m"].tolist()
    told = [described[name] for name in ("frames", "tracker", "kind", "prior")]
    assert told == [FRAMES, "study", "study", None]


@pytest.mark.parametrize("frame", [0, 2])
def test_a_frame_of_few_points(files, track, frame):
    clouds = [files.seen() for _ in range(FRAMES)]
    clouds[frame] = tuple(part[:7] for part in clouds[frame])
    files.cloud(*clouds)
    expected = f"frame {frame}: cloud: expected at least 30 points, found 7"
    assert f"{files.folder}/clouds.npz: {expected}" in track()


@pytest.mark.parametrize("which", ["align", "track"])
def test_tips_of_fewer_frames(request, files, which):
    files.tips(POINT + np.outer(HEIGHTS[:3] + RADIUS, [0, 0, 1]))
    line = request.getfixturevalue(which)()
    assert f"{files.folder}/probe_pose.csv: tip_x_m: expected 4 frames, found 3" in line


def test_forces_of_more_frames(files, track):
    files.forces([0.0, 0.01, 0.5, 1.0, 1.0])
    assert f"{files.folder}/force.csv: fx_n: expected 4 frames, found 5" in track()


def test_a_tip_that_never_comes_near(files, align, track):
    files.tips(POINT + np.outer(HEIGHTS + RADIUS + 0.03, [0, 0, 1]))
    assert f"{files.folder}/probe_pose.csv: tip: expected within 12.4 mm" in track()
    expected = "tip: expected at most 5 mm from the template when the force begins, found"
    assert f"{files.folder}/probe_pose.csv: {expected}" in align()


def test_eyes_are_where_the_calibration_has_them(files, execute, root, sensors):
    """As for the clouds: a file's stated optics don't hold where a calibration was asked for."""
    heights = np.array([0.012, 0.010, 0.008, 0.006, -0.001, -0.004])
    files.tips(POINT + np.outer(heights + RADIUS, [0, 0, 1]))
    files.forces([0.0, 0.0, 0.0, 0.0, 0.5, 1.0])
    (points, normals), noise = files.seen(), np.random.default_rng(1).normal(0, 1e-4, (6, 1, 3))
    files.cloud(*[(points + one, normals) for one in noise])
    poses, axis = pd.read_csv(files.folder / "probe_pose.csv"), POSE[:3, :3] @ [0.0, 0.8, -0.6]
    poses = poses.assign(**dict(zip(AXIS, axis, strict=True)))
    write_table(files.folder / "probe_pose.csv", poses)
    away = np.eye(4)
    away[0, 3] = 0.2
    sensor = sensors["kinect"]
    right = sensor["depth"]["color_from_depth"]
    stated = sensor | {"depth": sensor["depth"] | {"color_from_depth": away.tolist()}}
    found = {"cameras": {"color": sensor["color"], "infrared": sensor["depth"]}}
    optics = files.folder / "calibration.json"
    optics.write_text(json.dumps(found | {"color_from_infrared": right}))
    names = ("object.yaml", "template.ply", "alignment.json", "clouds.npz", "force.csv")
    inputs = {name.split(".")[0]: files.folder / name for name in names}
    inputs |= {"pose": files.folder / "probe_pose.csv"}
    params = PROBE | {"onset_force_n": 0.1, "options": full(root)["direct"]["observation"]}
    made, output = [], {"motion": "motion.npz"}
    for spec, more in ((sensor, {}), (stated, {}), (stated, {"optics": optics})):
        with_sensor = params | {"sensor": spec}
        line = execute("surface_motion", inputs=inputs | more, outputs=output, params=with_sensor)
        assert line is None
        made.append((files.folder / "motion.npz").read_bytes())
    assert made[1] != made[0]
    assert made[2] == made[0]
