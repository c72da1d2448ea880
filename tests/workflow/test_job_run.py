"""A job ends with its run, says in one line what went wrong, and wants inputs that stay."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
from palpate.workflow.job import OWNER, run
from palpate.workflow.start import environment
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


@pytest.mark.parametrize("how", ["direct", "shell"])
def test_a_job_ends_with_its_run(root, tmp_path, how):
    owner = subprocess.Popen(
        [sys.executable, "-c", START, JOB, how, OWNER],
        env=os.environ | {"PYTHONPATH": str(root / "workflow/scripts")},
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert owner.stdout.readline() == "on\n"
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


def test_a_capture_changed_since_the_run_began(capture, tmp_path, capfd):
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
