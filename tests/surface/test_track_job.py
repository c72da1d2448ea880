"""The job that tracks a capture: killed and run again it leaves the bytes of an undisturbed run."""

import json
import signal
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.files import PART
from palpate.capture.tables import write_table
from palpate.solid.mesh import solid_mesh, write_solid
from palpate.surface.alignment import Alignment, AlignmentResidual, save_alignment
from palpate.surface.pose import to_camera
from palpate.vision.clouds import Cloud, save_clouds
from palpate.vision.force import FORCE
from palpate.vision.probe import TIP
from settings import full
from skfem import MeshTet
from thesis.tracker.options import options_of

PLANE = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 0.004}
SUPPORT = PLANE | {"contact": "resting"}
BALL_M = 0.05
TOP_M = np.array([0.0, 0.0, 2 * BALL_M])
RADIUS_M = 0.00622
DEPTHS_M = (-0.001, 0.001, 0.003)
OUTPUTS = ("tracked.npz", "tracked.vtkhdf", "tracked.json")

# Runs the script as Snakemake would; a second argument names where the job is killed.
DRIVER = """
import json, os, runpy, signal, sys
from pathlib import Path
from types import SimpleNamespace
import palpate.surface.series as series
import thesis.tracker.capture as capture

def killed(*arguments, **options):
    if options:
        Path(arguments[0]).write_bytes(b"half a file")
    os.kill(os.getpid(), signal.SIGKILL)

job = json.loads(Path(sys.argv[1]).read_text())
if sys.argv[2:] == ["tracking"]:
    capture.track_capture = killed
elif sys.argv[2:] == ["writing"]:
    series.save_series = killed

class Wildcards(list):
    tracker = job.pop("tracker")

class Named(SimpleNamespace):
    def __iter__(self):
        return iter(vars(self).values())

    def get(self, name, default=None):
        return vars(self).get(name, default)

job = {name: Named(**part) if isinstance(part, dict) else part
       for name, part in job.items()}
snakemake = SimpleNamespace(**job, wildcards=Wildcards([Wildcards.tracker]))
runpy.run_path(job["script"], init_globals={"snakemake": snakemake})
"""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A small capture as the stages before leave it: a loose ball whose top is pressed."""
    folder, rng = tmp_path_factory.mktemp("capture"), np.random.default_rng(0)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=BALL_M)
    ball.apply_translation([0, 0, BALL_M])
    ball.export(folder / "template.ply")
    spec = {"template": {"unit": "m"}, "support": SUPPORT}
    (folder / "object.yaml").write_text(yaml.safe_dump(spec))
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = 0.6
    residual = AlignmentResidual(0.0, 0.0, 0.0, 0.0, 0)
    save_alignment(folder / "alignment.json", Alignment(pose, TOP_M, 1, residual))
    mesh = MeshTet.init_ball(2)
    write_solid(folder / "solid.vtu", solid_mesh(BALL_M * (mesh.p.T + [0, 0, 1]), mesh.t.T))
    clouds = [_cloud(ball, pose, depth, rng) for depth in DEPTHS_M]
    save_clouds(folder / "clouds.npz", clouds)
    up = np.array([0.0, 0.0, 1.0])
    tips = to_camera(pose, np.array([TOP_M + up * (RADIUS_M - depth) for depth in DEPTHS_M]))
    table = pd.DataFrame(tips, columns=TIP).assign(time_s=np.arange(len(tips)) / 6)
    write_table(folder / "pose.csv", table)
    write_table(folder / "force.csv", pd.DataFrame(0 * tips, columns=FORCE))
    names = {"object": "object.yaml", "template": "template.ply", "alignment": "alignment.json"}
    names |= {"solid": "solid.vtu", "clouds": "clouds.npz", "pose": "pose.csv"}
    return {key: str(folder / name) for key, name in (names | {"force": "force.csv"}).items()}


def _cloud(ball, pose, depth, rng):
    """Points of the upper half, with a dent under the sphere."""
    points, faces = trimesh.sample.sample_surface(ball, 6000, seed=int(rng.integers(1 << 30)))
    normals = ball.face_normals[faces]
    seen = normals[:, 2] > 0
    points, normals = points[seen], normals[seen]
    away = np.linalg.norm(points[:, :2], axis=1)
    points[:, 2] -= max(depth, 0) / (1 + (away / 0.006) ** 2)
    return Cloud(to_camera(pose, points), normals @ pose[:3, :3].T)


@pytest.fixture(scope="module", params=["study", "elastic"])
def tracker(request):
    """Name of a tracker."""
    return request.param


@pytest.fixture(scope="module")
def start(root, tmp_path_factory, inputs, tracker):
    """Run the job into a folder, to its end or until it is killed."""
    tracking = full(root)["tracking"]
    tmp_path = tmp_path_factory.mktemp("job")
    driver = tmp_path / "driver.py"
    driver.write_text(DRIVER)

    def run(folder, *killed):
        outputs = ("tracked", "series", "description")
        job = {
            "rule": "track",
            "tracker": tracker,
            "script": str(root / "workflow/scripts/stages/track.py"),
            "log": str(tmp_path / f"{folder}.log"),
            "input": inputs,
            "output": {
                k: str(tmp_path / folder / v) for k, v in zip(outputs, OUTPUTS, strict=True)
            },
            "params": {
                "probe": {"indenter": {"radius_m": RADIUS_M}},
                "options": options_of(tracking, tracker, "foam_ball"),
            },
        }
        (tmp_path / "job.json").write_text(json.dumps(job))
        command = [sys.executable, str(driver), str(tmp_path / "job.json"), *killed]
        scripts = str(root / "workflow/scripts")
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, env={"PYTHONPATH": scripts}
        )
        return done, tmp_path / folder

    return run


@pytest.fixture(scope="module")
def whole(start):
    """Folder of an undisturbed run."""
    done, folder = start("whole")
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in folder.iterdir()) == sorted(OUTPUTS)
    return folder


@pytest.mark.long
def test_a_killed_job_runs_again_to_the_same_bytes(start, whole, tracker):
    # Nothing that a kill meets depends on the tracker.
    for where in ("tracking", "writing") if tracker == "study" else ():
        done, broken = start("broken", where)
        assert done.returncode == -signal.SIGKILL
        assert not any((broken / name).exists() for name in OUTPUTS)
        # The second kill comes with half a file written.
        assert where == "tracking" or list(broken.iterdir())
    done, broken = start("broken")
    assert done.returncode == 0, done.stderr
    # What the killed writer left goes when the next run begins (palpate/workflow/start.py).
    left = sorted(path.name for path in broken.iterdir() if not path.name.startswith(PART))
    assert left == sorted(OUTPUTS)
    for name in OUTPUTS:
        assert (broken / name).read_bytes() == (whole / name).read_bytes(), name


def test_the_three_files_tell_of_the_same_surface(whole, tracker):
    described = json.loads((whole / "tracked.json").read_text())
    with np.load(whole / "tracked.npz", allow_pickle=False) as data:
        assert described["vertices"] == len(data["template_m"])
        assert described["observed_vertices"] == data["observed"].sum(axis=1).tolist()
        assert described["residual_rms_m"] == data["residual_m"].tolist()
    assert described["frames"] == len(DEPTHS_M)
    assert described["tracker"] == described["kind"] == tracker
    assert (described["prior"] is None) == (tracker == "study")
