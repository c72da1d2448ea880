"""A job ends with its run, and makes nothing of inputs that do not stay as they are."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import palpate.run.job as job_module
import pytest
from palpate.run import job_run
from palpate.run.job import run
from palpate.run.job_run import INPUTS, OWNER, RUN, Inputs, Run
from stand_in import Named

SLEEP = """
import os, sys, time
from palpate.run import job_run
job_run.SUPERSEDED_S = 0.1
def refused(pid):
    raise OSError(24, "Too many open files")
if "refused" in sys.argv:
    os.pidfd_open = refused
job_run.end_with_run()
print("on", flush=True)
time.sleep(60)
"""
ENDS_S = 20.0


def began(path, number):
    """What a run writes down when it begins."""
    path.write_text(json.dumps({"run": number, "inputs": {}}))
    return path


@pytest.fixture(params=["", "refused"], ids=["descriptors", "no descriptors"])
def orphan(root, tmp_path, request):
    """A process that stands for a job, and one that stands for its run."""
    begun = began(tmp_path / ".run.json", "1")
    owner = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    child = subprocess.Popen(
        [sys.executable, "-c", SLEEP, request.param],
        env=os.environ
        | {
            "PYTHONPATH": str(root / "workflow/scripts"),
            OWNER: f"{owner.pid} {socket.gethostname()}",
            INPUTS: str(begun),
            RUN: "1",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert child.stdout.readline() == "on\n"
    yield owner, child
    for process in (owner, child):
        process.kill()
        process.wait()
    child.stdout.close()
    child.stderr.close()


def test_a_job_ends_with_its_run(orphan):
    owner, child = orphan
    time.sleep(0.2)
    assert child.poll() is None
    owner.send_signal(signal.SIGKILL)
    owner.wait()
    assert child.wait(timeout=ENDS_S) == 1


def test_a_job_ends_when_another_run_begins(orphan, tmp_path):
    child = orphan[1]
    time.sleep(0.5)
    assert child.poll() is None
    began(tmp_path / "new", "22").replace(tmp_path / ".run.json")
    assert child.wait(timeout=ENDS_S) == 1
    line = f"error: {tmp_path}/.run.json: expected run 1, found run 22 begun since\n"
    assert child.stderr.read() == line


@pytest.mark.parametrize("text", [None, "", "{}", "[]", '{"run": "1", "inputs": {}}'])
def test_a_run_that_is_the_last_goes_on(text, tmp_path, monkeypatch):
    monkeypatch.setattr(job_run.os, "_exit", lambda code: pytest.fail("ended"))
    if text is not None:
        (tmp_path / ".run.json").write_text(text)
    Run(tmp_path / ".run.json", "1").end_if_superseded()
    Run(tmp_path / ".run.json", "").end_if_superseded()


def test_a_job_without_a_run_is_left_alone(monkeypatch):
    monkeypatch.delenv(OWNER, raising=False)
    monkeypatch.setattr(job_run.threading, "Thread", None)
    job_run.end_with_run()


def test_a_run_of_another_machine_is_not_watched(monkeypatch):
    watched = []
    monkeypatch.setenv(OWNER, "1 elsewhere")
    monkeypatch.setenv("PYTHONPATH", "")
    monkeypatch.setattr(
        job_run.threading.Thread, "start", lambda self: watched.append(self._args[0])
    )
    job_run.own_run("scripts")
    assert watched == [[os.getppid()]]
    assert os.environ[OWNER] == f"{os.getpid()} {socket.gethostname()}"


@pytest.fixture
def capture(tmp_path, monkeypatch):
    monkeypatch.delenv(INPUTS, raising=False)
    folder = tmp_path / "08"
    folder.mkdir()
    (folder / "force.csv").write_text("time_s\n")
    return folder


def test_inputs_that_stay(capture):
    Inputs([str(capture), None, []]).require_unchanged()


def test_a_file_changed_while_it_is_read(capture):
    inputs = Inputs([capture / "force.csv"])
    (capture / "force.csv").write_text("time_s\n0\n")
    with pytest.raises(ValueError, match="force.csv: expected to stay while it is read, found"):
        inputs.require_unchanged()


def test_a_file_replaced_by_one_of_its_size_and_time(capture):
    path = capture / "force.csv"
    inputs = Inputs([path])
    status = path.stat()
    (capture / "new").write_text("time-s\n")
    os.utime(capture / "new", ns=(status.st_atime_ns, status.st_mtime_ns))
    os.replace(capture / "new", path)
    with pytest.raises(ValueError, match="expected to stay"):
        inputs.require_unchanged()


def test_a_capture_changed_since_the_run_began(capture, tmp_path, monkeypatch):
    (tmp_path / "run.json").write_text(
        json.dumps({"run": "1", "inputs": {str(capture): "another"}})
    )
    monkeypatch.setenv(INPUTS, str(tmp_path / "run.json"))
    with pytest.raises(ValueError, match="08: expected as it was when the run began, found"):
        Inputs([str(capture)])


def ended(main, capture, folder):
    """Run a main function as a script would, and give the job."""
    job = SimpleNamespace(
        rule="mask",
        wildcards=["08"],
        log=folder / "log.txt",
        input=Named(capture=str(capture)),
        output=Named(mask=str(folder / "mask.npz")),
    )
    with pytest.raises(SystemExit) as end:
        run(main, job)
    assert end.value.code == 1


@pytest.mark.parametrize("fails", [False, True], ids=["makes a result", "trips over it"])
def test_nothing_is_made_of_a_capture_changed_meanwhile(capture, tmp_path, capfd, fails):
    def main(snakemake):
        (capture / "force.csv").unlink()
        if fails:
            raise OSError("force.csv: gone")
        (tmp_path / "mask.npz").write_bytes(b"mixed")

    ended(main, capture, tmp_path)
    line = f"error: mask/08: {capture}: expected to stay while it is read, found it changed"
    assert capfd.readouterr().err.startswith(line)
    assert not (tmp_path / "mask.npz").exists()


def test_a_log_without_space_is_one_line(capture, tmp_path, capfd):
    job = SimpleNamespace(
        rule="mask", wildcards=["08"], log="/dev/full", input=Named(), output=Named()
    )
    with pytest.raises(SystemExit):
        run(lambda snakemake: print("much"), job)
    (line,) = capfd.readouterr().err.splitlines()
    assert (
        line == "error: mask/08: [Errno 28] No space left on device: '/dev/full' (log: /dev/full)"
    )


SCRIPT = """
from types import SimpleNamespace
snakemake = SimpleNamespace(rule="mask", wildcards=["08"], log="logs/08.log", input=[], output=[])
from palpate.run.job import run
def main(snakemake):
    print("seen")
    {line}
{before}
run(main, snakemake)
"""


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ({"line": "support_points()", "before": ""}, "NameError: name 'support_points' is not"),
        ({"line": "", "before": "import nothing_such"}, "ModuleNotFoundError: No module named"),
    ],
    ids=["in main", "at an import"],
)
def test_a_defect_is_one_line_and_its_traceback_is_in_the_log(root, tmp_path, lines, said):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(**lines)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(root / "workflow/scripts")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: mask/08: {said}")
    assert line.endswith("(a defect; traceback in logs/08.log)")
    log = (tmp_path / "logs/08.log").read_text()
    assert "Traceback (most recent call last):" in log and log.endswith(f"{line}\n")


def test_a_defect_outside_a_job_is_told_as_ever(capfd):
    try:
        raise TypeError("odd")
    except TypeError as error:
        job_module.tell_defect(type(error), error, error.__traceback__)
    assert "Traceback" in capfd.readouterr().err
