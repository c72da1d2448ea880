"""Records of forces as cheap instruments write them: in bursts, in volts and newtons at once."""

import shutil

import numpy as np
import pandas as pd
import pytest
from palpate.capture.capture import open_capture
from palpate.capture.check import check_object
from palpate.capture.check_capture import check_capture
from palpate.capture.importing.recording import force_table
from palpate.capture.tables import (
    GAUGE_COLUMNS,
    WRENCH_COLUMNS,
    force_columns,
    read_force,
    read_table,
    sampled_s,
    write_force,
    write_frames,
)
from palpate.examine import told_of
from palpate.press import press_of
from palpate.vision.force import FORCE, zeroed
from palpate.vision.indentation import capture_wrenches, match_nearest
from palpate.vision.options import Force, ProbePose
from palpate.workflow.options import Config

REGULAR = np.arange(2000) / 1000
CORNERS = Config(probe_pose=ProbePose(refinement="corners"))


def in_bursts(times, count, within_s=0.0):
    """Stamps of samples that are handed out by the dozen, as the last of them is taken."""
    last = np.minimum((np.arange(len(times)) // count + 1) * count, len(times)) - 1
    return times[last] + within_s * (np.arange(len(times)) - last)


@pytest.mark.parametrize("within_s", [0.0, 2e-6, 5e-5])
@pytest.mark.parametrize("count", [2, 10, 50, 100, 200])
def test_bursts_are_spread(count, within_s):
    found, size = sampled_s(in_bursts(REGULAR, count, within_s))
    assert size == count and found == pytest.approx(REGULAR, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_bursts_of_a_tenth_of_a_second_that_come_a_little_early_or_late(seed):
    late = np.random.default_rng(seed).normal(0, 5e-4, len(REGULAR) // 100).repeat(100)
    found, size = sampled_s(in_bursts(REGULAR, 100) + late)
    assert size == 100 and np.abs(found - REGULAR).max() < 0.003


def test_a_hole_stays_a_hole():
    """A fifth of a second of bursts is lost: what is left keeps its times, and frames miss it."""
    kept = np.r_[:800, 1000:2000]
    found, size = sampled_s(in_bursts(REGULAR, 10)[kept])
    assert size == 10 and found == pytest.approx(REGULAR[kept], abs=1e-9)
    with pytest.raises(ValueError, match="expected a reading within 0.01 s of each frame"):
        match_nearest(np.arange(0.1, 1.9, 1 / 30), found, largest_gap_s=0.01)


def test_bursts_of_changing_size_keep_their_rate():
    ends = np.cumsum(np.tile([8, 16], 80)) - 1
    stamps = REGULAR[ends[np.searchsorted(ends, np.arange(ends[-1] + 1))]]
    assert sampled_s(stamps)[0] == pytest.approx(REGULAR[: len(stamps)], abs=1e-9)


def test_a_late_burst_squeezes_the_next():
    stamps = in_bursts(REGULAR, 10)
    stamps[500:510] += 0.004
    found, _ = sampled_s(stamps)
    assert (np.diff(found) > 0).all()
    assert np.abs(found - REGULAR).max() == pytest.approx(0.004)


@pytest.mark.parametrize(
    "times",
    [
        REGULAR,
        REGULAR + np.random.default_rng(3).uniform(0, 9e-4, len(REGULAR)),
        np.concatenate([REGULAR, REGULAR + 60]),
        np.concatenate([REGULAR[:200], REGULAR[200:400] + 3, REGULAR[400:] + 9]),
        (3 * np.arange(8)[:, None] + REGULAR[:400]).ravel(),
        REGULAR[::-1],
        REGULAR[:1],
    ],
    ids=["regular", "jitter", "a gap", "two gaps", "triggered", "backwards", "one"],
)
def test_what_comes_otherwise_stays(times):
    found, size = sampled_s(times)
    assert found is times and size == 1


@pytest.fixture(scope="module")
def own(root, tmp_path_factory):
    """A press of the own object: its capture, and the probe's poses as the corners give them."""
    folder, ignored = tmp_path_factory.mktemp("raw") / "toy_cow", shutil.ignore_patterns("back-a02")
    shutil.copytree(root / "tests/own_object/raw/toy_cow", folder, ignore=ignored)
    places = {name: root / f"tests/own_object/{name}" for name in ("sensors", "probes")}
    capture = open_capture(folder / "bench_cam/back", **places)
    return capture, read_table(capture.folder / "force.csv"), press_of(capture, CORNERS)


def forces_n(capture, press):
    """Forces of a capture's own record, and its clock."""
    up = press.plane[:3]
    given = capture.force, press.poses, capture.sensor, capture.probe, Force()
    table, clock = capture_wrenches(*given, up=up)
    return table[FORCE].to_numpy(), clock.offset_s


def test_a_press_in_bursts_is_the_same_press(own, caplog):
    capture, record, press = own
    caplog.set_level("INFO")
    stamps = in_bursts(record["time_s"].to_numpy(), 10)
    write_force(capture.folder, record.assign(time_s=stamps))
    assert check_capture(capture.folder, capture.sensor) == []
    found, offset_s = forces_n(capture, press)
    assert "force.csv: its stamps in bursts of 10 samples, which were spread" in caplog.text
    assert found == pytest.approx(press.wrenches[FORCE].to_numpy(), abs=1e-3)
    assert offset_s == pytest.approx(press.clock.offset_s, abs=1e-4)
    told = "its times came in bursts of 10 samples and were spread evenly"
    assert list(told_of(capture.folder, WRENCH_COLUMNS)) == [told]


def test_a_press_since_1970_is_the_same_press(own):
    """But for the microsecond that tables keep."""
    capture, record, press = own
    frames = read_table(capture.folder / "frames.csv")
    write_frames(capture.folder, frames.assign(time_s=frames["time_s"] + 1.7e9))
    write_force(capture.folder, record.assign(time_s=record["time_s"] + 1.7e9))
    later = press_of(capture, CORNERS)
    write_frames(capture.folder, frames)
    assert later.poses["time_s"].to_numpy() == pytest.approx(press.poses["time_s"], abs=2e-6)
    found, expected = (each.wrenches[FORCE].to_numpy() for each in (later, press))
    assert found == pytest.approx(expected, abs=1e-3)
    assert later.clock.offset_s == pytest.approx(press.clock.offset_s, abs=1e-4)
    assert later.clock.std_s == pytest.approx(press.clock.std_s, rel=0.01)


def test_frames_without_rows_are_one_line(tmp_path):
    (tmp_path / "frames.csv").write_text("frame,time_s\n")
    write_force(tmp_path, pd.DataFrame(0.0, index=range(3), columns=["time_s", *WRENCH_COLUMNS]))
    with pytest.raises(ValueError, match="frames.csv: rows: expected at least 1, found 0"):
        read_force(tmp_path)


def test_an_import_keeps_all_samples_of_a_burst():
    """Within a burst stamps since 1970 differ by less than the microsecond that a table keeps."""
    step_ns = 1_000_000
    times_ns = 1_712_345_678_123_456_789 + step_ns * (np.arange(300) // 10 + 1) * 10
    for within_ns in (0, 100):
        stamps = times_ns + within_ns * (np.arange(300) % 10 - 9)
        table, notes = force_table(stamps, np.zeros((300, 6)))
        assert len(table) == 300
        assert np.diff(table["time_s"]) == pytest.approx(step_ns / 1e9, abs=1e-6)
        assert notes == ("force: stamps come in bursts of 10 samples, spread",)


def test_volts_count_where_their_calibration_is_known(probe):
    both = ["time_s", *WRENCH_COLUMNS, *GAUGE_COLUMNS]
    bare = {name: value for name, value in probe.items() if name != "gauge"}
    assert force_columns(both, probe) == GAUGE_COLUMNS
    assert force_columns(both, bare) == WRENCH_COLUMNS
    assert force_columns(GAUGE_COLUMNS, bare) == GAUGE_COLUMNS
    assert force_columns(["time_s", "fx_n"], probe) is None


def test_volts_beside_newtons_are_the_same_everywhere(own):
    """The own object's probe has no gauges: volts beside the newtons say nothing."""
    capture, record, _ = own
    volts = pd.DataFrame(np.full((len(record), 6), 0.5), columns=list(GAUGE_COLUMNS))
    write_force(capture.folder, pd.concat([record, volts], axis=1))
    probes = {capture.probe["probe"]: capture.probe}
    sensors = {capture.sensor["sensor"]: capture.sensor}
    assert check_object(capture.folder.parents[1], sensors, probes) == []
    assert zeroed(capture.force, capture.probe, 0.5, 0.0).columns == WRENCH_COLUMNS
    told = "it has volts and newtons, of which fx_n..tz_nm were taken"
    assert list(told_of(capture.folder, WRENCH_COLUMNS)) == [told]
