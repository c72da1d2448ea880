"""Steps of the error minimisation: variants, their minima, and the table against the truth."""

import numpy as np
import pytest
from palpate.surface.tracked import Tracked
from scipy.spatial.transform import Rotation
from thesis.chapter5.minimise_steps import true_surface, variants
from thesis.chapter5.steps_table import relaxed_modulus, steps_summary, steps_table

STEPS = {"load": {"force_rule": "hertz_patch"}, "other": {"tracker": "other"}}
MATERIAL = {
    "youngs_modulus_pa": 2e4,
    "poisson_ratio": 0.3,
    "reduced_modulus_pa": 2e4 / 0.91,
    "relaxation": {"fractions": [0.1, 0.2], "times_s": [0.5, 4.0]},
}


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
    with pytest.raises(ValueError, match="steps: expected at least one, found none"):
        variants({})


def result(variant, E):
    found = {"step": variant.step, "kind": variant.kind, "changes": variant.changes, "nodes": 9}
    found |= {"surface": "study", "error": "displacement", "youngs_modulus_pa": E, "error_m": 1e-4}
    found |= {"poisson_ratio": 0.4, "reduced_modulus_pa": E / 0.84, "at_bound": E > 2e4}
    return found | {
        "poisson_ratio_verdict": "bounded", "left_out_nodes": 0, "reduced_model_error": 1e-7
    }  # fmt: skip


def test_table_and_its_medians_stand_beside_the_truth():
    relaxed = 2e4 * (1 - 0.1 * (1 - np.exp(-2)) - 0.2 * (1 - np.exp(-0.25)))
    assert relaxed_modulus(MATERIAL, 1.0) == pytest.approx(relaxed)
    assert relaxed_modulus(MATERIAL | {"relaxation": None}, 1.0) == 2e4
    captures = [
        {"object": "pad", "sensor": "kinect", "capture": c, "point": c, "provenance": "simulated"}
        for c in ("01", "02")
    ]
    results = [[result(variant, E) for variant in variants(STEPS)] for E in (1.8e4, 2.2e4)]
    table = steps_table(captures, results, {"pad": MATERIAL})
    row = table.iloc[0]
    assert (len(table), row["youngs_modulus_ratio"]) == (2 * 7, 0.9)
    assert row["relaxed_modulus_ratio"] == pytest.approx(1.8e4 / relaxed, abs=1e-4)
    assert row["poisson_ratio_error"] == pytest.approx(0.1)
    short = steps_summary(table)
    assert len(short) == 7 and (short["captures"] == 2).all()
    assert (short["captures_at_bound"] == 1).all()
    assert short["youngs_modulus_ratio"].to_numpy() == pytest.approx(1.0)
    assert short["poisson_ratio_largest_error"].to_numpy() == pytest.approx(0.1)
    largest = short["relaxed_modulus_largest_deviation"].iloc[0]
    assert largest == pytest.approx(2.2e4 / relaxed - 1, abs=1e-4)


def test_the_true_surface_stands_where_the_object_does():
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec([0.2, 0.4, -1]).as_matrix(), [0.1, 0.2, 0.9]
    surface = np.random.default_rng(0).normal(size=(2, 5, 3)).astype(np.float32)
    rest, faces, observed = np.zeros((4, 3)), np.array([[0, 1, 2]]), np.zeros((2, 4), bool)
    more = np.zeros(2), np.ones(3), 1, '{"poisson_ratio": 0.3}'
    tracked = Tracked(rest, faces, rest, np.zeros((2, 4, 3)), observed, pose, *more)
    truth = {"surface_m": surface, "surface_faces": np.array([[0, 1, 4]])}
    found = true_surface(tracked, truth)
    back = (found.vertices_m - pose[:3, 3]) @ pose[:3, :3]
    assert np.allclose(back, surface, atol=1e-6)
    assert found.prior == "" and np.array_equal(found.contact_point_m, np.ones(3))
    with pytest.raises(ValueError, match="surface_m: expected 2 frames, found 1"):
        true_surface(tracked, truth | {"surface_m": surface[:1]})
