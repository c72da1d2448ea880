"""Parts of many objects: one of them, or a batch."""

import shutil

import pytest
import yaml
from sample_run import LEFT_BEHIND, snakemake

pytestmark = pytest.mark.workflow
OBJECTS = ("--configfile", "run.yaml", "--dry-run")


@pytest.fixture
def project(root, tmp_path):
    """The project with two objects of one capture each."""
    folder = tmp_path / "main"
    shutil.copytree(root, folder, ignore=LEFT_BEHIND)
    block = root / "tests/sample/raw/foam_block"
    spec = yaml.safe_load((block / "object.yaml").read_text())
    for name in ("cushion", "sponge"):
        target = folder / "raw" / name
        shutil.copytree(block / "kinect", target / "kinect")
        shutil.copy(block / "template.ply", target)
        (target / "object.yaml").write_text(yaml.safe_dump(spec | {"object": name}))
    (folder / "run.yaml").write_text("paths: {sensors: tests/sample/sensors, lab: null}\n")
    return folder


def test_a_run_of_one_object_leaves_what_is_of_all(project):
    """Configuration and list of what was made are the last full run's, as its tables are."""
    done = snakemake(project, *OBJECTS, "--config", "only=sponge", "methods=[hertz]")
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    assert "own_summary " in text and "objects_page " in text and "configuration " not in text


def test_a_batch_takes_a_part_of_the_objects(project):
    batch = ("--batch", "objects=1/2", "--", "objects")
    done = snakemake(project, *OBJECTS, *batch)
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    assert "results/cushion/report.html" in text and "results/sponge/" not in text
