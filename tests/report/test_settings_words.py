"""What an object's results rest on, and the checksums of it."""

import hashlib
from types import SimpleNamespace

import numpy as np
import yaml
from palpate.report.settings_words import checksums, rests_on, told_whole

SPEC = {
    "template": {"file": "form.ply"},
    "support": {"plane_point_m": [0.0, 0.0, 0.01], "contact": "resting"},
    "points": {"top": {"position_m": [0.01, 0.0, 0.0625]}},
}
PROBE = {"probe": "pen", "indenter": {"shape": "sphere", "radius_m": 0.004}}
QUALITY = {"nodes": 900, "elements": 3000, "largest_gap_m": 0.0007}


SENSOR = {"sensor": "kinect", "kind": "depth", "color": {"width_px": 640, "height_px": 480}}
TABLE = SimpleNamespace(
    depth_m=np.array([0.0, 0.002, 0.005]), radius_m=0.004, poisson_ratios=np.array([0.0, 0.3, 0.49])
)


def press(hold_s):
    found = {"rate_hz": 29.97, "distance_m": 0.618, "time_s": np.zeros(40), "hold_s": hold_s}
    return SimpleNamespace(capture={"sensor": "kinect"}, seconds_to=lambda depth: 1.52, **found)


def test_probe_mesh_support_and_version_are_told():
    held, tables = [press(0.5), press(1.0)], {"top": TABLE}
    rows = rests_on(SPEC, PROBE, QUALITY, [SENSOR], held, tables, "1.2")
    told = {row[""]: row["what it was"] for row in rows}
    assert told["probe"] == "pen: sphere of radius 4 mm"
    camera = "Kinect (depth), 640 x 480 pixels, 30.0 frames a second, 0.62 m from the tip"
    assert told["camera"] == f"{camera} at the deepest" and told["Palpate"] == "1.2"
    pressed = "Kinect: 2, of 40 frames; 1.5 s to the deepest, held for 0.5 to 1.0 s"
    assert told["presses"] == pressed
    assert told["indentation table"] == "top: to 5.0 mm (1.25 radii), at nu 0, 0.3, 0.49"
    assert told["solid mesh"].startswith("900 nodes, 3000 tetrahedra, at most 0.7 mm")
    assert told["support"] == "loose: it only stands there; plane through (0.0, 0.0, 10.0) mm"
    assert told["points pressed"] == "top at (10.0, 0.0, 62.5) mm"
    bonded = SPEC | {"support": {"plane_point_m": [0, 0, 0]}}
    rows = rests_on(bonded, PROBE, QUALITY, [], [], {}, "1")
    told = {row[""]: row["what it was"] for row in rows}
    assert "held where it stands" in told["support"]


def test_files_are_told_whole():
    text = told_whole(object=SPEC, probe=PROBE)
    blocks = text.split("```yaml\n")[1:]
    assert [yaml.safe_load(block.split("```")[0]) for block in blocks] == [SPEC, PROBE]


def test_checksums_are_those_of_files_and_follow_names_and_content(tmp_path):
    file, folder = tmp_path / "a.csv", tmp_path / "capture"
    file.write_text("x\n")
    (folder / "color").mkdir(parents=True)
    (folder / "color/0.png").write_bytes(b"0")
    (folder / ".hidden").write_text("of an editor")
    named = {"a": str(file), "capture": str(folder)}

    def found():
        return {row["file"]: row["SHA-256"] for row in checksums(named)}

    before = found()
    assert before["a"] == hashlib.sha256(b"x\n").hexdigest()
    (folder / ".hidden").unlink()
    assert found() == before
    (folder / "color/0.png").rename(folder / "color/1.png")
    renamed = found()
    (folder / "color/1.png").write_bytes(b"1")
    assert len({before["capture"], renamed["capture"], found()["capture"]}) == 3
