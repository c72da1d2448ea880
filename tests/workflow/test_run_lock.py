"""One run at a time, a lock that no dead process holds, and folders that no run can have."""

import errno
import logging
import os
import subprocess
import sys
from collections import Counter
from types import SimpleNamespace

import pytest
from palpate.workflow import start as run_lock
from palpate.workflow.configuration_checks import path_problems
from palpate.workflow.start import LOCK, lock_folder, start_run

HOLD = """
import sys, time
from palpate.workflow.start import lock_folder
lock_folder(sys.argv[1], warn=print)
print("held", flush=True)
time.sleep(60)
"""


@pytest.fixture
def holder(root, tmp_path):
    """Another process that holds a folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "results")],
        env=os.environ | {"PYTHONPATH": str(root / "workflow/scripts")},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


@pytest.fixture(autouse=True)
def free(monkeypatch):
    """Let go of this process's locks after a test."""
    monkeypatch.setattr(run_lock, "_descriptors", [])
    yield
    for descriptor in run_lock._descriptors:
        os.close(descriptor)


def begin(results, raw, made=()):
    """Begin a run that the lab makes folders of ``raw`` for."""
    paths, made = {"results": str(results), "raw": str(raw)}, [str(path) for path in made]
    run = SimpleNamespace(paths=paths, lab_folders=made)
    dag, cores = SimpleNamespace(needrun_jobs=Counter), SimpleNamespace(cores=None)
    known = {"local_exec": True, "scheduler": SimpleNamespace(), "resource_settings": cores}
    start_run(SimpleNamespace(**known, dag=dag), run, logging.Logger("run"))


def test_a_second_run_ends_with_one_line_until_the_first_is_dead(holder, tmp_path, capsys):
    results, raw = tmp_path / "results", tmp_path / "raw"
    with pytest.raises(SystemExit) as end:
        begin(results, raw)
    assert end.value.code == 1
    line = f"error: {results}: expected no other run at work, found one (process {holder.pid} on"
    assert capsys.readouterr().err.startswith(line)
    holder.kill()
    holder.wait()
    begin(results, raw)
    assert f"process {os.getpid()} " in (results / LOCK).read_text()


def test_a_folder_that_can_not_be_written_to(tmp_path):
    (tmp_path / "results").touch()
    with pytest.raises(ValueError, match="results: expected a folder to write into, found"):
        lock_folder(tmp_path / "results", warn=print)


def test_a_file_system_without_locks_is_reported(tmp_path, monkeypatch):
    def none(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(run_lock.fcntl, "flock", none)
    said = []
    lock_folder(tmp_path, warn=said.append)
    assert said == [f"{tmp_path}: this file system has no locks; see that no other run works on it"]


def test_what_killed_jobs_left_is_removed_but_nothing_of_other_runs_and_people(tmp_path):
    raw, results = tmp_path / "raw", tmp_path / "results"
    parts = [raw / "mine", raw / "block", results / "block", results / "sample"]
    for folder in parts:
        folder.mkdir(parents=True)
        (folder / ".part-0-a.csv").touch()
    (results / "sample" / LOCK).touch()
    begin(results, raw, [raw / "block"])
    assert [any(folder.glob(".part-*")) for folder in parts] == [True, False, False, True]
    assert (raw / LOCK).exists()


PATHS = {"raw": "raw", "results": "results", "sensors": "s", "probes": "p", "meshes": "m"}
PATHS["lab"] = None
OUTSIDE = "results: expected a folder outside paths."
PRINTABLE = "raw: expected printable characters"


@pytest.mark.parametrize(
    ("name", "places", "line"),
    [
        ("results", ["raw", "./raw/", "results/../raw", "raw/foam_block", "s/a"], OUTSIDE),
        ("raw", ["a\nb", "a\0b", "x" * 5000, "\x1b[31m"], PRINTABLE),
    ],
)
def test_folders_that_no_run_can_have(name, places, line, tmp_path, monkeypatch):
    assert path_problems(PATHS | {"raw": "results/lab/raw"}, "config.yaml") == []
    for place in places:
        (found,) = path_problems(PATHS | {name: place}, "config.yaml")
        assert found.startswith(f"config.yaml: paths.{line}") and found.isprintable()
    monkeypatch.chdir(tmp_path)
    assert path_problems(PATHS, "config.yaml") == []
    (tmp_path / "raw").mkdir()
    (tmp_path / "results").symlink_to("raw")
    assert len(path_problems(PATHS, "config.yaml")) == 1
