"""Steps of the error minimisation: variants, their minima, and the table against the truth."""

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
from scipy.spatial.transform import Rotation
from skfem import MeshTet
from thesis.chapter5.minimise_steps import make_minimise_steps, true_surface, variants
from thesis.chapter5.steps_figure import minimise_steps
from thesis.chapter5.steps_table import relaxed_modulus, steps_summary, steps_table
from thesis.minimise.options import Minimise, Solid

SIZE, TOP = 0.1, np.array([0.05, 0.05, 0.1])
STEPS = {"load": {"force_rule": "hertz_patch"}, "other": {"tracker": "other"}}
ERRORS = ["force_displacement", "displacement"]
MATERIAL = {
    "youngs_modulus_pa": 2e4,
    "poisson_ratio": 0.3,
    "reduced_modulus_pa": 2e4 / 0.91,
    "relaxation": {"fractions": [0.1, 0.2], "times_s": [0.5, 4.0]},
}


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
    assert all(row["reduced_model_error"] < 1e-5 for row in rows)
    ours = [row for row in rows if row["error"] == ERRORS[1]]
    moduli = {(row["kind"], row["step"]): row["youngs_modulus_pa"] for row in ours}
    assert moduli["added", "load"] == moduli["alone", "load"]
    # The less a surface moves under the same force, the stiffer it is taken to be.
    assert (
        moduli["as configured", "as configured"]
        < moduli["alone", "other"]
        < moduli["true surface", "as configured"]
    )


def result(variant, error, E, nu):
    found = {"step": variant.step, "kind": variant.kind, "changes": variant.changes}
    found |= {"surface": "study", "error": error, "youngs_modulus_pa": E, "poisson_ratio": nu}
    rest = {"reduced_modulus_pa": E / (1 - nu**2), "error_m": 1e-4, "at_bound": False}
    counts = {"poisson_ratio_verdict": "bounded", "nodes": 9, "left_out_nodes": 0}
    return found | rest | counts | {"reduced_model_error": 1e-7}


@pytest.fixture
def table():
    captures = [
        {"object": "pad", "sensor": "kinect", "capture": c, "point": c, "provenance": "simulated"}
        for c in ("01", "02")
    ]
    results = [
        [result(v, e, E, 0.4) for v in variants(STEPS) for e in ("displacement", "both")]
        for E in (1.8e4, 2.2e4)
    ]
    return steps_table(captures, results, {"pad": MATERIAL})


def test_variants_change_one_thing_at_a_time():
    load, both = STEPS["load"], STEPS["load"] | STEPS["other"]
    assert [(v.step, v.kind, v.changes) for v in variants(STEPS)] == [
        ("as configured", "as configured", {}),
        ("load", "added", load),
        ("other", "added", both),
        ("load", "alone", load),
        ("other", "alone", STEPS["other"]),
        ("as configured", "true surface", {}),
        ("load", "true surface", load),
    ]


def test_relaxed_modulus():
    expected = 2e4 * (1 - 0.1 * (1 - np.exp(-2)) - 0.2 * (1 - np.exp(-0.25)))
    assert relaxed_modulus(MATERIAL, 1.0) == pytest.approx(expected)
    assert relaxed_modulus(MATERIAL, 0.0) == 2e4
    assert relaxed_modulus(MATERIAL | {"relaxation": None}, 1.0) == 2e4


def test_table_stands_beside_the_truth(table):
    assert len(table) == 2 * 7 * 2
    row = table.iloc[0]
    assert row["youngs_modulus_ratio"] == 0.9
    relaxed = relaxed_modulus(MATERIAL, 1.0)
    assert row["relaxed_modulus_ratio"] == pytest.approx(1.8e4 / relaxed, abs=1e-4)
    assert row["poisson_ratio_error"] == pytest.approx(0.1)
    assert row["true_relaxed_modulus_pa"] == relaxed
    assert table["changes"].iloc[4] == "force_rule=hertz_patch; tracker=other"
    assert table["changes"].iloc[0] == "none"


def test_summary_takes_medians_over_captures(table):
    short = steps_summary(table)
    assert len(short) == 7 * 2
    assert (short["captures"] == 2).all() and (short["captures_at_bound"] == 0).all()
    at_bound = steps_summary(table.assign(at_bound=table["capture"] == "01"))
    assert (at_bound["captures_at_bound"] == 1).all()
    assert short["youngs_modulus_ratio"].to_numpy() == pytest.approx(1.0)
    assert short["poisson_ratio_largest_error"].to_numpy() == pytest.approx(0.1)
    relaxed = relaxed_modulus(MATERIAL, 1.0)
    assert short["relaxed_modulus_largest_deviation"].iloc[0] == pytest.approx(
        2.2e4 / relaxed - 1, abs=1e-4
    )


def test_a_figure_needs_rows_of_its_error(table):
    minimise_steps(table, "displacement")
    with pytest.raises(ValueError, match="error: expected one of the table's, found none"):
        minimise_steps(table, "none")


def test_the_true_surface_stands_where_the_object_does():
    rng = np.random.default_rng(0)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec([0.2, 0.4, -1]).as_matrix(), [0.1, 0.2, 0.9]
    surface = rng.normal(size=(2, 5, 3)).astype(np.float32)
    tracked = Tracked(
        template_m=np.zeros((4, 3)),
        faces=np.array([[0, 1, 2]]),
        rest_m=np.zeros((4, 3)),
        vertices_m=np.zeros((2, 4, 3)),
        observed=np.zeros((2, 4), bool),
        camera_from_object=pose,
        residual_m=np.zeros(2),
        contact_point_m=np.ones(3),
        contact_frame=1,
        prior='{"poisson_ratio": 0.3}',
    )
    truth = {"surface_m": surface, "surface_faces": np.array([[0, 1, 4]])}
    found = true_surface(tracked, truth)
    back = (found.vertices_m - pose[:3, 3]) @ pose[:3, :3]
    assert np.allclose(back, surface, atol=1e-6)
    assert found.observed.shape == (2, 5) and found.prior == ""
    assert np.array_equal(found.contact_point_m, np.ones(3))
    with pytest.raises(ValueError, match="surface_m: expected 2 frames, found 1"):
        true_surface(tracked, truth | {"surface_m": surface[:1]})


def test_no_steps():
    with pytest.raises(ValueError, match="steps: expected at least one, found none"):
        variants({})
