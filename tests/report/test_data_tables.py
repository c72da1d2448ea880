"""What was fitted, as tables, and the package that describes them."""

import json

import numpy as np
import pandas as pd
import pytest
from palpate.capture.tables import write_table
from palpate.estimate.direct.motion import SurfaceMotion
from palpate.estimate.direct.result import CaptureFit, load_fitted, save_fitted
from palpate.report.data_package import data_package
from palpate.report.data_tables import (
    RING_M,
    force_table,
    motion_table,
    profile_table,
    sample_table,
)

FRAMES, SAMPLES, KEY = 5, 9, ("zed", "01")
COMPARED, CHOSEN = np.array([2, 3]), np.array([7, 1, 4])
CURVE = {"sensor": "curve", "capture": "back"}
CURVE_FILE = {"samples": {"depth_m": [0.0, 1e-3], "force_n": [0.0, 0.5], "fitted_n": [0.1, 0.4]}}


@pytest.fixture
def motion():
    rng = np.random.default_rng(2)
    moved = rng.normal(0, 1e-4, (FRAMES, SAMPLES))
    moved[0, 3] = moved[3, 1] = np.nan
    return SurfaceMotion(
        cell_m=rng.uniform(-0.02, 0.02, (SAMPLES, 3)),
        normal=np.tile([0.0, 0, 1], (SAMPLES, 1)),
        moved_m=moved,
        std_m=np.where(np.isfinite(moved), 1e-4, np.nan),
        rest_std_m=np.full(SAMPLES, 5e-5),
    )


@pytest.fixture
def fit(motion):
    contact = np.array([0.001, 0.002, 0.003])
    moved = motion.moved_m[np.ix_(COMPARED, CHOSEN)]
    cells = motion.cell_m[CHOSEN]
    return CaptureFit(
        time_s=0.1 * np.arange(FRAMES),
        tip_depth_m=np.linspace(-0.001, 0.003, FRAMES),
        frames=COMPARED,
        force_n=np.array([0.3, 0.9]),
        depth_m=np.array([0.001, 0.003]),
        fitted_depth_m=np.array([0.0012, 0.0029]),
        depth_expected_std_m=np.full(2, 1e-4),
        moved_m=moved,
        fitted_moved_m=moved - np.arange(6).reshape(2, 3) * 1e-5,
        moved_expected_std_m=np.full((2, 3), 1e-5),
        cell_m=cells,
        contact_m=contact,
        distance_m=np.linalg.norm(cells - contact, axis=1),
    )


def test_a_fit_is_read_as_it_was_written_and_always_the_same(fit, tmp_path):
    paths = tmp_path / "a.npz", tmp_path / "b.npz"
    for path in paths:
        save_fitted(path, {"01": fit, "01-a02": fit})
    assert paths[0].read_bytes() == paths[1].read_bytes()
    found = load_fitted(paths[0])["01-a02"]
    for name, value in vars(fit).items():
        np.testing.assert_array_equal(getattr(found, name), value)
    np.savez(paths[0], captures=np.array(["01"]))
    with pytest.raises(ValueError, match="a.npz: 01/time_s: expected an array, found none"):
        load_fitted(paths[0])


def test_force_has_fit_and_residual_of_captures_and_of_curves(fit):
    table = force_table({KEY: fit}, [CURVE], [CURVE_FILE])
    assert table["frame"].tolist() == [2, 3, 0, 1] and table["frame"].dtype == int
    assert table["time_s"][:2].tolist() == pytest.approx([0.2, 0.3])
    assert table["depth_residual_m"][:2].tolist() == pytest.approx([-2e-4, 1e-4])
    assert table["force_residual_n"][2:].tolist() == pytest.approx([-0.1, 0.1])
    assert table["depth_residual_m"][2:].isna().all()


def test_motion_is_all_that_was_seen_with_the_model_where_it_was_compared(fit, motion):
    table = motion_table({KEY: fit}, [motion]).set_index(["frame", "sample"])
    assert len(table) == FRAMES * SAMPLES - 2
    compared = table[table["fitted_moved_m"].notna()]
    # Sample 1 was not seen in frame 3.
    assert set(compared.index) == {(2, 7), (2, 1), (2, 4), (3, 7), (3, 4)}
    assert compared.loc[(3, 4), "moved_residual_m"] == pytest.approx(5e-5)
    assert compared.loc[(3, 4), "moved_m"] == motion.moved_m[3, 4]
    assert (compared["moved_expected_std_m"] == 1e-5).all()
    assert table["moved_expected_std_m"].count() == len(compared)


def test_another_motion_than_the_fits_is_rejected(fit, motion):
    other = SurfaceMotion(**vars(motion) | {"cell_m": motion.cell_m + 1e-6})
    with pytest.raises(ValueError, match="samples: expected those of the motion, found others"):
        motion_table({KEY: fit}, [other])


def test_the_profile_is_the_mean_of_rings_in_the_deepest_frame(fit):
    seen = np.array([True, False, True])
    table = profile_table({KEY: fit})
    rings = (fit.distance_m[seen] // RING_M).astype(int)
    assert len(table) == len(set(rings)) and table["samples"].sum() == 2
    assert (table["frame"] == 3).all() and (table["depth_m"] == 0.003).all()
    total = (table["samples"] * table["moved_m"]).sum()
    assert total == pytest.approx(fit.moved_m[1, seen].sum())


def test_the_package_describes_each_file_as_it_stands(fit, motion, tmp_path):
    tables = {
        "data/force.csv": force_table({KEY: fit}, [CURVE], [CURVE_FILE]),
        "data/motion.csv": motion_table({KEY: fit}, [motion]),
        "data/samples.csv": sample_table({KEY: fit}, [motion]),
        "data/profile.csv": profile_table({KEY: fit}),
        "summary.csv": pd.DataFrame(
            {"recommended": [True], "doubts": [np.nan], "method": ["a"], "youngs_modulus_low_pa": 2}
        ),
    }
    paths = {str(tmp_path / name): table for name, table in tables.items()}
    for path, table in paths.items():
        write_table(path, table)
    package = data_package("Red Sponge", tmp_path, paths)
    assert package["name"] == "red-sponge"
    assert json.dumps(package) == json.dumps(data_package("Red Sponge", tmp_path, paths))
    assert [one["path"] for one in package["resources"]] == list(tables)
    for one in package["resources"]:
        head = (tmp_path / one["path"]).read_text().splitlines()[0].split(",")
        assert head == [field["name"] for field in one["schema"]["fields"]]
    fields = {f["name"]: f for one in package["resources"] for f in one["schema"]["fields"]}
    kinds = {"frame": "integer", "moved_m": "number", "capture": "string", "recommended": "boolean"}
    # What has a unit is a number, though one table may have whole ones.
    kinds |= {"doubts": "any", "youngs_modulus_low_pa": "number"}
    assert {name: fields[name]["type"] for name in kinds} == kinds
    assert fields["youngs_modulus_low_pa"]["description"].endswith("unit: Pa")
