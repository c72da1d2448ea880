"""Recordings that are damaged or made to harm are rejected in one line."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from bag_writing import COLOR, Messages
from import_help import assert_like, bag_of, bring, rejected
from palpate.capture.importing import bags
from palpate.capture.tables import read_frames
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin


@pytest.mark.parametrize("kind", ["ros1", "db3", "mcap", "metadata"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_recording_that_was_cut(kind, share, film, tmp_path, capsys):
    if kind == "ros1":
        recording = path = bag_of(tmp_path, film)
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        recording = bag_of(tmp_path, film, ros1=False, plugin=plugin)
        path = recording / "metadata.yaml" if kind == "metadata" else next(recording.glob("film*"))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_like("film.*: (content|bag|compression|metadata)", rejected(capsys, tmp_path, recording))


@pytest.mark.long
@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_damaged_bytes_never_make_a_traceback(kind, film, tmp_path, capsys):
    """Each of many bags with wrong bytes is rejected in a line or comes back as a whole capture."""
    few = replace(film, wrench=film.wrench[::20], wrench_ns=film.wrench_ns[::20])
    if kind == "ros1":
        recording = path = bag_of(tmp_path, few)
    else:
        folder = bag_of(tmp_path, few, ros1=False, plugin=StoragePlugin.MCAP)
        recording = path = next(folder.glob("*.mcap"))
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
        if bring(recording, target):
            rejections += 1
            assert len(capsys.readouterr().err.strip().splitlines()) == 1
            assert not target.exists()
        else:
            assert len(read_frames(target)) == len(film.color)
    assert rejections > 3


def test_chunk_larger_than_the_file(film, tmp_path, capsys):
    bag = bag_of(tmp_path, film)
    data = bag.read_bytes()
    # Of the first chunk: its header's length, the header, and the chunk's size.
    field = data.index(b"compression=none") - 4
    starts = range(field, 0, -1)
    lengths = (struct.unpack("<I", data[start : start + 4])[0] for start in starts)
    start, length = next(
        (start, length)
        for start, length in zip(starts, lengths, strict=True)
        if 30 < length < 100 and start + 4 <= field < start + 4 + length
    )
    place = start + 4 + length
    bag.write_bytes(data[:place] + struct.pack("<I", 2**32 - 1) + data[place + 4 :])
    assert_like("film.bag: content: expected a whole bag", rejected(capsys, tmp_path, bag))


def test_large_messages(film, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(bags, "LARGEST_BYTES", 5000)
    line = rejected(capsys, tmp_path, bag_of(tmp_path, film))
    assert_like("film.bag: message: expected at most 5000 bytes, found 9", line)


def test_folders_packed_as_a_whole(film, tmp_path, capsys):
    packed = (CompressionMode.FILE, CompressionFormat.ZSTD)
    line = rejected(capsys, tmp_path, bag_of(tmp_path, film, ros1=False, compression=packed))
    assert_like("metadata.yaml: compression_mode: expected none .* found file", line)


def test_messages_that_the_bag_promised(film, tmp_path, capsys):
    recording = bag_of(tmp_path, film, ros1=False)
    metadata = recording / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("message_count: 6\n", "message_count: 7\n"))
    line = rejected(capsys, tmp_path, recording)
    assert_like("film: messages: expected 381, as the bag states, found 379", line)


def test_a_known_name_for_another_type(film, tmp_path, capsys):
    """A type that only goes by the name of one of ROS would be misread."""
    bag = bag_of(tmp_path, film)
    data = bag.read_bytes()
    digest = Messages(ros1=True).store.generate_msgdef("geometry_msgs/msg/WrenchStamped")[1]
    bag.write_bytes(data.replace(digest.encode(), b"0" * 32))
    line = rejected(capsys, tmp_path, bag)
    assert_like(f"wrench: type: expected geometry_msgs/msg/WrenchStamped {digest}, found 000", line)


def test_names_that_steer_a_terminal(film, tmp_path, capsys):
    def change(topic, time, message, _):
        return (topic + "\x1b[31m\nred" * (topic == COLOR), time, message)

    line = rejected(capsys, tmp_path, bag_of(tmp_path, film, change), "--color", "/x")
    assert "\x1b" not in line and "?[31m?red" in line
