"""What tests of captures share."""

import shutil

import pytest
from bag_writing import stand_in


@pytest.fixture
def block(root, tmp_path):
    """The sample's block with the Kinect's capture alone."""
    folder = tmp_path / "foam_block"
    source = root / "tests/sample/raw/foam_block"
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("bumblebee"))
    return folder


@pytest.fixture
def film():
    """A small film of noise."""
    return stand_in()
