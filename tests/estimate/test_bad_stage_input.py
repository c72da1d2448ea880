"""What a script ends with over input that it can't use: one line that names file and field."""

import json

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.tables import write_table
from palpate.solid.mesh import solid_mesh, write_solid
from palpate.surface.alignment import Alignment, AlignmentResidual, save_alignment
from palpate.surface.tracked import Tracked, save_tracked
from palpate.workflow.job import naming
from palpate.workflow.start import environment
from settings import full
from skfem import MeshTet

SIZE = 0.1
RADIUS = 0.00622
TOP = np.array([0.05, 0.05, SIZE])
PROBE = {"indenter": {"radius_m": RADIUS}}
SUPPORT = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3}


@pytest.fixture
def run(stage):
    """Run a stage in vain and give the line that it ends with."""

    def refused(script, *, outputs, **job):
        line = stage(script, outputs={name: f"made_{name}" for name in outputs}, **job)
        assert line
        return line

    return refused


@pytest.fixture
def cube():
    mesh = MeshTet().refined(2)
    return solid_mesh(SIZE * mesh.p.T, mesh.t.T)


@pytest.fixture
def box():
    mesh = trimesh.creation.box((SIZE, SIZE, SIZE)).subdivide()
    return mesh.apply_translation([SIZE / 2] * 3)


def describe(path, **support):
    content = {
        "template": {"unit": "m", "vertices": 50},
        "support": SUPPORT | support,
        "points": {"01": {"position_m": TOP.tolist()}},
    }
    path.write_text(yaml.safe_dump(content))
    return path


def test_a_file_is_named_once_and_for_its_own_fields():
    with pytest.raises(ValueError, match="^a.csv: force: expected more$"), naming("a.csv"):
        raise ValueError("force: expected more")
    with pytest.raises(ValueError, match="^a.csv: force"), naming("a.csv"), naming("a.csv"):
        raise ValueError("force: expected more")
    with pytest.raises(ValueError, match="^force"), naming("a.yaml", "support", "contact"):
        raise ValueError("force: expected more")


def test_jobs_use_one_thread_whatever_is_exported(monkeypatch):
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    for name in names:
        monkeypatch.setenv(name, "8")
    assert [environment("scripts")[name] for name in names] == ["1", "1", "1"]


@pytest.fixture
def kept(cube, tmp_path):
    write_solid(tmp_path / "kept.vtu", cube)
    return tmp_path / "kept.vtu"


# Contact and force.
def test_a_contact_far_from_the_solid(run, root, tmp_path, box, cube, kept):
    rest, far = np.asarray(box.vertices), TOP + [0, 0, 3 * RADIUS]
    moved = np.stack([rest, rest - [0, 0, 1e-3]])
    seen, residual = np.ones(moved.shape[:2], bool), np.zeros(2)
    tracked = Tracked(rest, box.faces, rest, moved, seen, np.eye(4), residual, far, 1)
    save_tracked(tmp_path / "tracked.npz", tracked)
    fit = {"range": {"last_frame": 1}, "samples": {"depth_m": [0.0, 1e-3]}}
    (tmp_path / "hertz.json").write_text(json.dumps(fit))
    write_forces(tmp_path / "force.csv", [0.0, 2.0])
    inputs = {
        "object": describe(tmp_path / "object.yaml"),
        "solid": kept,
        "tracked": tmp_path / "tracked.npz",
        "force": tmp_path / "force.csv",
        "fit": tmp_path / "hertz.json",
    }
    params = {"options": {}, "probe": PROBE, "solid": {}}
    line = run(
        "minimise",
        inputs=inputs,
        outputs=["result", "mismatch"],
        params=params,
        wildcards={"error": "displacement"},
    )
    assert f"{tmp_path}/object.yaml: contact: expected within 0.00622 m of the surface" in line


def write_forces(path, newtons):
    force = np.asarray(newtons, dtype=float)
    time = {"time_s": np.arange(len(force)) / 6}
    write_table(path, pd.DataFrame(time | {"fx_n": 0 * force, "fy_n": 0 * force, "fz_n": -force}))


def fitted(run, root, folder, box, depths, newtons, *, axes=("fx_n", "fy_n", "fz_n"), **options):
    """Run the Hertz fit on a press into the top of the box."""
    box.export(folder / "template.ply")
    residual = AlignmentResidual(0.0, 0.0, 0.0, 0.0, 1)
    save_alignment(folder / "alignment.json", Alignment(np.eye(4), TOP, 1, residual))
    tips = TOP + [0, 0, RADIUS] - np.outer(depths, [0, 0, 1])
    poses = dict(zip(("tip_x_m", "tip_y_m", "tip_z_m"), tips.T, strict=True))
    write_table(
        folder / "probe_pose.csv", pd.DataFrame(poses | {"raw_tip_std_along_m": 0 * tips[:, 0]})
    )
    write_forces(folder / "force.csv", newtons)
    kept = pd.read_csv(folder / "force.csv")[["time_s", *axes]]
    write_table(folder / "force.csv", kept)
    inputs = {
        "object": describe(folder / "object.yaml"),
        "template": folder / "template.ply",
        "alignment": folder / "alignment.json",
        "pose": folder / "probe_pose.csv",
        "force": folder / "force.csv",
        "clock": folder / "clock.json",
    }
    (folder / "clock.json").write_text('{"std_s": 0.02}')
    config = full(root)
    params = {"options": config["hertz"] | options, "probe": PROBE}
    params["rig"] = config["direct"]["fit"]["rig"]
    return run("hertz", inputs=inputs, outputs=["fit"], params=params)


@pytest.mark.parametrize(
    ("baseline", "depths", "found"),
    [
        (False, [-1e-3, 1e-3], "depth: expected at least 2 samples in contact, found 1"),
        (True, [-1e-3, 1e-3, 2e-3], "samples: expected more than 3, found 3"),
    ],
    ids=["modulus and contact", "and baseline"],
)
def test_fewer_samples_than_parameters(run, root, tmp_path, box, baseline, depths, found):
    newtons = [0.0, 1.0, 2.0][: len(depths)]
    line = fitted(run, root, tmp_path, box, depths, newtons, baseline=baseline)
    assert f"{tmp_path}/force.csv: {found}" in line


def test_a_press_that_begins_off_the_surface(run, root, tmp_path, box):
    depths = np.linspace(-0.02, -0.01, 5)
    line = fitted(run, root, tmp_path, box, depths, [0, 0.5, 1, 1.5, 2])
    assert f"{tmp_path}/probe_pose.csv: depth: expected the tip within 5 mm" in line


# Simulations.
@pytest.mark.parametrize(
    ("triangle", "found"),
    [
        ([0, 1, 9999], "triangle: expected three different nodes of 0 to"),
        ([0, 1, 1], "triangle: expected three different nodes of 0 to"),
        ([0, 1], "triangle: expected shape (3,), found (2,)"),
        ([0.0, 1.0, 2.0], "triangle: expected integers, found float64"),
    ],
)
def test_a_simulation_with_a_broken_triangle(run, root, tmp_path, cube, triangle, found):
    path = tmp_path / "steps.npz"
    zeros = np.zeros((2, *cube.nodes_m.shape))
    np.savez(
        path,
        nodes_m=cube.nodes_m,
        tetrahedra=cube.tetrahedra,
        triangle=np.array(triangle),
        force_n=zeros,
        displacement_m=zeros,
    )
    line = run(
        "artefact",
        inputs={"steps": path, "tracked": None},
        outputs=["result"],
        params={
            "make": "thesis.chapter3.block:make_linear_method",
            "options": {"support": SUPPORT},
        },
    )
    assert f"{path}: {found}" in line
