"""What the cut of the study ran, every rule but for those that others run, and what it found."""

import csv
import json
import subprocess
import sys

import pandas as pd
import pytest
from palpate.modulus import LABELS
from quoted import DOCUMENTS, MARK, rows_of
from thesis.artefacts import ARTEFACTS
from truth_gate import estimates_of_known, scaled
from validation.measured import truth_of

pytestmark = pytest.mark.cut
OWN_OBJECTS = "for people's own objects: tests/workflow/test_own_object.py runs them"
NOT_RUN = {
    "all": "a target",
    "lab": "a target: all that the lab makes",
    "objects": "a target, of batches",
    "validation": "a target",
    "curve": OWN_OBJECTS,
    "own_data": OWN_OBJECTS,
    "own_fit": OWN_OBJECTS,
    "own_hertz_fit": OWN_OBJECTS,
    "own_known": OWN_OBJECTS,
    "own_moduli": OWN_OBJECTS,
    "own_report": OWN_OBJECTS,
    "own_surface": OWN_OBJECTS,
    "hand_eye": "for a recording of a target on a robot's flange, of which the study has none",
    "tip": "for a recording of the turning handle, of which the study has none",
    "load": "for a recording of the probe held free, of which the study has none",
    "stiffness": "for a recording of a press on something rigid, of which the study has none",
}
SENSORS = ("bumblebee", "kinect")
# Of the modulus where all else is known: of the block half of what a tenth of the force makes.
# Curved surfaces of ball and ear are cut short by coarse meshes.
BANDS = {"foam_block": 0.05, "foam_ball": 0.15, "ear": 0.15}
HERTZ_BAND = 0.05
FILES = {"table": "tables/{}.csv", "figure": "figures/{}.png"}


@pytest.fixture(scope="module")
def results(root):
    folder = root / "results/cut/results"
    assert folder.is_dir(), "run `make cut`, which makes what this looks at"
    return folder


def test_every_rule_ran_but_those_that_are_named(root, results):
    command = [sys.executable, "-m", "snakemake", "--configfile", "tests/cut/config.yaml"]
    listed = subprocess.run(
        [*command, "--list-rules"], cwd=root, capture_output=True, text=True, check=True
    )
    ran = {path.name.removesuffix(".tsv") for path in (results / "benchmarks").iterdir()}
    rules = {*listed.stdout.split(), *(entry.name for entry in ARTEFACTS)}
    assert rules - ran == set(NOT_RUN)


def test_all_artefacts_and_pages_are_there(root, results):
    with (root / "config/published/artefacts.csv").open(newline="") as stream:
        wanted = [FILES[row["kind"]].format(row["id"]) for row in csv.DictReader(stream)]
    assert len(wanted) == 61
    wanted += ["report.html", "objects.html", "summary.csv"]
    assert [name for name in wanted if not (results / name).is_file()] == []


def test_figures_are_drawn_and_tables_say_what_they_are_of(results):
    figures = {path.name: path.stat().st_size for path in (results / "figures").glob("*.png")}
    assert figures and [name for name, size in figures.items() if size <= 20_000] == []
    for name in ("table_4_1", "equation_4_12", "table_4_2", "cd_case", "sensor_accuracy"):
        assert "simulated" in (results / f"tables/{name}.md").read_text(), name


def test_every_kind_of_capture_went_through(results):
    places = {path.relative_to(results).parts[:2] for path in results.glob("*/*/*/hertz.json")}
    pairs = {(name, sensor) for name in ("foam_block", "foam_ball") for sensor in SENSORS}
    assert places == pairs | {("ear", "bumblebee")}


def test_what_documents_quote_can_be_written_of_a_run(root, results):
    texts = [(root / name).read_text() for name in DOCUMENTS]
    marks = [mark for text in texts for mark in MARK.finditer(text)]
    ours = [mark for mark in marks if mark["file"].startswith("results/tables/")]
    assert len(ours) == 3
    for mark in ours:
        rows = rows_of(results.parent / mark["file"], mark)
        # The cut presses less deep than the indentation table's last columns.
        assert rows and ("indentation" in mark["file"] or "| |" not in "\n".join(rows))


@pytest.fixture(scope="module")
def stiffer(results):
    """How much harder each object's coarse tables press than the lab's, where they are deepest."""
    table = pd.read_csv(results / "tables/indentation_accuracy.csv")
    deepest = table.filter(like="force_ratio").ffill(axis=1).iloc[:, -1]
    return deepest.groupby(table["object"]).mean()


@pytest.fixture(scope="module")
def found(results):
    return pd.read_csv(results / "tables/accuracy.csv")


def test_coarse_tables_press_nearly_as_hard_as_the_lab(stiffer):
    """What a table is off by, 1 to 11 % here, is taken out of the estimates below."""
    assert stiffer.between(0.98, 1.15).all()


@pytest.mark.parametrize(
    ("name", "sensor"),
    [
        ("ear", "bumblebee"),
        ("foam_ball", "bumblebee"),
        ("foam_ball", "kinect"),
        ("foam_block", "bumblebee"),
        ("foam_block", "kinect"),
    ],
)
def test_recommended_intervals_hold_the_truth(found, stiffer, name, sensor):
    of_these = (found["object"] == name) & (found["sensor"] == sensor)
    (row,) = found[found["recommended"] & of_these].to_dict("records")
    for of in (label.removesuffix("_pa") for label in LABELS if label.endswith("_pa")):
        low, high = (stiffer[name] * row[f"{of}_{end}_pa"] for end in ("low", "high"))
        assert low <= row[f"true_{of}_pa"] <= high, of
    assert row["poisson_ratio_covered"]


@pytest.mark.parametrize("name", BANDS)
def test_the_modulus_is_found_and_on_the_block_a_tenth_of_the_force_seen(results, stiffer, name):
    material = json.loads((results / f"lab/{name}/material.json").read_text())
    joints = results.glob(f"{name}/*/direct.json")
    captures = {path.parent.name: json.loads(path.read_text())["captures"] for path in joints}
    folders = results / name, results.parent / "captures" / name
    scales = (1.0, 0.9, 1.1) if name == "foam_block" else (1.0,)
    changes = [scaled("force", by) for by in scales]
    each = estimates_of_known(*folders, captures, material, changes)
    moduli = [one.moduli["youngs_modulus_1s_pa"].value for one in each]
    true = truth_of(material)["youngs_modulus_1s_pa"]
    right, *wrong = (abs(stiffer[name] * modulus / true - 1) for modulus in moduli)
    assert right < BANDS[name] and all(off > BANDS[name] for off in wrong)


def test_so_it_is_by_hertzs_fits_of_the_block(found):
    rows = found[(found["object"] == "foam_block") & (found["method"] == "hertz_recommended")]
    assert len(rows) == 11 and rows["reduced_modulus_covered"].all()
    for _, part in rows.groupby("sensor"):
        ratio = (part["reduced_modulus_pa"] / part["true_reduced_modulus_pa"]).median()
        assert abs(ratio - 1) < HERTZ_BAND < min(abs(0.9 * ratio - 1), abs(1.1 * ratio - 1))
