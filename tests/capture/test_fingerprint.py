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
