"""Files are whole or not there, whatever ends the writing; tables keep their numbers."""

import errno
import os
import random
import subprocess
import sys
import time

import numpy as np
import pandas as pd
import pytest
from palpate.capture.files import remove_parts, whole_file, whole_folder
from palpate.capture.tables import (
    as_written,
    read_force,
    read_frames,
    read_table,
    write_force,
    write_frames,
    write_table,
)

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
    path, capture = tmp_path / "a.csv", tmp_path / "capture"
    with whole_file(path) as slow, whole_folder(capture) as folder:
        assert slow.suffix == ".csv" and slow.name.startswith(".")
        assert folder.name.startswith(".") and not capture.exists()
        slow.write_text("slow" * 1000)
        (folder / "slow.png").touch()
        with whole_file(path) as quick, whole_folder(capture) as other:
            quick.write_text("quick")
            (other / "quick.png").touch()
        assert path.read_text() == "quick"
        assert slow.read_text() == "slow" * 1000
    assert path.read_text() == "slow" * 1000
    assert os.listdir(capture) == ["slow.png"]
    assert sorted(os.listdir(tmp_path)) == ["a.csv", "capture"]


def test_what_a_killed_writer_left_is_removed(root, tmp_path):
    deep = tmp_path / "deep"
    started(root, KILLED, deep).wait()
    assert sorted(name[-5:] for name in os.listdir(deep)) == ["a.csv", "b-dir"]
    (deep / "kept.csv").touch()
    remove_parts(tmp_path, unless="lock")
    assert os.listdir(deep) == ["kept.csv"]


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


FULL = [OSError(number, os.strerror(number)) for number in (errno.ENOSPC, errno.EDQUOT)]


@pytest.mark.parametrize("error", [RuntimeError(), *FULL])
def test_files_are_whole_or_absent_and_a_full_disk_names_the_file(tmp_path, error):
    path, line = tmp_path / "a.csv", f"{error.strerror}: .*a.csv" if error in FULL else "^$"
    with pytest.raises(type(error), match=line), whole_file(path) as part:
        part.write_text("half")
        raise error
    with pytest.raises(type(error)), whole_folder(tmp_path / "b") as part:
        (part / "c").write_text("half")
        raise error
    assert list(tmp_path.iterdir()) == []


STEPS_S = np.arange(5) / 30


@pytest.mark.parametrize("start_s", [-0.3, 0.0, 999.99, 1712345678.25])
def test_times_keep_a_microsecond_and_are_read_from_the_first_frame_on(tmp_path, start_s):
    """A table that is read and written again has the same bytes."""
    force = pd.DataFrame({"time_s": start_s + np.arange(-5, 50) / 200, "fx_n": 1.0})
    files = [f"{k:06d}.png" for k in range(5)]
    frames = {"frame": range(5), "time_s": start_s + STEPS_S, "left": files, "right": files}
    write_frames(tmp_path, pd.DataFrame(frames))
    write_force(tmp_path, force)
    assert np.abs(read_table(tmp_path / "frames.csv")["time_s"] - start_s - STEPS_S).max() <= 1e-6
    frames_s, force_s = (read(tmp_path)["time_s"] for read in (read_frames, read_force))
    assert frames_s[0] == 0 and frames_s.to_numpy() == pytest.approx(STEPS_S, abs=2e-6)
    assert force_s.to_numpy() == pytest.approx(np.arange(-5, 50) / 200, abs=2e-6)
    first = (tmp_path / "frames.csv").read_bytes()
    write_frames(tmp_path, read_table(tmp_path / "frames.csv"))
    assert (tmp_path / "frames.csv").read_bytes() == first
    assert b"\r" not in first


def test_a_table_as_written_is_what_is_read_back(tmp_path):
    time_s, forces_n = 1712345678.25 + STEPS_S, np.array([0.1 + 0.2, 1e-12, -1234.5, np.pi, 3e5])
    table = pd.DataFrame({"time_s": time_s, "fx_n": forces_n, "n": range(5)})
    write_table(tmp_path / "a.csv", table)
    found = read_table(tmp_path / "a.csv")
    pd.testing.assert_frame_equal(as_written(table), found)
    assert not table.equals(found)
    assert found["fx_n"].to_numpy() == pytest.approx(forces_n, rel=1e-8, abs=0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "file: expected a CSV table, found nothing"),
        (b"", "file: expected a CSV table"),
        (b"\xff\xfe\x00a", "file: expected a CSV table"),
        (b"time_s,v0\n0,1,2\n1,2,3\n", "rows: expected as many cells as column names, found more"),
        (b"time_s,v0,time_s\n0,1,2\n", "columns: expected each name once, found time_s twice"),
        (b"time_s" + b",v" * 5000 + b"\n", "columns: expected at most 1000, found 5001"),
        (b'time_s,v0\n0,"1\n', "file: expected a CSV table, found none"),
    ],
)
def test_no_table_or_one_whose_columns_are_unsure(tmp_path, content, words):
    if content is not None:
        (tmp_path / "force.csv").write_bytes(content)
    with pytest.raises(ValueError, match=f"force.csv: {words}"):
        read_force(tmp_path)


def test_a_comma_at_the_end_of_rows_shifts_no_column(tmp_path):
    (tmp_path / "force.csv").write_text("time_s,v0\n0,1,\n1,2,\n")
    table = read_table(tmp_path / "force.csv")
    assert table.to_dict("list") == {"time_s": [0, 1], "v0": [1, 2]}
