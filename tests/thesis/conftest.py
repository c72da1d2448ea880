"""The kept mesh of the study's block, indented."""

import pytest
from indented_block import indented_block
from palpate.solid.mesh import read_solid


@pytest.fixture(scope="session")
def exact(root):
    """Block with the displacement that an indentation causes at the true moduli."""
    return indented_block(read_solid(root / "config/meshes/foam_block.vtu"), [-0.05, 0, 0.0475])
