"""Recordings that are damaged or made to harm are rejected in one line."""

import struct
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from bag_writing import COLOR, Messages
from import_help import assert_like, bag_of, bring, rejected, ros1, sqlite3
from palpate.capture.importing import bags
from palpate.capture.tables import read_frames
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin

mcap = partial(sqlite3, plugin=StoragePlugin.MCAP)
packed = partial(sqlite3, compression=(CompressionMode.FILE, CompressionFormat.ZSTD))
KINDS = {"ros1": ros1, "db3": sqlite3, "mcap": mcap, "yaml": sqlite3}


def recorded(kind, folder, film):
    """A recording, and the file of it that is damaged."""
    recording = KINDS[kind](folder, film)
    return recording, next(recording.glob(f"*.{kind}"), recording)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_recording_that_was_cut(kind, share, film, tmp_path, capsys):
    recording, path = recorded(kind, tmp_path, film)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_like("film.*: (content|bag|compression|metadata)", rejected(capsys, tmp_path, recording))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_damaged_bytes_never_make_a_traceback(kind, film, tmp_path, capsys):
    """Each of many bags with wrong bytes is rejected in a line or comes back as a whole capture."""
    few = replace(film, wrench=film.wrench[::20], wrench_ns=film.wrench_ns[::20])
    _, path = recorded(kind, tmp_path, few)
    whole, random = path.read_bytes(), np.random.default_rng(8)
    rejections = 0
    for k in range(25):
        damaged = bytearray(whole)
        # Heads and the index at the end hold the sizes; the rest is mostly pixels.
        places = [*random.integers(0, 400, 2), len(whole) - 1 - random.integers(0, 5000)]
        for place in places:
            damaged[place] = random.integers(0, 256)
        path.write_bytes(damaged)
        target = tmp_path / f"raw/block/camera/{k:02d}"
        if bring(path, target):
            rejections += 1
            assert len(capsys.readouterr().err.strip().splitlines()) == 1
            assert not target.exists()
        else:
            assert len(read_frames(target)) == len(film.color)
    assert rejections > 3


def large_chunk(path, film):
    """The first chunk's header, of 41 bytes, is followed by the chunk's size."""
    bag = ros1(path, film)
    data = bag.read_bytes()
    place = data.rindex(struct.pack("<I", 41), 0, data.index(b"compression=none")) + 4 + 41
    bag.write_bytes(data[:place] + struct.pack("<I", 2**32 - 1) + data[place + 4 :])
    return bag


def one_promised(path, film):
    recording, metadata = recorded("yaml", path, film)
    metadata.write_text(metadata.read_text().replace("message_count: 6\n", "message_count: 7\n"))
    return recording


DIGEST = Messages(ros1=True).store.generate_msgdef("geometry_msgs/msg/WrenchStamped")[1]


def another_type(path, film):
    """A type that only goes by the name of one of ROS would be misread."""
    bag = ros1(path, film)
    bag.write_bytes(bag.read_bytes().replace(DIGEST.encode(), b"0" * 32))
    return bag


DAMAGED = {
    large_chunk: "film.bag: content: expected a whole bag",
    packed: "metadata.yaml: compression_mode: expected none .* found file",
    one_promised: "film: messages: expected 381, as the bag states, found 379",
    another_type: f"type: expected geometry_msgs/msg/WrenchStamped {DIGEST}, found 000",
}


@pytest.mark.parametrize("make", DAMAGED)
def test_a_recording_that_contradicts_itself_or_is_packed(make, film, tmp_path, capsys):
    assert_like(DAMAGED[make], rejected(capsys, tmp_path, make(tmp_path, film)))


def test_large_messages(film, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(bags, "LARGEST_BYTES", 5000)
    line = rejected(capsys, tmp_path, ros1(tmp_path, film))
    assert_like("film.bag: message: expected at most 5000 bytes, found 9", line)


def test_names_that_steer_a_terminal(film, tmp_path, capsys):
    def change(topic, time, message, _):
        return (topic + "\x1b[31m\nred" * (topic == COLOR), time, message)

    line = rejected(capsys, tmp_path, bag_of(tmp_path, film, change), "--color", "/x")
    assert "\x1b" not in line and "?[31m?red" in line
