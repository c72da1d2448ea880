"""Kills, full and read-only disks, captures changed meanwhile: then one plain run finishes."""

import os
import random
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1]))
import faults
from palpate.workflow.progress import GOES_ON

pytestmark = [pytest.mark.workflow, pytest.mark.long]
KINECT = "results/sample/foam_block/kinect"
TARGETS = [f"{KINECT}/08/mask.npz", "results/sample/figures/figure_3_1.png"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Digests of an undisturbed run, and the folder that it ran in."""
    folder = faults.make_copy(tmp_path_factory.mktemp("faults") / "main")
    assert faults.Run(folder, TARGETS).wait() == 0
    return faults.digests(folder), folder


@pytest.fixture
def folder(whole):
    """The project without results."""
    faults.forget(whole[1])
    return whole[1]


def finished(folder):
    """A plain run, and what it leaves."""
    run = faults.Run(folder, TARGETS)
    assert run.wait() == 0, run.lines[-20:]
    assert faults.leftovers(folder) == []
    return faults.digests(folder)


def refusal(folder):
    """What a run that fails says."""
    run = faults.Run(folder, TARGETS)
    assert run.wait() == 1
    return run.lines


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


def test_kills_of_each_kind(whole, folder):
    kills = []
    said = faults.one_pass(folder, TARGETS, kills, attempt=1, budget=3, rng=random.Random(4))
    assert said == ""
    assert {kill.kind for kill in kills} <= set(faults.KINDS)
    assert not [kill for kill in kills if "lived on" in kill.outcome]
    assert faults.digests(folder) == whole[0]
    assert faults.leftovers(folder) == []


def test_a_run_that_is_asked_to_end_says_how_it_goes_on(whole, folder):
    run = faults.Run(folder, TARGETS)
    assert run.begun.wait(faults.GIVE_UP_S)
    run.process.terminate()
    assert run.wait() == 1
    assert run.lines.count(GOES_ON) == 1
    assert finished(folder) == whole[0]


def test_a_full_disk_is_one_line_and_then_a_plain_run_finishes(whole, folder):
    results = folder / "results/sample"
    results.mkdir(parents=True)
    with mounted("-t", "tmpfs", "-o", "size=256k", "tmpfs", str(results)):
        lines = refusal(folder)
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
        lines = refusal(folder)
        assert (
            "error: results/sample: expected a folder to write into, found read-only file system"
            in lines
        )
        assert not any(faults.STARTED.match(line) for line in lines)
        assert not os.listdir(results)


def test_a_capture_replaced_after_the_check(whole, folder):
    capture = folder / "tests/sample/raw/foam_block/kinect/08"
    kept = folder / "kept"
    shutil.copytree(capture, kept)
    run = faults.Run(folder, TARGETS)
    assert run.begun.wait(faults.GIVE_UP_S)
    os.utime(capture / "force.csv", ns=(time.time_ns(), time.time_ns()))
    assert run.wait() == 1
    told = [line for line in run.lines if line.startswith("error: mask/")]
    assert len(told) == 1
    assert "kinect/08: expected to stay as it is during the run, found it changed" in told[0]
    assert not (folder / KINECT / "08/mask.npz").exists()
    assert finished(folder) == whole[0]
