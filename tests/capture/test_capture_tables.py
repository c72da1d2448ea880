"""Tables: round trips, numbers that keep their worth, whole or absent."""

import numpy as np
import pandas as pd
import pytest
from palpate.capture.tables import (
    as_written,
    read_force,
    read_frames,
    read_table,
    write_force,
    write_frames,
    write_table,
)

STEPS_S = np.arange(5) / 30


def frames_table(start_s=0.0):
    files = [f"{k:06d}.png" for k in range(5)]
    return pd.DataFrame(
        {"frame": range(5), "time_s": start_s + STEPS_S, "left": files, "right": files}
    )


@pytest.mark.parametrize("start_s", [-0.3, 0.0, 999.99, 1712345678.25])
def test_times_keep_a_microsecond_and_are_read_from_the_first_frame_on(tmp_path, start_s):
    force = pd.DataFrame({"time_s": start_s + np.arange(-5, 50) / 200, "fx_n": 1.0})
    write_frames(tmp_path, frames_table(start_s))
    write_force(tmp_path, force)
    assert np.abs(read_table(tmp_path / "frames.csv")["time_s"] - start_s - STEPS_S).max() <= 1e-6
    frames_s, force_s = (read(tmp_path)["time_s"] for read in (read_frames, read_force))
    assert frames_s[0] == 0 and frames_s.to_numpy() == pytest.approx(STEPS_S, abs=2e-6)
    assert force_s.to_numpy() == pytest.approx(np.arange(-5, 50) / 200, abs=2e-6)


def test_round_trip_of_frames_is_exact_in_bytes(tmp_path):
    write_frames(tmp_path, frames_table(1712345678.25))
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
    assert not table.equals(found) and found["fx_n"].to_numpy() == pytest.approx(
        forces_n, rel=1e-8, abs=0
    )


def test_failed_write_leaves_the_old_table(tmp_path):
    class Broken(pd.DataFrame):
        def to_csv(self, part, **options):
            part.write_text("half")
            raise RuntimeError

    write_frames(tmp_path, frames_table())
    before = (tmp_path / "frames.csv").read_bytes()
    with pytest.raises(RuntimeError):
        write_frames(tmp_path, Broken(frames_table()))
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [before]


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
