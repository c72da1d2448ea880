"""What tests of captures share."""

import shutil

import pytest
from bag_writing import stand_in
from palpate.__main__ import main


@pytest.fixture
def block(root, tmp_path):
    """The sample's block with the Kinect's capture alone."""
    folder = tmp_path / "foam_block"
    source = root / "tests/sample/raw/foam_block"
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("bumblebee"))
    return folder


@pytest.fixture
def said(capsys):
    """Give a command, whose status is asserted: what it says."""

    def run(*words, status=0):
        capsys.readouterr()
        assert main([*map(str, words)]) == status
        return "".join(capsys.readouterr())

    return run


@pytest.fixture
def film():
    """A small film of noise."""
    return stand_in()


@pytest.fixture
def target(tmp_path):
    """Where an import puts a capture."""
    return tmp_path / "raw/block/camera/08"
