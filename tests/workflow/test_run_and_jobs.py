"""One run at a time; its jobs end with it, say in a line what went wrong, and want still inputs."""

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
from palpate.workflow.job import OWNER, run
from palpate.workflow.start import LOCK, environment, lock_folder, start_run
from stage_runs import Named

# Stands for the run's Snakemake: starts a job, through a shell or not, and waits.
START = """
import os, subprocess, sys
command = [sys.executable, "-c", sys.argv[1]]
if sys.argv[2] == "shell":
    command = ["sh", "-c", '"$@"; true', "sh", *command]
job = subprocess.Popen(command, env=os.environ | {sys.argv[3]: str(os.getpid())})
job.wait()
"""
JOB = """
import os, time
from types import SimpleNamespace
from palpate.workflow.job import run
def main(snakemake):
    os.write(1, b"on\\n")
    time.sleep(60)
run(main, SimpleNamespace(rule="mask", wildcards=[], log="log.txt", input=[], params={}))
"""
ENDS_S = 20.0
HOLD = """
import sys, time
from palpate.workflow.start import lock_folder
lock_folder(sys.argv[1], warn=print)
print("on", flush=True)
time.sleep(60)
"""


def python(root, folder, *words):
    """A process of Python's, once it has said the first line: on."""
    env = os.environ | {"PYTHONPATH": str(root / "workflow/scripts")}
    how = {"env": env, "cwd": folder, "stdout": subprocess.PIPE, "text": True}
    process = subprocess.Popen([sys.executable, "-c", *words], **how)
    assert process.stdout.readline() == "on\n"
    return process


@pytest.mark.parametrize("how", ["direct", "shell"])
def test_a_job_ends_with_its_run(root, tmp_path, how):
    owner = python(root, tmp_path, START, JOB, how, OWNER)
    owner.kill()
    owner.wait()
    # The pipe ends when the last process that holds it does: the job.
    assert owner.communicate(timeout=ENDS_S)[0] == ""


@pytest.fixture
def capture(tmp_path):
    folder = tmp_path / "08"
    folder.mkdir()
    (folder / "force.csv").write_text("time_s\n")
    return folder


def ended(main, capture, folder, *, log="log.txt", **params):
    """Run a main function as a script would: its exit status."""
    job = SimpleNamespace(
        rule="mask", wildcards=["08"], log=folder / log, input=Named(capture=str(capture)),
        params=Named(**params), output=Named(mask=str(folder / "mask.npz")),
    )  # fmt: skip
    try:
        run(main, job)
    except SystemExit as end:
        return end.code
    return 0


def replaced(capture):
    """Put a file of the same size and time in the place of one."""
    path, status = capture / "force.csv", (capture / "force.csv").stat()
    (capture / "new").write_text("time-s\n")
    os.utime(capture / "new", ns=(status.st_atime_ns, status.st_mtime_ns + 1))
    os.replace(capture / "new", path)


def gone(capture):
    (capture / "force.csv").unlink()
    raise OSError("force.csv: gone")


@pytest.mark.parametrize("change", [replaced, gone])
def test_a_job_whose_capture_changes_meanwhile_fails(capture, tmp_path, capfd, change):
    assert ended(lambda snakemake: None, capture, tmp_path) == 0
    assert ended(lambda snakemake: change(capture), capture, tmp_path) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith(f"error: mask/08: {capture}: expected to stay as it is during the run")
    assert (tmp_path / "log.txt").read_text() == f"{line}\n"
    # Since the run began.
    seen = {str(capture): "another"}
    assert ended(lambda snakemake: None, capture, tmp_path, content=seen) == 1
    assert "08: expected to stay as it is" in capfd.readouterr().err


def test_a_log_without_space_is_one_line(capture, tmp_path, capfd):
    assert ended(lambda snakemake: print("much"), capture, tmp_path, log="/dev/full") == 1
    line = "error: mask/08: [Errno 28] No space left on device: '/dev/full' (log: /dev/full)\n"
    assert capfd.readouterr().err == line


def test_a_defect_is_one_line_and_its_traceback_is_in_the_log(capture, tmp_path, capfd):
    assert ended(lambda snakemake: {}["points"], capture, tmp_path) == 1
    (line,) = capfd.readouterr().err.splitlines()
    log = tmp_path / "log.txt"
    assert line == f"error: mask/08: KeyError: 'points' (a defect; traceback in {log})"
    assert "Traceback (most recent call last):" in log.read_text()
    assert log.read_text().endswith(f"{line}\n")


def test_ctrl_c_is_left_to_snakemake_to_say(capture, tmp_path, capfd):
    def stop(snakemake):
        raise KeyboardInterrupt

    assert ended(stop, capture, tmp_path) == 1
    assert capfd.readouterr().err == ""
    assert (tmp_path / "log.txt").read_text().startswith("error: mask/08: stopped")


def test_jobs_use_one_thread_whatever_is_exported(monkeypatch):
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    for name in names:
        monkeypatch.setenv(name, "8")
    assert [environment("scripts")[name] for name in names] == ["1", "1", "1"]


@pytest.fixture
def holder(root, tmp_path):
    """Another process that holds a folder."""
    process = python(root, tmp_path, HOLD, str(tmp_path / "results"))
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
