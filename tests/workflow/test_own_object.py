"""An object that nothing names, dropped in as a person would: found, estimated, shown."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import yaml
from sample_run import copied, counted, ran, snakemake

pytestmark = pytest.mark.workflow
NAME, SENSOR = "toy_cow", "bench_cam"
# Only the indentation table is coarser than the configuration's.
COARSE = ("--configfile", "tests/own_object/config.yaml")


@pytest.fixture(scope="module")
def dropped(root, tmp_path_factory):
    """A copy of the project into which a person has put camera, probe and object."""
    folder = copied(root, tmp_path_factory.mktemp("own") / "main")
    source = root / "tests/own_object"
    shutil.copytree(source / "raw", folder / "raw")
    for kind in ("sensors", "probes"):
        shutil.copytree(source / kind, folder / "config" / kind, dirs_exist_ok=True)
    add_curve(folder / f"raw/{NAME}", {"poisson_ratio": [0.3, 0.45]})
    return folder


def add_curve(folder, block, **changes):
    """A curve of a robot beside an object's captures, by Hertz's law: 0.14 N/mm^1.5."""
    path = folder / "object.yaml"
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | changes | {"curves": block}))
    depth, rng = np.linspace(-2, 5, 141), np.random.default_rng(3)
    force = 0.14 * np.maximum(depth, 0) ** 1.5 + 0.01 * rng.normal(size=141)
    rows = [f"{-d:.4f};{f:.4f}".replace(".", ",") for d, f in zip(depth, force, strict=True)]
    (folder / "back.csv").write_text("\n".join(["Weg [mm];Kraft [N]", *rows]) + "\n")


@pytest.fixture(scope="module")
def results(dropped):
    """Results of the run of just that object."""
    told = ran(dropped, *COARSE, "--config", f"only={NAME}")
    assert f"Page for a browser: results/{NAME}/report.html" in told
    return dropped / "results"


def truth(root):
    lab = yaml.safe_load((root / "tests/own_object/lab.yaml").read_text())
    return lab["objects"][NAME]["material"]


def test_the_study_runs_beside_it(dropped):
    assert {"own_report", "table_5_3", "lab_capture"} <= counted(ran(dropped, "--dry-run"))


@pytest.mark.long
def test_methods_are_those_that_are_asked_for(dropped):
    """The study's is not run where nobody asks; a page shows Hertz and direct estimates."""
    rules = {}
    for methods in ("hertz,direct", "hertz,direct,minimise", "hertz"):
        given = ("--config", f"only={NAME}", f"methods=[{methods}]")
        rules[methods] = counted(ran(dropped, *COARSE, "--dry-run", *given))
    assert rules["hertz,direct,minimise"] - rules["hertz,direct"] >= {"minimise"}
    assert {"direct_object", "own_report", "own_summary"} <= rules["hertz,direct"]
    assert not {"direct", "own_report", "minimise"} & rules["hertz"]
    assert {"hertz", "own_summary"} <= rules["hertz"]
    done = snakemake(dropped, *COARSE, "--dry-run", "--config", "methods=[guess]")
    assert "methods.0: expected" in done.stdout + done.stderr


@pytest.fixture
def bench(dropped):
    """The object pressed by a robot alone."""
    folder = dropped / "raw/bench_cow"
    folder.mkdir()
    shutil.copy(dropped / f"raw/{NAME}/template.ply", folder)
    spec = yaml.safe_load((dropped / f"raw/{NAME}/object.yaml").read_text())
    del spec["probe"]
    (folder / "object.yaml").write_text(yaml.safe_dump(spec))
    add_curve(folder, {"poisson_ratio": 0.4, "radius_m": 0.006}, object="bench_cow")
    yield folder
    shutil.rmtree(folder)


def test_a_curve_is_found_and_checked(dropped, bench):
    given = ("--dry-run", "--config", "only=bench_cow")
    rules = counted(ran(dropped, *COARSE, *given))
    assert {"curve", "indentation", "own_summary", "summary"} <= rules
    assert not {"own_report", "clouds", "hertz"} & rules
    (bench / "neck.csv").write_text("no curve\n")
    done = snakemake(dropped, *COARSE, *given)
    assert "neck.csv: point: expected one of back, found neck" in done.stdout + done.stderr


@pytest.mark.long
def test_a_curve_has_its_rows(results):
    table = pd.read_csv(results / "summary.csv").set_index("method")
    by_table, by_hertz = table.loc["curve_table"], table.loc["curve_hertz"]
    assert by_table["recommended"] and by_table["poisson_ratio_verdict"] == "assumed"
    assert (by_table["poisson_ratio_low"], by_table["poisson_ratio_high"]) == (0.3, 0.45)
    # 0.14 N/mm^1.5 = 4/3 E* sqrt(6 mm).
    E_star = 0.14 * 1e3**1.5 * 0.75 / np.sqrt(0.006)
    assert by_hertz["reduced_modulus_pa"] == pytest.approx(E_star, rel=0.12)
    # A cow's back is rounder than a half-space, and thin.
    assert 0.7 < by_table["reduced_modulus_pa"] / E_star < 1.4
    assert "curve back" in (results / f"{NAME}/report.html").read_text()


@pytest.mark.long
def test_one_row_is_recommended_and_it_is_near_the_truth(results, root):
    table = pd.read_csv(results / f"{NAME}/summary.csv", dtype={"capture": str})
    (advised,) = table[table["recommended"] & (table["sensor"] == SENSOR)].to_dict("records")
    assert advised["method"] == "direct_joint"
    # Every capture that lies there is taken.
    assert advised["captures"] == 2
    assert set(table["capture"]) == {"back", "back-a02", "all"}
    material = truth(root)
    E, nu = material["youngs_modulus_pa"], material["poisson_ratio"]
    # The solid is another one in each run.
    assert 0.8 * E < advised["youngs_modulus_pa"] < 1.2 * E
    assert 0.85 < advised["reduced_modulus_pa"] / (E / (1 - nu**2)) < 1.15
    assert advised["poisson_ratio_low"] - 0.05 < nu < advised["poisson_ratio_high"] + 0.05


@pytest.mark.long
def test_its_page_shows_it(results):
    page = (results / f"{NAME}/report.html").read_text()
    assert page.count('src="data:image/webp;base64,') == 5
    # Three frames twice.
    assert page.count('src="data:image/jpeg;base64,') == 6
    assert "no such object was indented" in page
    assert "What to improve next" in page and "All 12 checks of 2 captures passed" in page
    assert "direct, all captures together" in page
    body = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
    assert not re.search(r'(?:src|href)="(?:http|//)', body)
    links = re.findall(r'href="([^"]*)"', body)
    assert links and all((results / NAME / link).is_file() for link in links)
    for name in ("moduli", "fit", "known", "hertz_fit", "surface"):
        assert (results / f"{NAME}/figures/{name}.png").stat().st_size > 20_000
        assert (results / f"{NAME}/figures/{name}.svg").stat().st_size > 5_000
    assert "Toy cow" in (results / "objects.html").read_text()


@pytest.mark.long
def test_its_data_are_described(results):
    folder = results / NAME
    package = json.loads((folder / "datapackage.json").read_text())
    tables = {one["path"]: one["schema"]["fields"] for one in package["resources"]}
    assert {"data/force.csv", "data/motion.csv", "summary.csv"} <= set(tables)
    assert f"{SENSOR}/uncertainty_budget.csv" in tables
    for path, fields in tables.items():
        assert list(pd.read_csv(folder / path)) == [field["name"] for field in fields]
    force = pd.read_csv(folder / "data/force.csv")
    assert set(force["capture"]) == {"back", "back-a02"}
    of_camera = force[force["sensor"] == SENSOR]
    # Against presses of some millimetres.
    assert of_camera["depth_residual_m"].abs().max() < 0.0005
    motion = pd.read_csv(folder / "data/motion.csv")
    assert motion["fitted_moved_m"].notna().any() and motion["fitted_moved_m"].isna().any()


@pytest.mark.long
def test_a_further_capture_costs_just_itself(results, dropped):
    more = dropped / f"raw/{NAME}/{SENSOR}/back-a03"
    shutil.copytree(more.with_name("back"), more)
    # Another recording: the very same one is refused.
    force = (more / "force.csv").read_text().splitlines()
    (more / "force.csv").write_text("\n".join(force[:-1]) + "\n")
    try:
        told = ran(dropped, *COARSE, "--dry-run", "--config", f"only={NAME}")
    finally:
        shutil.rmtree(more)
    assert {"clouds", "direct", "direct_object", "own_report"} <= counted(told)
    assert not {"indentation", "solid_mesh", "background_model", "track"} & counted(told)
    assert "Hertz fit of toy_cow, bench_cam, back-a03" in told
    assert "Nothing to be done" in ran(dropped, *COARSE, "--config", f"only={NAME}")
