"""Objects of the study, and what an object's results depend on."""

from pathlib import Path

from palpate.capture.discover import CaptureId
from palpate.workflow.standing import kept_files, value_digest
from settings import full
from thesis.run import StudyRun

STICK = {"probe": "stick"}


def test_objects_of_the_study_are_nobodys_own(root):
    config = full(root)
    config["study"] |= {"block": "brick", "captures": {"slab": {}}}
    names = ("brick", "cushion", "ear", "foam_ball", "slab")
    found = tuple(CaptureId(name, "kinect", "01") for name in names)
    given = {"sensors": {}, "probes": {}, "lab": None, "curves": (), "seen": {}}
    run = StudyRun(config=config, found=found, simulated=frozenset(), **given)
    assert run.own == {"cushion"} and run.minimised == tuple(c for c in found if c != found[1])


def test_digest_of_values_has_no_order():
    assert value_digest({"a": 1, "b": [1, 2]}) == value_digest({"b": [1, 2], "a": 1})
    assert value_digest({"a": 1}) != value_digest({"a": 2})


def test_files_outside_the_object_count(tmp_path):
    paths = {"raw": str(tmp_path / "raw"), "meshes": str(tmp_path / "meshes")}
    sensors = {"kinect": {"optics": "calibration"}, "stereo": {"optics": {"focal_px": 1.0}}}
    board = Path(paths["raw"]) / "sensors/kinect/calibration/board.png"
    board.parent.mkdir(parents=True)
    board.write_bytes(b"one")
    first = kept_files("cushion", sensors, STICK, paths)
    assert set(first) == {"kinect/calibration"}
    (board.parents[1] / "hand_eye").mkdir()
    arm = {"kinect": {"base": {"camera_from_base": "calibration"}}}
    assert set(kept_files("cushion", arm, STICK, paths)) == {"kinect/hand_eye"}
    film = board.parents[1] / "pivot/frames.csv"
    film.parent.mkdir()
    film.write_text("frame,time_s\n")
    turned = STICK | {"tip": "calibration"}
    assert set(kept_files("cushion", sensors, turned, paths)) == {
        "kinect/calibration",
        "kinect/pivot",
    }
    # A probe with a tip of its own does not hang on it.
    assert kept_files("cushion", sensors, STICK, paths) == first
    film.unlink()
    film.parent.rmdir()
    board.write_bytes(b"another")
    assert kept_files("cushion", sensors, STICK, paths) != first
    Path(paths["meshes"]).mkdir()
    (Path(paths["meshes"]) / "cushion.vtu").write_bytes(b"mesh")
    assert set(kept_files("cushion", sensors, STICK, paths)) == {"kinect/calibration", "mesh"}
