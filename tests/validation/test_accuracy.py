"""Results against a known truth: moduli, Hertz models, stages, sensors and the lab's fidelity."""

import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import trimesh
from palpate.modulus import LABELS, Modulus
from palpate.report import tables
from palpate.report.estimate_rows import row, summary
from validation import captures, fidelity, hertz
from validation.estimates import accuracy_table, coverage_table, make_accuracy
from validation.measured import relaxed_part, truth_of
from validation.sensors import workspace_rows

CAPTURE = {"object": "foam", "sensor": "kinect", "capture": "01", "point": "01"}
CAPTURE |= {"provenance": "simulated"}
MATERIAL = {
    "youngs_modulus_pa": 20000.0,
    "poisson_ratio": 0.3,
    "reduced_modulus_pa": 20000 / 0.91,
    "relaxation": {"fractions": [0.1], "times_s": [1.0]},
}


def estimate(method, E, nu):
    half = {"Pa": 1000.0, "1": 0.05}
    values = dict.fromkeys(LABELS, E) | {"poisson_ratio": nu}
    moduli = {}
    for name, value in values.items():
        unit = "Pa" if name.endswith("_pa") else "1"
        ends = value - half[unit], value + half[unit]
        moduli[name] = Modulus(value, *ends, "identified", unit)
    return row(CAPTURE, method, moduli)


def test_truth_after_a_second():
    truth = truth_of(MATERIAL)
    left = 1 - 0.1 * 0.632121
    assert truth["youngs_modulus_pa"] == 20000.0
    assert truth["youngs_modulus_1s_pa"] == pytest.approx(20000 * left, rel=1e-6)
    assert truth["effective_reduced_modulus_pa"] == pytest.approx(20000 / 0.91 * left, rel=1e-6)
    assert truth_of(MATERIAL | {"relaxation": None})["youngs_modulus_1s_pa"] == 20000.0
    assert relaxed_part(MATERIAL) == pytest.approx(0.9)
    foam = truth_of(MATERIAL | {"law": "blatz_ko"})
    assert pd.isna(foam["effective_reduced_modulus_pa"])
    assert foam["reduced_modulus_pa"] == truth["reduced_modulus_pa"]
    assert np.isnan([*truth_of(MATERIAL | {"skin": {}}).values()]).all()


def test_errors_and_coverage():
    star = {"reduced_modulus_pa": Modulus(21000.0, None, None, None, "Pa")}
    rows = [estimate("direct", 22000.0, 0.4), estimate("direct_joint", 20500.0, 0.31)]
    table = summary([*rows, row(CAPTURE, "hertz", star)])
    found = accuracy_table(table, {"foam": MATERIAL}).set_index("method")
    assert found.loc["direct", "youngs_modulus_error"] == pytest.approx(0.1)
    assert found.loc["direct", "poisson_ratio_error"] == pytest.approx(0.1)
    assert not found.loc["direct", "youngs_modulus_covered"]
    assert found.loc["direct_joint", "youngs_modulus_covered"]
    assert pd.isna(found.loc["hertz", "reduced_modulus_covered"])
    other = accuracy_table(table, {"foam": MATERIAL | {"law": "blatz_ko"}})
    assert other["effective_reduced_modulus_covered"].isna().all()
    short = coverage_table(table, {"foam": MATERIAL})
    assert short["object"].tolist() == ["foam"] * 3 + ["all"] * 6
    short = short.set_index(["object", "sensor", "method"])
    assert short.loc[("all", "all", "direct"), "youngs_modulus_coverage"] == 0.0
    assert short.loc[("all", "kinect", "direct"), "youngs_modulus_rms_error"] == pytest.approx(0.1)
    assert short.loc[("all", "all", "direct_joint"), "poisson_ratio_coverage"] == 1.0
    assert short.loc[("foam", "kinect", "direct"), "poisson_ratio_identified"] == 1.0
    assert pd.isna(short.loc[("foam", "kinect", "hertz"), "poisson_ratio_median_error"])


def test_an_interval_without_an_upper_end(tmp_path):
    star = {"reduced_modulus_pa": Modulus(21000.0, 20000.0, None, "bounded", "Pa")}
    files = tmp_path / "foam" / "material.json", tmp_path / "summary.csv"
    files[0].parent.mkdir()
    files[0].write_text(json.dumps(MATERIAL))
    summary([row(CAPTURE, "direct", star)]).to_csv(files[1], index=False)
    made = make_accuracy(SimpleNamespace(materials=[str(files[0])], summary=str(files[1])), None)
    assert "21.0 (20.0 or more) ✓" in made["md"] and made["csv"]["reduced_modulus_covered"].all()


def model(indenter, contact, modulus, half_width):
    interval = [modulus - half_width, modulus + half_width]
    return {"indenter": indenter, "support": "half_space", "contact": contact,
            "relaxation": "none", "reduced_modulus_pa": modulus,
            "reduced_modulus_interval_pa": interval}  # fmt: skip


def fit(modulus):
    """The paraboloid misses the truth of 25 kPa in its interval where it is off by 500 Pa."""
    models = [model("parabola", "known", modulus, 500), model("sneddon", "free", modulus, 5000)]
    return {"models": models, "recommended": models[1]}


def test_hertz_models_against_a_known_truth():
    shown = [CAPTURE | {"capture": name} for name in ("01", "02", "03")]
    terms = {"fractions": [0.08, 0.07], "times_s": [0.3, 3.0]}
    material = {"reduced_modulus_pa": 25000.0, "relaxation": terms}
    fits = [fit(value) for value in (25000, 25400, 27500)]
    table = hertz.accuracy_table(shown, fits, {"foam": material})
    assert len(table) == 6
    assert table["true_relaxed_reduced_modulus_pa"].unique() == pytest.approx([21250])
    short = hertz.accuracy_summary(table).set_index("indenter")
    assert short.loc["parabola", "median_ratio"] == pytest.approx(25400 / 25000)
    assert short.loc["parabola", "share_of_intervals_that_cover"] == pytest.approx(2 / 3, abs=1e-3)
    assert short.loc["sneddon", "share_of_intervals_that_cover"] == 1
    assert short.loc["recommended", "captures"] == 3
    spread = np.std([1, 1.016, 1.1], ddof=1)
    assert short.loc["recommended", "ratio_standard_deviation"] == pytest.approx(spread, abs=1e-4)


def test_a_model_with_relaxation_is_judged_after_a_while_too():
    """The modulus of a term of 0.2 at 1 s is 1 - 0.2 (1 - 1/e) of itself after 1 s."""
    left = 1 - 0.2 * (1 - np.exp(-1))
    material = {"reduced_modulus_pa": 25000.0, "relaxation": {"fractions": [0.2], "times_s": [1.0]}}
    known, half_width = fit(25000), 500.0
    later = {
        "relaxation": "prony",
        "later_s": 1.0,
        "later_reduced_modulus_pa": 25000 * left + 2 * half_width,
        "later_reduced_modulus_interval_pa": [25000 * left + half_width, 25000.0],
    }
    known["models"].append(model("sneddon", "weighted", 24000, half_width) | later)
    known["recommended"] = known["models"][-1]
    table = hertz.accuracy_table([CAPTURE], [known], {"foam": material})
    assert table["recommended"].tolist() == [False, False, True]
    assert table["later_ratio"].tolist()[:2] == pytest.approx([np.nan] * 2, nan_ok=True)
    best = hertz.accuracy_summary(table).iloc[-1]
    assert best["relaxation"] == "recommended"
    assert best["median_ratio"] == pytest.approx(24 / 25)
    assert best["median_later_ratio"] == pytest.approx(1 + 1000 / (25000 * left), abs=1e-4)
    assert best["share_of_later_intervals_that_cover"] == 0


@pytest.fixture
def results():
    """Of a capture whose tip is 0.5 mm off, whose force 5 %, whose search ended at a bound."""
    minimum = {"youngs_modulus_pa": 1e8, "poisson_ratio": 0.0, "reduced_modulus_pa": 1e8}
    turned = np.tile([0, np.sin(0.02), -np.cos(0.02)], (4, 1))
    turned[1] = [0, np.sin(0.5), -np.cos(0.5)]
    surface = trimesh.creation.icosphere(2, 0.03)
    cloud = type("Cloud", (), {"points_m": surface.vertices})
    still = np.broadcast_to(surface.vertices, (4, *surface.vertices.shape))
    tracked = type("Tracked", (), {
        "template_m": surface.vertices, "vertices_m": still, "contact_point_m": surface.vertices[0],
        "observed": np.ones(still.shape[:2], bool)})  # fmt: skip
    return {
        "axis": turned,
        "tip_m": np.tile([3e-4, 4e-4, 0], (4, 1)),
        "raw_tip_m": np.zeros((4, 3)),
        "force_n": np.tile([0, 0, -2.1], (4, 1)),
        "clock": {"offset_s": 0.012, "std_s": 0.001},
        "mask": np.ones((4, 2, 8), bool),
        "clouds": [cloud] * 4,
        "tracked": tracked,
        "hertz": {"range": {"last_frame": 3}}
        | {key: {"reduced_modulus_pa": 20000.0} for key in ("study", "free_contact")},
        "minima": {"displacement": minimum | {"at_bound": True}},
    }


def test_accuracy_of_a_known_error(results):
    down = np.tile([0, 0, -1.0], (4, 1))
    surface = trimesh.creation.icosphere(2, 0.03)
    truth = {
        "tip_m": np.zeros((4, 3)),
        "force_n": 2 * down,
        "axis": down,
        "clock_offset_s": 0.01,
        "mask_shape": (4, 2, 8),
        "mask": np.packbits(np.ones((4, 2, 8), bool), axis=-1),
        "camera_from_object": np.eye(4),
        "surface_rest_m": surface.vertices,
        "surface_faces": surface.faces,
        "surface_m": np.broadcast_to(surface.vertices, (4, *surface.vertices.shape)),
    }
    table = pd.DataFrame(captures.capture_accuracy(truth, MATERIAL, results))
    found = table.set_index("quantity")["value"]
    assert found["tip_position_rms"] == pytest.approx(0.5)
    assert found["force_rms"] == pytest.approx(0.1)
    assert found["force_magnitude_rms_of_peak"] == pytest.approx(5)
    assert found["force_direction_mean"] == pytest.approx(0, abs=1e-4)
    assert found["axis_direction_max"] == pytest.approx(np.degrees(0.5))
    assert found["flipped_frames"] == 1
    assert found["clock_offset"] == pytest.approx(12)
    assert found["mask_intersection_over_union_min"] == 1
    assert found[["cloud_rms", "surface_all_mean"]].max() < 1e-3
    text = tables.to_markdown(table, title="", notes=[])
    assert text.count("(at a bound)") == 3 and "| 100000000 (at a bound) |" in text


def test_errors_over_the_workspace():
    place = {"mean_x_m": 0.1, "mean_y_m": 0.0, "mean_z_m": 0.7, "farthest_m": 0.003}
    place |= {"frames": 100, "found": 100, "std_angle_rad": 1e-3}
    place |= {f"std_{axis}_m": 1e-5 for axis in "xyz"}
    kinds = {"method": "corners", "threshold_px": 0.45}, {"method": "photometric"}
    table = pd.DataFrame([place | kind | {"point": p} for p in ("01", "02") for kind in kinds])
    tips = np.array([[0.1, 0.0, 0.7], [0.1, 0.001, 0.7]])
    found = {r["quantity"]: r["value"] for r in workspace_rows(table, tips, target_mm=1)}
    assert found["workspace_refined_tip_rms"] == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert found["workspace_refined_tip_worst_point"] == pytest.approx(1.0)
    assert found["workspace_refined_worst_frame_at_most"] == pytest.approx(4.0)


def test_a_planes_residual_is_its_noise():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.4, 0.4, (2, 20_000))
    points = np.column_stack([x, y, 0.9 + 0.1 * x - 0.05 * y + 0.001 * rng.standard_normal(x.size)])
    points[:40, 2] += 0.05
    depth, residual = fidelity.plane_residual(points)
    assert depth == pytest.approx(0.9, abs=2e-3)
    assert residual == pytest.approx(0.001 / np.sqrt(1 + 0.1**2 + 0.05**2), rel=0.03)
    flat = np.column_stack([x, y, np.full(x.size, 0.6)])
    assert fidelity.plane_residual(flat) == pytest.approx((0.6, 0.0))


def test_disparity_noise_is_recovered_from_planes(sensors):
    sensor, depth = sensors["bumblebee"], np.array([0.5, 0.7, 0.9])
    residual = fidelity.stereo_noise_m(depth, sensor, disparity_std_px=0.08)
    planes = pd.DataFrame({"depth_m": depth, "residual_m": residual})
    assert fidelity.disparity_std_px(planes, sensor) == pytest.approx(0.08)
    rows = fidelity.plane_rows(planes, sensor)
    assert [row["value"] for row in rows] == pytest.approx([row["reference_value"] for row in rows])


def test_the_force_lost_while_holding():
    time_s = np.linspace(0, 10, 101)
    force = np.where(time_s < 3, time_s, 3 * (0.8 + 0.2 * np.exp(-(time_s - 3))))
    drop = fidelity.hold_drop(pd.DataFrame({"time_s": time_s, "force_n": force}))
    assert drop == pytest.approx(0.2, abs=0.005)
