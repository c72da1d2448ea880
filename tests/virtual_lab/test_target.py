"""Targets that the lab has."""

import pytest
from virtual_lab.probe import make_target


def test_targets_that_the_lab_does_not_have():
    with pytest.raises(ValueError, match="marker.kind: expected checkerboard in the lab"):
        make_target({"kind": "aprilgrid"})
