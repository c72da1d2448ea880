"""The fingerprint of a folder changes with its files and not with hidden ones."""

import pytest
from palpate.capture.fingerprint import folder_fingerprint


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "left").mkdir()
    (tmp_path / "left" / "000000.png").write_bytes(b"image")
    (tmp_path / "force.csv").write_text("time_s\n")
    return tmp_path


def test_changes_with_a_replaced_image(folder):
    before = folder_fingerprint(folder)
    (folder / "left" / "000000.png").write_bytes(b"another image")
    assert folder_fingerprint(folder) != before


def test_changes_with_a_new_file(folder):
    before = folder_fingerprint(folder)
    (folder / "left" / "000001.png").write_bytes(b"image")
    assert folder_fingerprint(folder) != before


def test_passes_over_hidden_files(folder):
    before = folder_fingerprint(folder)
    (folder / ".snakemake_timestamp").write_bytes(b"")
    assert folder_fingerprint(folder) == before


@pytest.mark.parametrize("place", ["kinect", "kinect/08"])
def test_an_objects_sensor_or_capture_may_be_a_link(folder, tmp_path, place):
    """On another disk: what lies there counts, and a link to a link ends."""
    link = tmp_path / "raw/sponge" / place
    link.parent.mkdir(parents=True)
    link.symlink_to(folder / "left")
    (folder / "left" / "round").symlink_to(folder / "left")
    before = folder_fingerprint(tmp_path / "raw/sponge", linked=2)
    (folder / "left" / "000000.png").write_bytes(b"another image")
    assert folder_fingerprint(tmp_path / "raw/sponge", linked=2) != before
