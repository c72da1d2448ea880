"""What tests of the import share: recordings of each kind, imports and their refusals."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
from bag_writing import (
    NANOSECONDS,
    Messages,
    camera_messages,
    write_realsense,
    write_ros1,
    write_ros2,
    write_tum,
    write_wrenches,
)
from palpate.__main__ import main
from palpate.capture.images import depth_of, read_image
from palpate.capture.tables import WRENCH_COLUMNS, read_table
from palpate.yaml_files import load_yaml
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin


def bag_of(path, film, change=None, *, ros1=True, **options):
    """A bag with each (topic, time, message) changed, or left out where nothing comes back."""
    messages = Messages(ros1=ros1)
    found = camera_messages(film, messages)
    if change:
        changed = (change(*item, messages) for item in found)
        found = [item for item in changed if item is not None]
    write = write_ros1 if ros1 else write_ros2
    return write(path / ("film.bag" if ros1 else "film"), found, messages, **options)


ZSTD = (CompressionMode.STORAGE, CompressionFormat.ZSTD)
ros1, sqlite3 = bag_of, partial(bag_of, ros1=False)
ros1_lz4 = partial(bag_of, compression=Writer1.CompressionFormat.LZ4)
mcap_folder = partial(sqlite3, plugin=StoragePlugin.MCAP, compression=ZSTD)


def mcap_file(path, film):
    return next(mcap_folder(path, film).glob("*.mcap"))


def db3_file(path, film):
    return next(sqlite3(path, film).glob("*.db3"))


def realsense(path, film, **options):
    return write_realsense(path / "film.bag", film, **options)


realsense_of_old = partial(realsense, marked=False)


def tum(path, film):
    return write_tum(path / "film", film)


# Each film comes back from these.
KINDS = [ros1, ros1_lz4, sqlite3, db3_file, mcap_folder, mcap_file]
KINDS += [realsense, realsense_of_old, tum]


def bring(recording, target, *options, sensors=None):
    sensors = sensors or target.parents[3] / "sensors"
    return main(["import", str(recording), str(target), "--sensors", str(sensors), *options])


def read_spec(tmp_path):
    """The sensor's file that an import wrote."""
    return load_yaml(tmp_path / "sensors/camera.yaml")


def options_for(kind, path, film):
    """Those without which it is no capture: forces of a recording that can't hold any, optics."""
    if kind in (realsense, realsense_of_old):
        return ["--force", str(write_wrenches(path / "wrench.csv", film))]
    return ["--intrinsics", *map(str, film.color_optics)] if kind is tum else []


def assert_same(folder, film):
    frames, force = (read_table(folder / name) for name in ("frames.csv", "force.csv"))
    spec = load_yaml(folder.parents[3] / f"sensors/{folder.parent.name}.yaml")
    assert len(frames) == len(film.color)
    np.testing.assert_allclose(frames["time_s"], film.color_ns / NANOSECONDS, rtol=0, atol=1e-6)
    np.testing.assert_allclose(force["time_s"], film.wrench_ns / NANOSECONDS, rtol=0, atol=1e-6)
    found = force[list(WRENCH_COLUMNS)].to_numpy()
    np.testing.assert_allclose(found, film.wrench, rtol=1e-8, atol=1e-12)
    for row, color, depth in zip(frames.itertuples(), film.color, film.depth, strict=True):
        assert np.array_equal(read_image(folder / row.color, "rgb8"), color)
        found_m = np.nan_to_num(depth_of(read_image(folder / row.depth, "counts"), spec["depth"]))
        assert np.array_equal(np.rint(1000 * found_m), depth)


def left(film, lost, *kinds):
    """A film without some images, of both kinds where none is named."""
    changes = {}
    for kind in kinds or ("color", "depth"):
        images, stamps = getattr(film, kind), getattr(film, f"{kind}_ns")
        changes[kind] = [image for k, image in enumerate(images) if k not in lost]
        changes[f"{kind}_ns"] = np.delete(stamps, lost)
    return replace(film, **changes)


def without(*topics):
    return lambda topic, time, message, _: None if topic in topics else (topic, time, message)


def with_message(wanted, work):
    def change(topic, time, message, messages):
        return (topic, time, work(message, messages) if topic == wanted else message)

    return change


def attributes(**values):
    def work(message, _):
        for name, value in values.items():
            setattr(message, name, value)
        return message

    return work


def rejected(capsys, tmp_path, recording, *options, target="raw/block/camera/08"):
    """The one line of a rejected import, after which nothing stands where nothing stood."""
    before = sorted(tmp_path.rglob("*"))
    capsys.readouterr()
    assert bring(recording, tmp_path / target, *options, sensors=tmp_path / "sensors") == 1
    said = capsys.readouterr()
    assert not said.out
    (line,) = said.err.strip().splitlines()
    assert sorted(tmp_path.rglob("*")) == before
    assert line.startswith("error: ")
    return line.removeprefix("error: ")


def assert_like(pattern, line):
    assert re.search(pattern, line), line
