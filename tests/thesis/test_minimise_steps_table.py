"""The steps of the error minimisation: rows by variant and error, the true surface apart."""

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from palpate.capture.tables import write_table
from palpate.solid.mesh import solid_mesh, write_solid
from palpate.surface.tracked import Tracked, save_tracked
from skfem import MeshTet
from thesis.chapter5.minimise_steps import make_minimise_steps
from thesis.minimise.options import Minimise, Solid

SIZE, TOP = 0.1, np.array([0.05, 0.05, 0.1])
STEPS = {
    "pressure": {"force_rule": "hertz_patch"},
    "other": {"tracker": "other"},
}
ERRORS = ["force_displacement", "displacement"]


def dent(surface, depth_m):
    """Motion of a surface pressed at its top, zero at its foot."""
    away = np.linalg.norm(surface - TOP, axis=1)
    return np.outer(depth_m * np.exp(-((away / 0.04) ** 2)) * surface[:, 2] / SIZE, [0, 0, -1])


@pytest.fixture
def rows(root, tmp_path):
    grid = MeshTet().refined(2)
    write_solid(tmp_path / "solid.vtu", solid_mesh(SIZE * grid.p.T, grid.t.T))
    box = trimesh.creation.box((SIZE, SIZE, SIZE)).subdivide().subdivide()
    rest = np.asarray(box.vertices) + SIZE / 2
    plain = np.ones((2, len(rest)), bool), np.eye(4), np.zeros(2), TOP, 1
    for name, depth in (("study", 0.006), ("other", 0.005)):
        moved = np.stack([rest, rest + dent(rest, depth)])
        save_tracked(tmp_path / f"{name}.npz", Tracked(rest, box.faces, rest, moved, *plain))
    true = np.stack([rest, rest + dent(rest, 0.004)])
    np.savez(tmp_path / "truth.npz", surface_m=true, surface_faces=box.faces)
    fit = {"range": {"last_frame": 1}, "samples": {"depth_m": [0.0, 0.006]}}
    fit["study"] = {"reduced_modulus_pa": 25e3}
    (tmp_path / "hertz.json").write_text(json.dumps(fit))
    support = {"plane_point_m": [0, 0, 0], "plane_normal": [0, 0, 1], "tolerance_m": 1e-3}
    (tmp_path / "object.yaml").write_text(yaml.safe_dump({"support": support}))
    force = {"fx_n": [0.0, 0.0], "fy_n": [0.0, 0.0], "fz_n": [0.0, -2.0]}
    write_table(tmp_path / "force.csv", pd.DataFrame(force))
    inputs = {"solid": "solid.vtu", "force": "force.csv", "fit": "hertz.json"}
    inputs |= {"object": "object.yaml", "truth": "truth.npz"}
    files = SimpleNamespace(
        tracked=[str(tmp_path / f"{name}.npz") for name in ("study", "other")],
        **{name: str(tmp_path / file) for name, file in inputs.items()},
    )
    params = SimpleNamespace(
        probe={"indenter": {"radius_m": 0.00622}},
        solid=Solid(refine_edge_m=0.02).written(),
        options=Minimise().written(),
        steps=STEPS,
        tracker="study",
        trackers=["study", "other"],
        errors=ERRORS,
    )
    return make_minimise_steps(files, params)["result"]


def test_each_variant_has_a_row_for_each_error(rows):
    kinds = [row["kind"] for row in rows[:: len(ERRORS)]]
    assert kinds == ["as configured"] + 2 * ["added"] + 2 * ["alone"] + 2 * ["true surface"]
    assert [row["error"] for row in rows[:2]] == ERRORS
    assert all(row["reduced_model_error_bound"] < 1e-5 for row in rows)
    ours = [row for row in rows if row["error"] == ERRORS[1]]
    moduli = {(row["kind"], row["step"]): row["youngs_modulus_pa"] for row in ours}
    assert moduli["added", "pressure"] == moduli["alone", "pressure"]
    # The less a surface moves under the same force, the stiffer it is taken to be.
    assert (
        moduli["as configured", "as configured"]
        < moduli["alone", "other"]
        < moduli["true surface", "as configured"]
    )
