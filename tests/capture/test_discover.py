"""Captures are found by looking into raw/, and what changes there is noticed."""

import pytest
from palpate.capture.discover import (
    CAPTURE_NAME,
    CaptureId,
    discover,
    folder_fingerprint,
    sensor_folders,
    stamp,
)


def test_finds_captures_in_order_and_passes_over_the_rest(tmp_path):
    for folder in (
        "foam_block/kinect/11-a03",
        "foam_block/kinect/08",
        "foam_block/kinect/background",
        "foam_block/kinect/.part-09",
        "foam_block/.hidden/08",
        "foam_block/scans/08",
        "apple/bumblebee/01",
        "sensors/kinect/pivot",
        ".part-pear/kinect/01",
    ):
        (tmp_path / folder).mkdir(parents=True)
    for name in ("notes.txt", "foam_block/object.yaml", "foam_block/kinect/notes.txt"):
        (tmp_path / name).write_text("")
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
    assert sensor_folders(tmp_path / "raw") == () and discover(tmp_path / "raw") == []
    assert not zed.has_background and zed.background == tmp_path / "zed/background"


def test_a_captures_name_begins_with_its_point():
    for name, point in {"08": "08", "11-a03": "11", "p1": "p1"}.items():
        assert CaptureId("foam_block", "kinect", name).point == point
        assert CAPTURE_NAME.fullmatch(name)
    for name in ("08-b", "08-a", "08-second try", "08_a1", "-a1", "08-a1-a2"):
        assert not CAPTURE_NAME.fullmatch(name)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "left").mkdir()
    (tmp_path / "left/000000.png").write_bytes(b"image")
    (tmp_path / "force.csv").write_text("time_s\n")
    return tmp_path


@pytest.mark.parametrize(
    ("file", "changes"),
    [("left/000000.png", True), ("left/000001.png", True), (".snakemake_timestamp", False)],
)
def test_a_fingerprint_changes_with_visible_files(folder, file, changes):
    (folder / "left/itself.png").symlink_to("itself.png")
    before = folder_fingerprint(folder)
    (folder / file).write_bytes(b"another image")
    assert (folder_fingerprint(folder) != before) == changes


def test_links_that_lead_nowhere_or_round_do_not_count(folder):
    before = folder_fingerprint(folder, linked=2)
    for link, target in {"itself": "itself", "there": "back", "back": "there"}.items():
        (folder / link).symlink_to(target)
    assert folder_fingerprint(folder, linked=2) == before
    nothing = folder_fingerprint(folder / "none")
    assert {folder_fingerprint(folder / "itself", linked=n) for n in (0, 2)} == {nothing}
    assert stamp(folder / "itself") == ""
    (folder / "left/above").symlink_to("..")
    assert folder_fingerprint(folder, linked=2) != before  # entered as far as links may lead


@pytest.mark.parametrize("place", ["kinect", "kinect/08"])
def test_an_objects_sensor_or_capture_may_be_a_link(folder, place):
    """On another disk: what lies there counts, and a link to a link ends."""
    link = folder / "raw/sponge" / place
    link.parent.mkdir(parents=True)
    link.symlink_to(folder / "left")
    (folder / "left/round").symlink_to(folder / "left")
    before = folder_fingerprint(folder / "raw/sponge", linked=2)
    (folder / "left/000000.png").write_bytes(b"another image")
    assert folder_fingerprint(folder / "raw/sponge", linked=2) != before
