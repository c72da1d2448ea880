"""Kills, full and read-only disks, captures changed meanwhile: then one plain run finishes."""

import os
import random
import shutil
import subprocess
import time
from contextlib import contextmanager

import faults
import pytest
from palpate.workflow.progress import GOES_ON

pytestmark = [pytest.mark.workflow, pytest.mark.long]
KINECT = "results/sample/foam_block/kinect"
TARGETS = [f"{KINECT}/08/mask.npz", "results/sample/figures/figure_3_1.png"]
GIVE_UP_S = 300


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Digests of an undisturbed run, and the folder that it ran in."""
    folder = faults.make_copy(tmp_path_factory.mktemp("faults") / "main")
    assert status(faults.Run(folder, TARGETS)) == 0
    return faults.digests(folder), folder


@pytest.fixture
def folder(whole):
    """The project without results."""
    faults.forget(whole[1])
    return whole[1]


def status(run):
    """Exit status of a run, once it has ended."""
    assert run.ended(GIVE_UP_S)
    return run.process.returncode


def wait_for(reached):
    """Wait until a run is at some point."""
    until = time.monotonic() + GIVE_UP_S
    while not reached():
        assert time.monotonic() < until
        time.sleep(0.1)


def finished(folder):
    """A plain run, and what it leaves."""
    run = faults.Run(folder, TARGETS)
    assert status(run) == 0, run.lines()[-20:]
    assert faults.leftovers(folder) == []
    return faults.digests(folder)


def rejection(folder):
    """What a run that fails says."""
    run = faults.Run(folder, TARGETS)
    assert status(run) == 1
    return run.lines()


@contextmanager
def mounted(*arguments):
    """A mount for a while; the test is skipped where there can be none."""
    place = arguments[-1]
    done = subprocess.run(["mount", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"no mounts here: {done.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


@pytest.mark.parametrize(
    ("kind", "outcome"),
    [
        ("snakemake", "its jobs ended"),
        ("job", "expected it to be made, found that its job ended without a word"),
        ("group", "its jobs ended"),
    ],
)
def test_a_plain_run_finishes_after_a_kill(whole, folder, kind, outcome):
    run = faults.Run(folder, TARGETS)
    wait_for(run.jobs)
    struck, *_, last = faults.strike(run, kind, random.Random(4)).split(" | ")
    assert struck == kind and outcome in last
    assert status(run) != 0
    assert finished(folder) == whole[0]


def test_a_plain_run_finishes_after_a_kill_while_another_started(whole, folder):
    run = faults.Run(folder, TARGETS)
    assert not run.ended(within_s=1.0)
    assert faults.strike(run, "job", random.Random(4)) == "snakemake | - | - | its jobs ended"
    assert finished(folder) == whole[0]


def test_a_run_that_is_asked_to_end_says_how_it_goes_on(whole, folder):
    run = faults.Run(folder, TARGETS)
    wait_for(lambda: run.steps() != "-")
    run.process.terminate()
    assert status(run) == 1
    assert run.lines().count(GOES_ON) == 1
    assert finished(folder) == whole[0]


def test_a_full_disk_is_one_line_and_then_a_plain_run_finishes(whole, folder):
    results = folder / "results/sample"
    results.mkdir(parents=True)
    with mounted("-t", "tmpfs", "-o", "size=256k", "tmpfs", str(results)):
        lines = rejection(folder)
        told = [line for line in lines if line.startswith("error: ")]
        assert len(told) in (1, 2)
        assert all("[Errno 28] No space left on device: 'results/sample/" in line for line in told)
        assert set(faults.digests(folder).items()) <= set(whole[0].items())
        subprocess.run(["mount", "-o", "remount,size=64m", str(results)], check=True)
        assert finished(folder) == whole[0]


def test_a_read_only_folder_is_refused_before_any_job(folder):
    results = folder / "results/sample"
    results.mkdir(parents=True)
    with mounted("--bind", str(results), str(results)):
        subprocess.run(["mount", "-o", "remount,ro,bind", str(results)], check=True)
        lines = rejection(folder)
        assert (
            "error: results/sample: expected a folder to write into, found read-only file system"
            in lines
        )
        assert not faults.STEPS.search("\n".join(lines))
        assert not os.listdir(results)


def test_a_capture_replaced_after_the_check(whole, folder):
    capture = folder / "tests/sample/raw/foam_block/kinect/08"
    kept = folder / "kept"
    shutil.copytree(capture, kept)
    run = faults.Run(folder, TARGETS)
    wait_for(lambda: run.steps() != "-")
    os.utime(capture / "force.csv", ns=(time.time_ns(), time.time_ns()))
    assert status(run) == 1
    told = [line for line in run.lines() if line.startswith("error: mask/")]
    assert len(told) == 1
    assert "kinect/08: expected to stay as it is during the run, found it changed" in told[0]
    assert not (folder / KINECT / "08/mask.npz").exists()
    assert finished(folder) == whole[0]
