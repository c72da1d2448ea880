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


class Files:
    """A capture's files before alignment and tracking, to be spoilt one at a time."""

    def __init__(self, folder):
        mesh = trimesh.creation.box((0.12, 0.08, 0.03)).apply_translation([0, 0, 0.015])
        self.folder, self.shape = folder, mesh.subdivide().subdivide().subdivide()
        self.shape.export(folder / "template.ply")
        self.clouds([self.seen()] * FRAMES)
        self.tips(HEIGHTS)
        self.forces([0.0, 0.01, 0.5, 1.0])
        support = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3}
        content = {"template": {"unit": "m", "vertices": 50}, "support": support}
        content |= {"points": {"01": {"position_m": POINT.tolist()}}}
        (folder / "object.yaml").write_text(yaml.safe_dump(content))
        plane = {"normal": [0, 0, -1.0], "offset_m": 0.6}
        (folder / "plane.json").write_text(json.dumps(plane))
        save_alignment(folder / "alignment.json", Alignment(POSE, POINT, 2, 1e-4))
        mesh = MeshTet().refined(1)
        write_solid(folder / "solid.vtu", solid_mesh(0.03 * mesh.p.T, mesh.t.T))

    def seen(self):
        """What the camera sees of the object, with noise: points and normals."""
        points, faces = sample_surface(self.shape, 6000, seed=3)
        normals = self.shape.face_normals[faces]
        up = normals[:, 2] > 0.1
        points = points[up] + np.random.default_rng(0).normal(0, NOISE_M, points[up].shape)
        return points @ POSE[:3, :3].T + POSE[:3, 3], normals[up] @ POSE[:3, :3].T

    def clouds(self, clouds):
        save_clouds(self.folder / "clouds.npz", [Cloud(*cloud) for cloud in clouds])

    def tips(self, heights):
        tips = POINT + np.outer(np.asarray(heights) + RADIUS, [0, 0, 1])
        tips = tips @ POSE[:3, :3].T + POSE[:3, 3]
        table = pd.DataFrame(tips, columns=["tip_x_m", "tip_y_m", "tip_z_m"])
        table.insert(0, "time_s", np.arange(len(tips)) / 6)
        write_table(self.folder / "probe_pose.csv", table)

    def forces(self, newtons):
        table = pd.DataFrame({"fx_n": 0.0, "fy_n": 0.0, "fz_n": newtons})
        write_table(self.folder / "force.csv", table)


@pytest.fixture
def files(tmp_path):
    """Inputs of align and track that fit each other."""
    return Files(tmp_path)


@pytest.fixture
def execute(stage):
    """Run a stage of a capture."""
    wildcards = {"object": "hill", "sensor": "kinect", "capture": "01", "tracker": "study"}
    return partial(stage, wildcards=wildcards)


@pytest.fixture
def run(execute, files, root):
    """Run align or track on the files."""
    options = full(root)["tracking"]
    names = {"object": "object.yaml", "template": "template.ply", "pose": "probe_pose.csv"}
    names |= {"force": "force.csv"}
    aligning = {"options": options["alignment"], "onset_force_n": 0.1}
    tracking = {"options": options["trackers"]["study"]}
    of_track = {"clouds": "clouds.npz", "solid": "solid.vtu", "alignment": "alignment.json"}
    own = {
        "align": ({"cloud": "clouds.npz", "plane": "plane.json"}, {"alignment": "made.json"}),
        "track": (of_track, TRACKED),
    }

    def done(rule):
        more, outputs = own[rule]
        inputs = {name: files.folder / file for name, file in (names | more).items()}
        params = PROBE | (tracking if rule == "track" else aligning)
        return execute(rule, inputs=inputs, outputs=outputs, params=params)

    return done


def test_what_fits_is_tracked_to_the_same_bytes_each_time(files, run):
    runs = []
    for _ in range(2):
        assert run("track") is None
        made = [files.folder / TRACKED["tracked"], files.folder / TRACKED["description"]]
        made += sorted((files.folder / TRACKED["series"]).iterdir())
        runs.append([file.read_bytes() for file in made])
    assert runs[0] == runs[1]


def test_what_does_not_fit_is_one_line(files, run):
    seen = files.seen()
    few, fits = tuple(part[:7] for part in seen), files.folder / "probe_pose.csv"
    fitting = fits.read_bytes()
    for change, rule, line in (
        (lambda: files.tips(HEIGHTS[:3]), "align", "tip_x_m: expected 4 frames, found 3"),
        (lambda: files.tips(HEIGHTS + 0.03), "track", "tip: expected within 12.4 mm"),
        (lambda: None, "align", "tip: expected at most 5 mm from the template when the force"),
    ):
        change()
        assert f"{fits}: {line}" in run(rule)
    fits.write_bytes(fitting)
    files.forces([0.0, 0.01, 0.5, 1.0, 1.0])
    assert f"{files.folder}/force.csv: fx_n: expected 4 frames, found 5" in run("track")
    files.clouds([seen, seen, few, seen])
    assert "clouds.npz: frame 2: cloud: expected at least 30 points, found 7" in run("track")


def test_eyes_are_where_the_calibration_has_them(files, execute, root, sensors):
    """As for the clouds: a file's stated optics don't hold where a calibration was asked for."""
    heights = np.array([0.012, 0.010, 0.008, 0.006, -0.001, -0.004])
    files.tips(heights)
    files.forces([0.0, 0.0, 0.0, 0.0, 0.5, 1.0])
    (points, normals), noise = files.seen(), np.random.default_rng(1).normal(0, 1e-4, (6, 1, 3))
    files.clouds([(points + one, normals) for one in noise])
    file, axis = files.folder / "probe_pose.csv", POSE[:3, :3] @ [0.0, 0.8, -0.6]
    write_table(file, pd.read_csv(file).assign(**dict(zip(AXIS, axis, strict=True))))
    sensor, away = sensors["kinect"], np.eye(4)
    away[0, 3] = 0.2
    stated = sensor | {"depth": sensor["depth"] | {"color_from_depth": away.tolist()}}
    found = {"cameras": {"color": sensor["color"], "infrared": sensor["depth"]}}
    found["color_from_infrared"] = sensor["depth"]["color_from_depth"]
    optics = files.folder / "calibration.json"
    optics.write_text(json.dumps(found))
    names = ("object.yaml", "template.ply", "alignment.json", "clouds.npz", "force.csv")
    inputs = {name.split(".")[0]: files.folder / name for name in names} | {"pose": file}
    params = PROBE | {"onset_force_n": 0.1, "options": full(root)["direct"]["observation"]}
    made = []
    for spec, more in ((sensor, {}), (stated, {}), (stated, {"optics": optics})):
        given = {"inputs": inputs | more, "params": params | {"sensor": spec}}
        assert execute("surface_motion", **given, outputs={"motion": "motion.npz"}) is None
        made.append((files.folder / "motion.npz").read_bytes())
    assert made[1] != made[0] == made[2]
