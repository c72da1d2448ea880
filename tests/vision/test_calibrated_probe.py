"""A probe's file that asks a run's calibrations for its numbers."""

import json

import numpy as np
import pytest
from palpate.config.probe import as_stated, asked
from palpate.estimate.direct.options import ProbeUncertainty
from palpate.vision.calibrated_probe import calibrated_probe
from palpate.vision.probe import marker_from_tip
from probe_motion import TIP_M
from scipy.spatial.transform import Rotation

COMPLIANCE_M_N, STD_M_N = 5e-5, 4e-6
UNSURE_TURN = np.diag([0, *[4e-4] * 3, *[1e-8] * 9]).tolist()


@pytest.fixture
def load(tmp_path, probe):
    """Write load.json, some of its fields changed, its axes turned from the file's."""

    def written(turn_deg=1.0, **changed):
        stated = np.array(probe["marker_from_force"])[:3, :3]
        turn = stated @ Rotation.from_euler("y", turn_deg, degrees=True).as_matrix()
        fields = {"mass_kg": 0.031, "mass_std_kg": 1e-4, "centre_of_mass_m": [0.0, 0.001, 0.036]}
        fields |= {"marker_from_force_rotation": turn.tolist(), "axes_std_rad": 1e-3}
        fields |= {"covariance": (np.eye(13) * 1e-8).tolist()}
        path = tmp_path / "load.json"
        path.write_text(json.dumps(fields | changed))
        return path

    return written


def tip(folder, tip_m=TIP_M, std_m=1e-5, **changed):
    """Write what of tip.json a probe takes."""
    covariance = (np.eye(3) * std_m**2).tolist()
    fields = {"tip_m": np.array(tip_m).tolist(), "tip_covariance_m2": covariance} | changed
    path = folder / "tip.json"
    path.write_text(json.dumps(fields))
    return path


def test_load_and_axes_are_asked_for_apart(load, probe):
    path = load()
    hangs = calibrated_probe(probe | {"load": "calibration"}, [path])
    centre = [0.0, 0.001, 0.036]
    known = {"mass_kg": 0.031, "mass_std_kg": 1e-4, "centre_of_mass_m": centre}
    assert hangs["load"] == known | {"origin": "calibrated"}
    assert hangs["marker_from_force"] == probe["marker_from_force"]
    turned = calibrated_probe(probe | {"axes": "calibration"}, [path])
    assert turned["load"] == probe["load"] and turned["axes_std_rad"] == 1e-3
    stated, found = (np.array(one["marker_from_force"]) for one in (probe, turned))
    np.testing.assert_array_equal(found[:, 3], stated[:, 3])
    apart = Rotation.from_matrix(found[:3, :3].T @ stated[:3, :3]).magnitude()
    assert np.degrees(apart) == pytest.approx(1.0, abs=1e-6)


def test_a_tip_of_the_boards_frame_stays_where_axes_turn(load, probe):
    """That of a drawing is known in the sensor's frame and turns with it: 60 mm by 3 degrees."""
    path, asks, stated = load(turn_deg=3.0), probe | {"axes": "calibration"}, marker_from_tip(probe)
    found = marker_from_tip(calibrated_probe(asks, [path]))
    assert np.linalg.norm(found[:3, 3] - stated[:3, 3]) == pytest.approx(3.14e-3, abs=1e-5)
    asks["tip_covariance_m2"] = (np.eye(3) * 1e-10).tolist()
    found = marker_from_tip(calibrated_probe(asks, [path]))
    np.testing.assert_allclose(found[:3, 3], stated[:3, 3], atol=1e-12)
    apart = Rotation.from_matrix(found[:3, :3].T @ stated[:3, :3]).magnitude()
    assert np.degrees(apart) == pytest.approx(3.0, abs=1e-6)


def test_a_tip_is_held_to_where_the_file_has_it_however_axes_turn(load, probe, tmp_path):
    """Axes that turn by 15 degrees move a tip that they carry along by 16 mm, along the off one."""
    asks = probe | {"axes": "calibration", "tip": "calibration"}
    stated, along = marker_from_tip(probe)[:3, 3], np.array(probe["marker_from_force"])[:3, 0]
    paths = [load(turn_deg=15.0), tip(tmp_path, stated - 0.019 * along)]
    found = marker_from_tip(calibrated_probe(asks, paths))
    np.testing.assert_allclose(found[:3, 3], stated - 0.019 * along, atol=1e-12)
    tip(tmp_path, stated - 0.021 * along)
    with pytest.raises(ValueError, match="expected within 20 mm .* found it 21 mm away"):
        calibrated_probe(asks, paths)


def test_a_tip_and_its_covariance(tmp_path, probe):
    tip_m = TIP_M + [0.001, 0, 0]
    path = tip(tmp_path, tip_m, std_m=3e-5)
    taken = calibrated_probe(probe | {"tip": "calibration"}, [path])
    found, known = marker_from_tip(taken), ProbeUncertainty.of(taken)
    np.testing.assert_allclose(found[:3, 3], tip_m, atol=1e-12)
    np.testing.assert_allclose(found[:3, :3], marker_from_tip(probe)[:3, :3])
    np.testing.assert_allclose(known.tip_covariance_m2, np.eye(3) * 9e-10)
    assert known.tip == "calibrated"
    assert calibrated_probe(probe, [path]) is probe


def stiffness(folder, stiffness_n_m):
    path = folder / "stiffness.json"
    known = {"compliance_m_n": COMPLIANCE_M_N, "compliance_std_m_n": STD_M_N}
    path.write_text(json.dumps(known | {"stiffness_n_m": stiffness_n_m}))
    return path


def test_a_stiffness(tmp_path, probe):
    asks = probe | {"stiffness_n_m": "calibration"}
    told = calibrated_probe(asks, [stiffness(tmp_path, 1 / COMPLIANCE_M_N)])
    assert told["stiffness_n_m"] == pytest.approx(2e4)
    assert told["compliance_std_m_n"] == STD_M_N
    stiff = calibrated_probe(asks, [stiffness(tmp_path, None)])
    assert "stiffness_n_m" not in stiff
    assert stiff["compliance_std_m_n"] == pytest.approx(np.hypot(COMPLIANCE_M_N, STD_M_N))
    with pytest.raises(ValueError, match="stiffness_n_m: expected a number above 0, found -1"):
        calibrated_probe(asks, [stiffness(tmp_path, -1)])


def test_the_budget_names_what_was_calibrated_and_what_was_stated(tmp_path, probe):
    stated = probe | {"stiffness_n_m": 2e4, "compliance_std_m_n": 1e-6}
    asked = stated | {"stiffness_n_m": "calibration"}
    known = stated, calibrated_probe(asked, [stiffness(tmp_path, 2e4)])
    origins = [ProbeUncertainty.of(one).origins["compliance of the probe"] for one in known]
    assert origins == ["stated", "calibrated"]


def test_a_calibration_of_another_probe(load, tmp_path, probe):
    for asks in ("load", "axes"):
        line = "load.json: probe: expected nano25_sphere, whose file asks for it, found long_needle"
        with pytest.raises(ValueError, match=line):
            calibrated_probe(probe | {asks: "calibration"}, [load(probe="long_needle")])
    assert calibrated_probe(probe, [load(probe="long_needle")]) is probe
    for part, asks in (("tip", "tip"), ("stiffness", "stiffness_n_m")):
        path = tmp_path / f"{part}.json"
        path.write_text(json.dumps({"probe": "long_needle"}))
        with pytest.raises(ValueError, match=f"{part}.json: probe: expected nano25_sphere"):
            calibrated_probe(probe | {asks: "calibration"}, [path])
    asks = probe | {"load": "calibration"}
    for same in ("nano25_sphere", None):
        assert calibrated_probe(asks, [load(probe=same)])["load"]["mass_kg"] == 0.031


def test_what_was_not_made(probe, load):
    asks = probe | {"load": "calibration", "tip": "calibration"}
    assert list(asked(asks)) == ["load", "tip"]
    with pytest.raises(ValueError, match=r"tip: expected the tip.json that the file of nano25"):
        calibrated_probe(asks, [load()])
    assert as_stated(asks, {"load"}) == probe | {"load": "calibration"}
    assert "load" not in as_stated(asks) and asked(as_stated(asks)) == {}


def test_a_calibration_that_does_not_serve(load, probe, tmp_path):
    for part, changed, line in (
        ("tip", {"tip_m": [0.03, 0.2, 0.08]}, "tip_m: expected within 20 mm .* 30 mm away"),
        ("tip", {"std_m": 0.002}, "determined to 0.2 mm, found one to 2 mm"),
        ("tip", {"tip_m": None}, "tip_m: expected finite numbers"),
        ("tip", {"tip_covariance_m2": np.triu(np.ones((3, 3))).tolist()}, "expected a symmetric"),
        ("load", {"turn_deg": 40}, "within 20 degrees of how the .* found it 40 degrees away"),
        ("load", {"covariance": UNSURE_TURN}, "one that is determined to 0.3 degrees, .* 1.1"),
        ("load", {"mass_std_kg": 0.004}, "mass_kg: .* determined to 1 g, found one to 4 g"),
        ("load", {"covariance": (np.eye(13) * 1e-5).tolist()}, "centre_of_mass_m: .* 1 mm, .* 3"),
        ("load", {"axes_std_rad": 5e-5}, "no less than the covariance says, 0.0001"),
        ("load", {"covariance": [1.0]}, r"covariance: .* of shape \(13, 13\)"),
        ("load", {"marker_from_force_rotation": np.eye(3).tolist()[::-1]}, "found a mirrored"),
    ):
        path = tip(tmp_path, **changed) if part == "tip" else load(**changed)
        asks = dict.fromkeys(("tip",) if part == "tip" else ("load", "axes"), "calibration")
        with pytest.raises(ValueError, match=f"{part}.json: .*{line}"):
            calibrated_probe(probe | asks, [path])
