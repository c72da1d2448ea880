"""Captures are found by looking into raw/, and by nothing else."""

import pytest
from palpate.capture.discover import CAPTURE_NAME, CaptureId, discover, sensor_folders


def test_finds_captures_in_order_and_passes_over_the_rest(tmp_path):
    for folder in (
        "foam_block/kinect/11-a03",
        "foam_block/kinect/08",
        "foam_block/kinect/background",
        "foam_block/kinect/.part-09",
        "foam_block/.hidden/08",
        "foam_block/scans/08",
        "apple/bumblebee/01",
        ".part-pear/kinect/01",
    ):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "foam_block/object.yaml").write_text("")
    (tmp_path / "foam_block/kinect/notes.txt").write_text("")
    assert discover(tmp_path) == [
        CaptureId("apple", "bumblebee", "01"),
        CaptureId("foam_block", "kinect", "08"),
        CaptureId("foam_block", "kinect", "11-a03"),
    ]


def test_what_stands_in_an_objects_folder(tmp_path):
    for name in ("kinect/background", "kinect/b2", "kinect/A1", "kinect/.part-x", "zed/1", "scans"):
        (tmp_path / name).mkdir(parents=True)
    kinect, zed = sensor_folders(tmp_path)
    assert kinect.folder == tmp_path / "kinect" and kinect.has_background
    assert [place.name for place in kinect.contents] == ["background", "A1", "b2"]
    assert zed.contents == zed.captures == (tmp_path / "zed/1",)
    assert not zed.has_background and zed.background == tmp_path / "zed/background"


def test_nothing_where_there_is_no_folder(tmp_path):
    assert discover(tmp_path / "raw") == []
    assert sensor_folders(tmp_path / "raw") == ()


@pytest.mark.parametrize(("name", "point"), [("08", "08"), ("11-a03", "11"), ("p1", "p1")])
def test_a_captures_name_begins_with_its_point(name, point):
    assert CaptureId("foam_block", "kinect", name).point == point
    assert CAPTURE_NAME.fullmatch(name)


@pytest.mark.parametrize("name", ["08-b", "08-a", "08-second try", "08_a1", "-a1", "08-a1-a2"])
def test_names_that_the_workflow_does_not_take(name):
    assert not CAPTURE_NAME.fullmatch(name)
