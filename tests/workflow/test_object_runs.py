"""Each object as a run of its own: what is told before, and what a second look finds changed."""

import fcntl
import shutil

import pytest
import yaml
from palpate.run.lock import LOCK
from sample_run import LEFT_BEHIND, snakemake

pytestmark = pytest.mark.workflow
OBJECTS = ("--snakefile", "workflow/objects.smk", "--configfile", "run.yaml")


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
    (folder / "run.yaml").write_text("paths: {sensors: tests/sample/sensors}\n")
    return folder


def test_one_job_an_object(project):
    done = snakemake(project, *OBJECTS, "--dry-run")
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    assert "object_study           2" in text and "object_check           2" in text
    assert "track" not in text


@pytest.mark.parametrize(
    ("option", "line"),
    [
        ("paths=3", "--config: paths: expected a mapping, found 3"),
        ("only=", "--config only=: expected a value, found nothing"),
    ],
)
def test_a_wrong_option_is_one_clear_line(project, option, line):
    done = snakemake(project, *OBJECTS, "--dry-run", "--config", option)
    assert done.returncode == 1
    (told,) = [one for one in done.stderr.splitlines() if not one.startswith("Using")]
    assert told.startswith(f"error: {line}")


def test_what_needs_no_image_is_told_before_any_job(project):
    (project / "raw/cushion/kinect/08/force.csv").unlink()
    (project / "raw/sponge/kinect/08").rename(project / "raw/sponge/kinect/99")
    done = snakemake(project, *OBJECTS, "--dry-run")
    assert done.returncode != 0
    text = done.stdout + done.stderr
    assert "raw/cushion/kinect/08/force.csv: file: expected a CSV table, found nothing" in text
    assert "raw/sponge/kinect/99: point: expected one of" in text


def test_no_object_runs_while_any_capture_is_wrong(project):
    # A link, as docs/reliability.md allows: what lies on the other disk counts.
    capture = project / "raw/sponge/kinect/08"
    capture.symlink_to(shutil.move(capture, project / "far"))
    image = capture / "depth/000003.png"
    whole = image.read_bytes()
    image.write_bytes(whole[:-20])
    target = "results/objects/checked.txt"
    done = snakemake(project, *OBJECTS, "--", target)
    assert done.returncode != 0
    wrong = "depth/000003.png: depth: expected a whole PNG image, found a truncated one"
    assert wrong in done.stderr and "the first of 1 lines on 1 of 2 objects" in done.stderr
    assert not (project / target).exists()
    image.write_bytes(whole)
    done = snakemake(project, *OBJECTS, "--", target)
    assert done.returncode == 0, done.stderr[-3000:]
    assert (project / target).read_text() == "2 objects: nothing wrong\n"
    # Only the mended object was looked into again.
    assert "Checking the captures of sponge" in done.stdout + done.stderr
    assert "Checking the captures of cushion" not in done.stdout + done.stderr


def test_a_second_run_is_refused_in_one_line(project):
    folder = project / "results/objects"
    folder.mkdir(parents=True)
    with (folder / LOCK).open("w") as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        done = snakemake(project, *OBJECTS, "--", "results/objects/checked.txt")
    assert done.returncode != 0
    line = "error: results/objects: expected no other run at work, found one (just begun)"
    text = [one.strip() for one in (done.stdout + done.stderr).splitlines()]
    assert text.count(line) == 1 and "Traceback" not in done.stderr
    assert text[-1] == line and "Job stats:" not in text
    assert "Checking the captures" not in done.stdout + done.stderr
    assert not (folder / "checked.txt").exists()


def test_a_run_of_one_object_leaves_what_is_of_all(project):
    """Configuration and list of what was made are the last full run's, as its tables are."""
    done = snakemake(
        project, *OBJECTS[2:], "--dry-run", "--config", "only=sponge", "methods=[hertz]"
    )
    assert done.returncode == 0, done.stderr[-3000:]
    text = done.stdout + done.stderr
    assert "own_summary " in text and "objects_page " in text and "configuration " not in text


def test_an_objects_own_run_knows_how_its_page_is_made(project):
    (project / "run.yaml").write_text(
        "only: cushion\npaths: {sensors: tests/sample/sensors, lab: null}\n"
    )
    page = "results/cushion/report.html"
    done = snakemake(project, "--configfile", "run.yaml", "--dry-run", "--", page)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "own_report " in done.stdout + done.stderr
