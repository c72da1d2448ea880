"""Clouds as files: what is read of them, and the line for each that is wrong."""

import numpy as np
import pandas as pd
import pytest
from palpate.capture.check_capture import check_capture
from palpate.capture.clouds import read_cloud
from palpate.capture.poses import PoseRecord, write_poses
from palpate.capture.tables import WRENCH_COLUMNS, write_force, write_frames
from palpate.config.sensor import SensorSpec
from palpate.examine import examine_frames

SENSOR = {"sensor": "zivid", "kind": "cloud", "cloud": {"unit": "m"}, "range_m": [0.2, 2.0]}
SENSOR |= {"base": {"camera_from_base": np.eye(4).tolist()}}
POINTS = np.random.default_rng(0).uniform([-0.1, -0.1, 0.6], [0.1, 0.1, 0.8], (120, 3))
PLY = "ply\nformat {} 1.0\nelement vertex {}\n{}end_header\n"
PCD = """VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z\nSIZE 4 4 4 4 4 4\nTYPE F F F F F F
COUNT 1 1 1 1 1 1\nWIDTH 15\nHEIGHT 10\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 150\nDATA binary\n"""


def ply(path, rows=POINTS, form="ascii"):
    """As a person's own script writes it."""
    names = ("x", "y", "z", "nx", "ny", "nz")[: rows.shape[1]]
    head = PLY.format(form, len(rows), "".join(f"property float {name}\n" for name in names))
    text = "".join(" ".join(map(str, row)) + "\n" for row in rows.tolist()).encode()
    path.write_bytes(head.encode() + (text if form == "ascii" else rows.astype("<f4").tobytes()))
    return path


def test_points_and_normals_are_read_in_metres(tmp_path):
    """The organised cloud has 120 points in 150 places, and 100 of them have a normal."""
    values = np.full((150, 6), np.nan, np.float32)
    values[:120, :3], values[:100, 3:] = POINTS, [0, 0, -1]
    (organised := tmp_path / "0.pcd").write_bytes(PCD.encode() + values.tobytes())
    binary = ply(tmp_path / "1.ply", values[:120], "binary_little_endian")
    for found in map(read_cloud, (organised, binary)):
        assert found.points_m == pytest.approx(POINTS[:100], abs=1e-6)
        assert found.normals == pytest.approx(np.tile([0, 0, -1.0], (100, 1)))
    for scale, unit in ((1, "m"), (1000, "mm")):
        found = read_cloud(ply(tmp_path / f"{unit}.PLY", scale * POINTS), unit)
        assert found.normals is None and found.points_m == pytest.approx(POINTS, abs=1e-6)
    binary.write_bytes(binary.read_bytes()[:-9])
    few = ply(tmp_path / "2.ply", POINTS[:99])
    for path, line in ((binary, "a whole PLY file"), (few, "100 points or more, found 99")):
        with pytest.raises(ValueError, match=f"^{path}: cloud: expected {line}"):
            read_cloud(path)


def test_each_fault_of_a_capture_has_its_line(tmp_path):
    (tmp_path / "cloud").mkdir()
    frames = pd.DataFrame({"time_s": [0, 0.1, 0.2]}).rename_axis("frame").reset_index()
    frames["cloud"] = names = [f"cloud/{k:06}.ply" for k in range(3)]
    write_frames(tmp_path, frames)
    force = dict.fromkeys(WRENCH_COLUMNS, 0.0) | {"time_s": np.arange(30) / 100}
    write_force(tmp_path, pd.DataFrame(force))
    poses = PoseRecord(np.linspace(0, 0.2, 5), np.tile(np.eye(4), (5, 1, 1)), np.full(5, np.nan))
    write_poses(tmp_path, poses)
    first, second, third = (ply(tmp_path / name, POINTS + 1e-4 * k) for k, name in enumerate(names))
    assert check_capture(tmp_path, SENSOR) == []
    (line,) = examine_frames(tmp_path, SENSOR).found
    assert "120 points without normals, 100% of them in range" in line
    ply(first, 1000 * POINTS)
    with pytest.raises(ValueError, match=r"0.2 to 2 m from the camera .*, found them 7\d\d m away"):
        examine_frames(tmp_path, SENSOR)
    third.write_bytes(second.read_bytes())
    (line,) = check_capture(tmp_path, SENSOR)
    assert f"another cloud in each frame, found {names[2]} the same as {names[1]}" in line
    second.write_text("points"), third.unlink()
    wrong = [f"{second}: cloud: expected a cloud as .ply or .pcd, found something else"]
    wrong += [f"{third}: cloud: expected a cloud, found nothing"]
    assert check_capture(tmp_path, SENSOR) == wrong
    with pytest.raises(ValueError, match="^optics: expected none with kind cloud, found one$"):
        SensorSpec.read(SENSOR | {"frame_rate_hz": 10.0, "optics": "calibration"})
