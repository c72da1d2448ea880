"""No code of the workflow runs what a capture holds (ruff's rules forbid the ways to do it)."""

import re

import numpy as np
import pytest


def test_arrays_are_never_unpickled(tmp_path):
    """What NumPy does by default, on which all reading of arrays rests."""
    np.save(tmp_path / "a.npy", np.array([object()]), allow_pickle=True)
    with pytest.raises(ValueError, match="allow_pickle"):
        np.load(tmp_path / "a.npy")


def test_rules_are_scripts(root):
    """A rule's shell line would take names of captures into a shell."""
    files = [root / "Snakefile", *root.glob("workflow/Snakefile"), *root.glob("workflow/**/*.smk")]
    assert len(files) > 5
    for path in files:
        assert not re.search(r"^\s+(shell|run):", path.read_text(), re.MULTILINE), path
