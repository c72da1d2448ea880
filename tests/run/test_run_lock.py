"""One run at a time, and a lock that no dead process holds."""

import errno
import json
import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest
from palpate.run import lock as run_lock

HOLD = """
import sys, time
from palpate.run.lock import lock_folder
lock_folder(sys.argv[1], warn=print)
print("held", flush=True)
time.sleep(60)
"""


@pytest.fixture
def holder(root, tmp_path):
    """Another process that holds a folder."""
    paths = os.pathsep.join(str(root / "workflow" / part) for part in ("", "scripts"))
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path / "results")],
        env=os.environ | {"PYTHONPATH": paths},
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.fixture(autouse=True)
def free(monkeypatch):
    """Let go of this process's locks after a test."""
    monkeypatch.setattr(run_lock, "_descriptors", [])
    for name in (run_lock.INPUTS, run_lock.RUN):
        monkeypatch.setenv(name, "")
    yield
    for descriptor in run_lock._descriptors:
        os.close(descriptor)


def test_a_held_folder_is_refused_by_name_of_its_holder(holder, tmp_path):
    with pytest.raises(ValueError, match=f"no other run at work, found one .process {holder.pid} "):
        run_lock.lock_folder(tmp_path / "results", warn=print)


def test_a_lock_ends_with_its_process(holder, tmp_path):
    holder.send_signal(signal.SIGKILL)
    holder.wait()
    run_lock.lock_folder(tmp_path / "results", warn=print)
    assert f"process {os.getpid()} " in (tmp_path / "results" / run_lock.LOCK).read_text()


def test_a_plan_from_while_another_run_was_at_work_is_refused(holder, tmp_path):
    """What was planned then is what that run had not made yet."""
    folder = str(tmp_path / "results")
    last = run_lock.last_holders(folder)
    holder.kill()
    holder.wait()
    with pytest.raises(ValueError, match=f"since this one was planned, found one .*{holder.pid} "):
        run_lock.lock_folder(folder, last=last, warn=print)
    run_lock.lock_folder(folder, last=run_lock.last_holders(folder), warn=print)


def test_a_plan_from_before_another_run_is_refused(tmp_path, request):
    folder = str(tmp_path / "results")
    last = run_lock.last_holders(folder)
    run = request.getfixturevalue("holder")
    run.kill()
    run.wait()
    with pytest.raises(ValueError, match="since this one was planned"):
        run_lock.lock_folder(folder, last=last, warn=print)


def test_objects_runs_share_what_an_ordinary_run_holds_alone(tmp_path):
    for _ in range(2):
        run_lock.lock_folder(tmp_path, shared=True, warn=print)
    with pytest.raises(ValueError, match="expected no other run at work"):
        run_lock.lock_folder(tmp_path, warn=print)


def test_a_look_leaves_nothing(tmp_path):
    assert run_lock.last_holders(str(tmp_path / "results")) == {str(tmp_path / "results"): ""}
    assert not (tmp_path / "results").exists()


def test_a_folder_that_can_not_be_written_to(tmp_path):
    (tmp_path / "results").touch()
    with pytest.raises(ValueError, match="results: expected a folder to write into, found"):
        run_lock.lock_folder(tmp_path / "results", warn=print)


def test_a_file_system_without_locks_is_told(tmp_path, monkeypatch):
    def none(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(run_lock.fcntl, "flock", none)
    told = []
    run_lock.lock_folder(tmp_path, warn=told.append)
    assert told == [f"{tmp_path}: this file system has no locks; see that no other run works on it"]


def test_a_run_writes_down_what_it_did_not_make(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "object.yaml").write_text("unit: m\n")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / ".part-0-a.csv").touch()
    written = {"log": ["results/a.log"], "benchmark": "results/a.tsv"}
    made = SimpleNamespace(input=["raw/object.yaml", "raw/08"], output=["results/a.csv"], **written)
    read = ["results/a.csv", *written["log"], written["benchmark"]]
    last = SimpleNamespace(input=read, output=["results/b.csv"], log=[], benchmark=None)
    run_lock.begin_run(
        [made, last],
        iter([made, last]),
        results="results",
        raw="raw",
        seen={"raw/08": "seen"},
        last={},
        warn=print,
    )
    begun = json.loads((tmp_path / os.environ[run_lock.INPUTS]).read_text())
    inputs = begun["inputs"]
    assert inputs["raw/08"] == "seen"
    assert inputs["raw/object.yaml"].startswith("8 ")
    assert set(inputs) == {"raw/08", "raw/object.yaml"}
    assert begun["run"] == os.environ[run_lock.RUN] != ""
    assert sorted(os.listdir("results")) == [run_lock.BEGUN, run_lock.LOCK]
    assert not (tmp_path / "raw" / run_lock.LOCK).exists()


def test_a_run_of_the_lab_holds_raw_too(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lab = SimpleNamespace(input=[], output=["raw/block/object.yaml"], log=[], benchmark=None)
    run_lock.begin_run([lab], [lab], results="results", raw="raw", seen={}, last={}, warn=print)
    assert (tmp_path / "raw" / run_lock.LOCK).exists()


def test_each_run_has_a_number_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers = set()
    for folder in ("results", "results/objects"):
        run_lock.begin_run([], [], results=folder, raw="raw", seen={}, last={}, warn=print)
        numbers.add(os.environ[run_lock.RUN])
    assert len(numbers) == 2


def test_parts_of_the_objects_runs_are_not_an_ordinary_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_lock.begin_run([], [], results="results/objects", raw="raw", seen={}, last={}, warn=print)
    kept = [tmp_path / f"results/objects/{name}.part-0-a.csv" for name in ("", "cushion/")]
    gone = tmp_path / "results/block/.part-0-a.csv"
    for path in (*kept, gone):
        path.parent.mkdir(exist_ok=True)
        path.touch()
    run_lock.begin_run([], [], results="results", raw="raw", seen={}, last={}, warn=print)
    assert all(path.exists() for path in kept) and not gone.exists()
