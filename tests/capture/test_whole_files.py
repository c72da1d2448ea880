"""Files are whole or not there, however many write them and whatever ends the writing."""

import errno
import os
import random
import subprocess
import sys
import time

import pytest
from palpate.capture.files import remove_parts, whole_file, whole_folder

KILLED = """
import os, sys
from pathlib import Path
from palpate.capture.files import whole_file, whole_folder
place = Path(sys.argv[1])
with whole_folder(place / "b-dir") as folder, whole_file(place / "a.csv") as a:
    (folder / "000000.png").touch()
    a.write_text("half")
    os._exit(9)
"""


WRITES = """
import sys
from palpate.capture.files import whole_file
for k in range(10**9):
    with whole_file(sys.argv[1]) as part:
        part.write_text(str(k % 10) * 300_000)
    if not k:
        print("on", flush=True)
"""


def started(root, code, place, **options):
    """A process that runs code on a place."""
    env = os.environ | {"PYTHONPATH": str(root / "workflow/scripts")}
    return subprocess.Popen([sys.executable, "-c", code, str(place)], env=env, **options)


def test_a_writer_killed_at_any_moment_leaves_a_whole_file(root, tmp_path):
    rng = random.Random(0)
    for _ in range(6):
        writer = started(root, WRITES, tmp_path / "a.txt", stdout=subprocess.PIPE)
        with writer.stdout as stream:
            assert stream.readline() == b"on\n"
            time.sleep(rng.uniform(0, 0.05))
            writer.kill()
            writer.wait()
        text = (tmp_path / "a.txt").read_text()
        assert text == text[0] * 300_000


def test_two_writers_never_mix(tmp_path):
    path = tmp_path / "a.csv"
    with whole_file(path) as slow:
        assert slow.suffix == ".csv" and slow.name.startswith(".")
        slow.write_text("slow" * 1000)
        with whole_file(path) as quick:
            quick.write_text("quick")
        assert path.read_text() == "quick"
        assert slow.read_text() == "slow" * 1000
    assert path.read_text() == "slow" * 1000
    assert os.listdir(tmp_path) == ["a.csv"]


def test_two_writers_of_a_folder_leave_a_whole_one(tmp_path):
    path = tmp_path / "capture"
    with whole_folder(path) as slow:
        assert slow.name.startswith(".") and not path.exists()
        (slow / "slow.png").touch()
        with whole_folder(path) as quick:
            (quick / "quick.png").touch()
    assert [p.name for p in path.iterdir()] == ["slow.png"]
    assert os.listdir(tmp_path) == ["capture"]


def test_what_a_killed_writer_left_is_removed(root, tmp_path):
    deep = tmp_path / "deep"
    started(root, KILLED, deep).wait()
    assert sorted(name[-5:] for name in os.listdir(deep)) == ["a.csv", "b-dir"]
    (deep / "kept.csv").touch()
    remove_parts(tmp_path, unless="lock")
    assert os.listdir(deep) == ["kept.csv"]


def test_parts_of_another_run_stay(tmp_path):
    for place in (tmp_path, tmp_path / "other"):
        place.mkdir(exist_ok=True)
        (place / "lock").touch()
        (place / ".part-0-a.csv").touch()
    remove_parts(tmp_path, unless="lock")
    assert sorted(os.listdir(tmp_path)) == ["lock", "other"]
    assert sorted(os.listdir(tmp_path / "other")) == [".part-0-a.csv", "lock"]


def test_what_is_kept_never_moves(tmp_path):
    """Not even where the folder is a link, and where the block fails."""
    there = tmp_path / "there"
    (there / "background").mkdir(parents=True)
    (there / "background/0.png").write_text("mine")
    (link := tmp_path / "01").symlink_to(there)
    with pytest.raises(ZeroDivisionError):
        with whole_folder(link, replace=False, kept="background"):
            raise ZeroDivisionError
    with whole_folder(link, replace=False, kept="background") as part:
        (part / "color").mkdir()
        (part / "frames.csv").write_text("frame")
    assert sorted(one.name for one in there.iterdir()) == ["background", "color", "frames.csv"]
    assert (there / "background/0.png").read_text() == "mine"
    with pytest.raises(ValueError, match="expected nothing there yet"):
        with whole_folder(link, replace=False, kept="background"):
            pass


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_names_the_file(tmp_path, number):
    words = os.strerror(number)
    with pytest.raises(OSError, match=f"{words}: .*a.csv"), whole_file(tmp_path / "a.csv"):
        raise OSError(number, words)
    assert not os.listdir(tmp_path)


def test_a_full_disk_elsewhere_is_not_this_file(tmp_path):
    with pytest.raises(OSError, match="'b.log'"), whole_file(tmp_path / "a.csv"):
        raise OSError(errno.ENOSPC, "No space left on device", "b.log")


def test_a_block_that_writes_nothing_leaves_what_was_there(tmp_path):
    (tmp_path / "a.csv").write_text("old")
    with pytest.raises(FileNotFoundError), whole_file(tmp_path / "a.csv"):
        pass
    assert (tmp_path / "a.csv").read_text() == "old"


def test_files_are_whole_or_absent(tmp_path):
    with pytest.raises(RuntimeError), whole_file(tmp_path / "a.csv") as part:
        part.write_text("half")
        raise RuntimeError
    with pytest.raises(RuntimeError), whole_folder(tmp_path / "b") as part:
        (part / "c").write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
